"""Starts, watches and ends the nodes of a run; replays bags."""
