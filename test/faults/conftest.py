"""Fixtures of the tests of faults."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from faulty_run import FaultyRun
from forking import forked_nodes
from run_command import start as start_command

from gameinfer_ros.commands import cli

__all__ = ["forked_nodes", "start_command"]

Start = Callable[..., FaultyRun]


@pytest.fixture
def start(start_command: Callable[..., Any]) -> Start:
    """Starts `gameinfer run` with some arguments; in realtime and without an end by default."""

    def make(*arguments: object, steps: int = 10**6, **options: Any) -> FaultyRun:
        return start_command("--steps", steps, *arguments, kind=FaultyRun, **options)

    return make


@pytest.fixture
def inspect(capsys: pytest.CaptureFixture[str]) -> Callable[[Path], dict[str, Any]]:
    def run(bag: Path) -> dict[str, Any]:
        capsys.readouterr()
        assert cli.main(["inspect", str(bag), "--json"]) == 0, capsys.readouterr().err
        return json.loads(capsys.readouterr().out)

    return run
