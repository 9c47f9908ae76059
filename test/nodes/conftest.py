"""Fixtures of tests that play with nodes."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from browser import Browser
from small_scenario import scenario_file
from wire import wire
from world import make_world, world

__all__ = ["make_world", "scenario_file", "wire", "world"]


@pytest.fixture
def browser() -> Iterator[Browser]:
    made = Browser()
    yield made
    made.end()
