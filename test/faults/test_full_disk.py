"""No space is left while a run is recorded, while a node writes its log, and for the results.

A limit of the size of a process's files stands for the full disk: it can be set at any time, by
anyone, and only ends the growth of files, as of a disk that is full.
"""

from __future__ import annotations

import resource
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from faulty_run import FaultyRun

pytestmark = pytest.mark.alone

Start = Callable[..., FaultyRun]


def fill_up(pid: int, size: int) -> None:
    """Let no file that a process writes become longer than so many bytes."""
    resource.prlimit(pid, resource.RLIMIT_FSIZE, (size, size))


def test_a_bag_that_cannot_be_written_ends_the_run_and_can_be_read_up_to_there(
    start: Start, inspect: Callable[[Path], dict[str, Any]], tmp_path: Path
) -> None:
    bag = tmp_path / "bag"
    run = start("--record", bag)
    run.until_step(40)
    (file,) = bag.glob("*.mcap")
    fill_up(run.process.pid, file.stat().st_size + 1000)  # in the midst of a record
    assert run.exit_code() == 1, run.stdout
    assert run.stderr.startswith("--record: the bag cannot be written: [Errno 27] File too large")
    assert "Traceback" not in run.stderr
    assert run.leftovers() == {}
    found = inspect(bag)
    assert not found["finished"]
    assert found["steps"] >= 10


def test_results_that_cannot_be_written_are_told_of(start: Start) -> None:
    run = start(steps=40)
    run.until_step(20)
    fill_up(run.process.pid, 3000)  # of the log, which is a file here, too
    assert run.exit_code() == 1, run.stdout
    assert f"--out: {run.out} cannot be written: [Errno 27] File too large" in run.stderr
    assert "Traceback" not in run.stderr
    assert run.leftovers() == {}


def test_nodes_go_on_when_their_logs_cannot_be_written(start: Start) -> None:
    run = start("--json", steps=60)
    run.until_step(20)
    for node in ("simulator", "inference", "robot_planner", "human_1_agent"):
        fill_up(run.pid(node), 0)
    assert run.exit_code() == 0, run.stdout + run.stderr
    assert run.summary["steps"] == 60
    assert "done" not in run.log("simulator"), "it could be written"
