"""A node in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import forking

#: How long anything may take, in s, on however busy a machine.
DEADLINE = 240.0


class NodeOfItsOwn:
    """A node, forked or started from scratch.

    Args:
        module: in `gameinfer_ros.nodes`.
        log: what gets its output.
        domain: its ROS domain.
        arguments: of its command line.
        environment: its variables, except the domain; by default, ours.
        forked: whether it is forked (see `forking`).
    """

    def __init__(
        self,
        module: str,
        log: Path,
        domain: int,
        *arguments: str,
        environment: Mapping[str, str] = os.environ,
        forked: bool = True,
    ) -> None:
        self._log = log
        begin: Any = forking.start if forked else subprocess.Popen
        with log.open("wb") as output:
            self.process = begin(
                [sys.executable, "-m", f"gameinfer_ros.nodes.{module}", *arguments],
                env={**environment, "ROS_DOMAIN_ID": str(domain)},
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    @property
    def words(self) -> str:
        return self._log.read_text(errors="replace")

    def until_ready(self) -> None:
        self.until_it_says("ready")

    def until_it_says(self, words: str) -> None:
        deadline = time.monotonic() + DEADLINE
        while words not in self.words:
            assert self.process.poll() is None, self.words
            assert time.monotonic() < deadline, self.words
            time.sleep(0.02)

    def exit_code(self) -> int:
        return self.process.wait(DEADLINE)

    def end(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait(DEADLINE)
