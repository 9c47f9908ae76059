"""Fixtures of tests that play with nodes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from browser import Browser
from small_scenario import ScenarioFile, scenario_file
from watcher import WatcherFactory
from wire import wire
from world import make_world, world

__all__ = ["make_world", "scenario_file", "wire", "world"]


@pytest.fixture
def make_watcher(
    make_world: Callable[[], Any], wire: Any, scenario_file: ScenarioFile
) -> WatcherFactory:
    return WatcherFactory(make_world, wire, scenario_file)


@pytest.fixture
def browser() -> Iterator[Browser]:
    made = Browser()
    yield made
    made.end()
