"""Inference of the equilibrium that people play, and a robot that plays its part of it."""

from gameinfer_ros import compiled

compiled.keep_apart()
