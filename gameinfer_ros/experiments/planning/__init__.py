"""The study of planning: costs with and without alignment."""
