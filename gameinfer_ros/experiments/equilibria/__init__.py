"""The study of equilibria: how many a game has, and what they look like."""
