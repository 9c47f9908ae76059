"""Signals, processes, locks and terminals."""
