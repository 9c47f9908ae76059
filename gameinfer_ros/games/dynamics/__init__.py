"""Dynamics: how players move, one kind a file."""
