"""Ctrl-C at any time of a run."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from faulty_run import FaultyRun
from terminal import Terminal

from gameinfer_ros.bags.run_bag import RunBag

Start = Callable[..., FaultyRun]

#: By this, a run is told to end once more at the very moment when it begins to clean up.
TOLD_TWICE = """
import os, signal, time
from gameinfer_ros.orchestration import orchestrator

ignore_interrupts = orchestrator.ignore_interrupts

def interrupted():
    orchestrator.ignore_interrupts = ignore_interrupts
    os.kill(os.getpid(), signal.SIGHUP)
    time.sleep(60)

orchestrator.ignore_interrupts = interrupted
"""


@pytest.mark.parametrize("word", ["Loading compiled code", "nodes discovered"])
def test_it_ends_a_run_that_has_not_begun(word: str, start: Start) -> None:
    run = start(from_scratch="Loading" in word)
    run.until(lambda: word in run.stdout)
    run.nodes()
    assert run.ends_by(signal.SIGINT) == 130, run.stdout + run.stderr
    run.until_gone()
    assert "Interrupted: stopping all nodes." in run.stdout
    assert run.stderr == ""


@pytest.mark.parametrize("delay", [0.1, 0.5])
def test_it_ends_a_run_that_has_not_said_a_word(delay: float, start: Start) -> None:
    run = start(from_scratch=True)
    time.sleep(delay)
    # While Python itself starts, it ends in a way of its own.
    assert run.ends_by(signal.SIGINT) != 0, run.stdout + run.stderr
    run.until_gone()


@pytest.mark.parametrize("word", ["Loading compiled code", "nodes discovered", "First controls"])
def test_so_does_a_terminal_that_is_closed_and_the_bag_is_finished(
    word: str, start: Start, tmp_path: Path
) -> None:
    terminal, bag = Terminal(controls=True), tmp_path / "bag"
    run = start("--record", bag, terminal=terminal, from_scratch="Loading" in word)
    run.until(lambda: word in terminal.words)
    run.nodes()
    terminal.close()
    assert run.exit_code() == 130
    run.until_gone()
    assert bag.exists() or word == "Loading compiled code"
    assert not bag.exists() or RunBag(bag).finished


def test_a_closed_terminal_is_noticed_without_a_signal_too(start: Start) -> None:
    terminal = Terminal(controls=False)
    run = start(terminal=terminal, steps=20)
    run.until(lambda: "First controls" in terminal.words)
    run.nodes()
    terminal.close()
    assert run.exit_code() == 130
    run.until_gone()


def test_a_run_that_is_told_to_end_twice_cleans_up_all_the_same(
    start: Start, inspect: Callable[[Path], dict[str, Any]], tmp_path: Path
) -> None:
    bag = tmp_path / "bag"
    run = start("--record", bag, first=TOLD_TWICE)
    run.until_step(20)
    assert run.nodes()
    assert run.ends_by(signal.SIGTERM) == 130, run.stdout + run.stderr
    assert run.leftovers() == {}
    assert inspect(bag)["finished"]
    assert run.stderr == ""


def test_results_that_are_being_written_are_whole(start: Start) -> None:
    run = start(steps=15)
    run.until(lambda: "step 10/" in run.stdout)
    sent = 0
    while run.process.poll() is None:
        if (run.out / "run.json").exists():
            run.process.send_signal(signal.SIGINT)
            sent += 1
        time.sleep(0.01)
    assert run.exit_code() == 0, run.stdout + run.stderr
    assert sent > 0
    assert json.loads((run.out / "run.json").read_text())["steps"] == 15
    assert (run.out / "picture.png").read_bytes().endswith(b"IEND\xaeB`\x82")
