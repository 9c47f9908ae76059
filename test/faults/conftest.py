"""Fixtures of the tests of faults."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from faulty_run import FaultyRun
from run_command import DEADLINE

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
def inspect() -> Callable[[Path], dict[str, Any]]:
    """What `gameinfer inspect` tells of a bag."""

    def run(bag: Path) -> dict[str, Any]:
        done = subprocess.run(
            [sys.executable, "-m", "gameinfer_ros", "inspect", str(bag), "--json"],
            capture_output=True,
            text=True,
            timeout=DEADLINE,
        )
        assert done.returncode == 0, done.stderr
        found = json.loads(done.stdout.splitlines()[-1])
        assert isinstance(found, dict)
        return found

    return run
