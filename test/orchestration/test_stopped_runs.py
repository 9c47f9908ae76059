"""Runs that are interrupted, and runs whose nodes die."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from pathlib import Path

from run_command import Command, children

from gameinfer_ros.bags.run_bag import RunBag


def test_an_interrupted_run_leaves_no_node_behind(endless: Callable[..., Command]) -> None:
    # Side by side, because a start leaves a core idle. A shell starts what runs in the background
    # with SIGINT ignored.
    commands = {
        signal.SIGINT: endless(ignore_sigint=True),
        signal.SIGTERM: endless(),
        signal.SIGHUP: endless(),
    }
    for number, command in commands.items():
        command.until_it_moves()
        # Each has rights of its own under SROS2.
        lines = command.nodes().values()
        assert any("--enclave /gameinfer_ros/simulator" in line for line in lines)
        command.process.send_signal(number)
        assert command.exit_code() == 130, (number, command.stdout, command.stderr)
        assert command.leftovers() == {}, number
        assert "Interrupted" in command.stdout
        assert "Traceback" not in command.stdout + command.stderr


def test_when_a_node_dies_the_run_fails_says_why_and_leaves_a_bag_that_can_be_read(
    endless: Callable[..., Command], tmp_path: Path
) -> None:
    names = ("human_1_agent", "simulator")
    commands = {name: endless("--record", tmp_path / name) for name in names}
    for name, command in commands.items():
        command.until_it_moves()
        (victim,) = (pid for pid, line in command.nodes().items() if f"__node:={name} " in line)
        assert children(command.process.pid).get(victim)  # it is still ours
        os.kill(victim, signal.SIGKILL)
        assert command.exit_code() == 1, command.stdout + command.stderr
        assert command.leftovers() == {}
        for words in (f"node {name} ended", "SIGKILL; its last output:", f"[{name}]: ready"):
            assert words in command.stderr
        bag = RunBag(tmp_path / name)
        assert bag.finished and bag.record().steps >= 1
