"""Runs that something is done to."""

from __future__ import annotations

import os
import re
import signal
import time
from pathlib import Path
from typing import Any

from passing import write_scenario
from run_command import DEADLINE, Command

NODES = ("simulator", "inference", "robot_planner", "human_1_agent")


class FaultyRun(Command):
    """`gameinfer run` of two players, whose nodes can be killed, stopped and looked at."""

    def __init__(self, folder: Path, *arguments: object, **options: Any) -> None:
        scenario = write_scenario(folder.parent)
        self.out = folder / "out"
        super().__init__(
            folder, *("--scenario", scenario, "--out", self.out, *arguments), **options
        )

    def pid(self, node: str) -> int:
        """Process id of a node; 0 if it is not there just now."""
        wanted = f"__node:={node} "
        return next((pid for pid, line in self.nodes().items() if wanted in line), 0)

    def kill(self, node: str) -> None:
        """Kill a node, wait until that has been noticed, and until there is another."""
        told, victim = self.messages.count(f"The node {node} ended"), self.pid(node)
        os.kill(victim, signal.SIGKILL)
        self.until(lambda: self.messages.count(f"The node {node} ended") > told)
        self.until(lambda: self.pid(node) not in (0, victim))

    @property
    def step(self) -> int:
        """The newest step of the newest run in the output."""
        found = re.findall(
            r"^step (\d+)/", self.messages.rpartition("run restarts")[2], re.MULTILINE
        )
        return int(found[-1]) if found else -1

    def until_step(self, step: int) -> None:
        self.until(lambda: self.step >= step)

    def until_goes_on(self) -> None:
        """Wait for 20 more steps in the output, whether or not a player moves."""
        self.until_step(self.step + 20)

    def log(self, node: str) -> str:
        return (self.out / "logs" / f"{node}.log").read_text(errors="replace")

    def shared_memory(self) -> set[str]:
        """Files of Fast DDS in shared memory that the orchestrator and its nodes have mapped."""
        maps = [Path(f"/proc/{pid}/maps").read_text() for pid in (self.process.pid, *self.nodes())]
        return set(re.findall(r"/dev/shm/\S*fast\S*", "".join(maps)))

    def until_gone(self) -> None:
        deadline = time.monotonic() + DEADLINE
        while self.leftovers():
            assert time.monotonic() < deadline, self.leftovers()
            time.sleep(0.02)

    def ends_by(self, signal_number: signal.Signals) -> int:
        self.process.send_signal(signal_number)
        return self.exit_code()
