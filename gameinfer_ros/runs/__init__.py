"""Runs: seeds, the closed loop, and the record of what happened, with its pictures."""
