"""Signals, processes, locks, terminals and shared memory."""
