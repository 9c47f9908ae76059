"""Cost terms: what players want, one kind per file."""
