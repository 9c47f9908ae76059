"""What viewers show, and how they control a run."""
