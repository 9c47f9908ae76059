"""Inference of the equilibrium that people play, and a robot that plays its part of it."""

__version__ = "0.1.0"
