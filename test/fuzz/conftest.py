"""Fixtures of tests that send nodes what they cannot use."""

from __future__ import annotations

from page_server import asked, live_run, server
from small_scenario import scenario_file
from wire import wire
from world import make_world, world

__all__ = ["asked", "live_run", "make_world", "scenario_file", "server", "wire", "world"]
