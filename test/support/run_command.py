"""The command `gameinfer run`, in a process of its own."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import forking
import pytest
from ros_domain import free_domain
from terminal import Terminal

from gameinfer_ros.nodes.base.middleware import FAST_DDS

#: How long anything may take, in s, on however busy a machine.
DEADLINE = 120.0


class Command:
    """`gameinfer run` with some arguments; it and its nodes are forked (see `forking`).

    Args:
        folder: its working directory, where its output goes.
        arguments: behind `run`.
        from_scratch: do not fork, but start it as a shell would.
        ignore_sigint: ignore SIGINT, as what runs in the background of a shell; forked.
        first: code that it runs before anything else; forked.
        domain: its ROS domain; by default, one of its own.
        terminal: its terminal.
        settings: further variables of its environment.
    """

    def __init__(
        self,
        folder: Path,
        *arguments: object,
        from_scratch: bool = False,
        ignore_sigint: bool = False,
        first: str = "",
        domain: int | None = None,
        terminal: Terminal | None = None,
        **settings: str,
    ) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._stdout, self._stderr = folder / "stdout", folder / "stderr"
        start: Any = forking.start
        options: dict[str, Any] = {
            "controlled": terminal is not None and terminal.controls,
            "ignore_sigint": ignore_sigint,
            "first": first,
        }
        if from_scratch:
            start, options = subprocess.Popen, {"preexec_fn": terminal.take if terminal else None}
        # Nodes in this process may have set a profile, which the run would take for the user's.
        usual = {name: value for name, value in os.environ.items() if name != FAST_DDS}
        with self._stdout.open("wb") as stdout, self._stderr.open("wb") as stderr:
            self.process = start(
                [sys.executable, "-m", "gameinfer_ros", "run", *map(str, arguments)],
                cwd=folder,
                env={
                    **usual,
                    "PYTHONUNBUFFERED": "1",
                    "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
                    "ROS_DOMAIN_ID": str(free_domain() if domain is None else domain),
                    **settings,
                },
                stdin=terminal.its_end if terminal else subprocess.DEVNULL,
                stdout=terminal.its_end if terminal else stdout,
                stderr=terminal.its_end if terminal else stderr,
                start_new_session=True,
                **options,
            )
        if terminal:
            os.close(terminal.its_end)
        self._seen: set[int] = set()

    @property
    def stdout(self) -> str:
        return self._stdout.read_text()

    @property
    def stderr(self) -> str:
        return self._stderr.read_text()

    @property
    def summary(self) -> dict[str, Any]:
        """The JSON object that was printed, with nothing else."""
        return json.loads(self.stdout)

    @property
    def messages(self) -> str:
        """Everything that was printed for people."""
        return self.stdout + self.stderr

    def nodes(self) -> dict[int, str]:
        """Process ids of the nodes that run, with their command lines."""
        started = children(self.process.pid)
        found = {pid: line for pid, line in started.items() if "gameinfer_ros.nodes" in line}
        self._seen |= set(found)
        return found

    def until(self, condition: Callable[[], object]) -> None:
        deadline = time.monotonic() + DEADLINE
        while not condition():
            assert self.process.poll() is None, self.stdout + self.stderr
            assert time.monotonic() < deadline, self.stdout + self.stderr
            time.sleep(0.02)

    def until_it_moves(self) -> None:
        """Wait until its players move; its nodes are known then."""
        self.until(lambda: "First controls" in self.messages and self.nodes())

    def exit_code(self) -> int:
        return self.process.wait(DEADLINE)

    def leftovers(self) -> dict[int, str]:
        """Nodes that still run though the orchestrator has ended."""
        found = {pid: _command_line(pid) for pid in self._seen}
        return {pid: line for pid, line in found.items() if "gameinfer_ros.nodes" in line}

    def end(self) -> None:
        if self.process.poll() is None:
            self.nodes()
            self.process.kill()
            self.process.wait(DEADLINE)
        for pid in self.leftovers():
            os.kill(pid, signal.SIGKILL)


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., Command]]:
    """Starts `gameinfer run` with some arguments, which ends with the test."""
    commands: list[Command] = []

    def make(*arguments: object, kind: type[Command] = Command, **options: Any) -> Command:
        commands.append(kind(tmp_path / f"command_{len(commands)}", *arguments, **options))
        return commands[-1]

    yield make
    for command in commands:
        command.end()


def children(parent: int) -> dict[int, str]:
    """Process ids of what a process has started, with their command lines."""
    found = {}
    for folder in Path("/proc").iterdir():
        if not folder.name.isdigit():
            continue
        try:
            # The name, in parentheses, may hold blanks; state and parent follow it.
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
        except OSError:  # it has ended
            continue
        if int(fields[1]) == parent and fields[0] != "Z":
            found[int(folder.name)] = _command_line(int(folder.name))
    return found


def _command_line(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()
    except OSError:
        return ""
