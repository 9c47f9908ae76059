"""Cost terms: what players want, one kind a file."""
