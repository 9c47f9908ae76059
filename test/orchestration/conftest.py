"""Fixtures of the tests of runs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from run_command import Command, start
from small_scenario import ScenarioFile, scenario_file

__all__ = ["scenario_file", "start"]


@pytest.fixture
def endless(start: Callable[..., Command], scenario_file: ScenarioFile) -> Callable[..., Command]:
    """Starts a run in realtime that does not end by itself."""
    endless = ("--scenario", scenario_file("uu"), "--time", "realtime", "--steps", 10**6)

    def make(*arguments: object, **options: Any) -> Command:
        return start(*endless, *arguments, **options)

    return make
