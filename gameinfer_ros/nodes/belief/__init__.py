"""Components of the inference node."""
