"""Fixtures of tests that send nodes what they cannot use."""

from __future__ import annotations

from small_scenario import scenario_file
from wire import wire
from world import make_world, world

__all__ = ["make_world", "scenario_file", "wire", "world"]
