"""What viewers are sent, and what they may do."""
