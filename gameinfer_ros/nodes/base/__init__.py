"""Base classes and helpers that all nodes share."""
