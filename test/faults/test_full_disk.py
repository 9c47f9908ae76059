"""No space is left while a run is recorded, while a node writes its log, and for the results."""

from __future__ import annotations

import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from faulty_run import NODES, FaultyRun
from full_disk import fill_up, log_writer
from ros_domain import free_domain

Start = Callable[..., FaultyRun]


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


def test_so_does_one_that_cannot_be_closed_when_the_run_is_interrupted(
    start: Start, tmp_path: Path
) -> None:
    run = start("--record", tmp_path / "bag")
    run.until_step(40)
    (file,) = (tmp_path / "bag").glob("*.mcap")
    run.process.send_signal(signal.SIGINT)
    fill_up(run.process.pid, file.stat().st_size)
    assert run.exit_code() == 130, run.stdout
    assert run.stderr.startswith("--record: the bag cannot be written: [Errno 27] File too large")
    assert run.stderr.count("\n") == 1
    assert run.leftovers() == {}


def test_results_that_cannot_be_written_are_told_of(start: Start) -> None:
    run = start(steps=20)
    run.until_step(10)
    fill_up(run.process.pid, 3000)  # of the log, which is a file here, too
    assert run.exit_code() == 1, run.stdout
    assert f"--out: {run.out} cannot be written: [Errno 27] File too large" in run.stderr
    assert "Traceback" not in run.stderr
    assert run.leftovers() == {}


def test_nodes_go_on_when_their_logs_cannot_be_written(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    domain = free_domain()
    run = start(domain=domain)
    run.until_step(10)
    with log_writer(domain) as let_each_log:
        for node in NODES:
            fill_up(run.pid(node), 0)
        logs = {node: run.log(node) for node in NODES}
        let_each_log()
    assert all("set to 7" in log or "set to 0.7" in log for log in logs.values()), logs
    run.until_goes_on()
    assert {node: run.log(node) for node in NODES} == logs, "some could be written"
    assert run.ends_by(signal.SIGINT) == 130, run.stdout + run.stderr
    assert run.stderr == ""
