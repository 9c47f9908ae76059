"""Fixtures of the tests of faults."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from faulty_run import FaultyRun
from forking import forked_nodes

from gameinfer_ros.commands import cli

__all__ = ["forked_nodes"]

Start = Callable[..., FaultyRun]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Starts `gameinfer run` with some arguments; in realtime and without an end by default."""
    runs: list[FaultyRun] = []

    def make(*arguments: object, steps: int = 10**6, **options: Any) -> FaultyRun:
        folder = tmp_path / f"run_{len(runs)}"
        runs.append(FaultyRun(folder, "--steps", steps, *arguments, **options))
        return runs[-1]

    yield make
    for run in runs:
        run.end()


@pytest.fixture
def inspect(capsys: pytest.CaptureFixture[str]) -> Callable[[Path], dict[str, Any]]:
    """What `gameinfer inspect` tells of a bag."""

    def run(bag: Path) -> dict[str, Any]:
        capsys.readouterr()
        assert cli.main(["inspect", str(bag), "--json"]) == 0, capsys.readouterr().err
        found = json.loads(capsys.readouterr().out.splitlines()[-1])
        assert isinstance(found, dict)
        return found

    return run
