"""Dynamics: how players move, one kind per file."""
