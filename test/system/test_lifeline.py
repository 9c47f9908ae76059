"""A process ends when the one that started it is gone."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

DEADLINE = 60.0

#: Starts a child, tells its process id, and waits to be killed, or ends before the child watches.
PARENT = """
import os, subprocess, sys, time
from gameinfer_ros.system import lifeline
child = subprocess.Popen(
    [sys.executable, "-c", sys.argv[1]],
    env={**os.environ, **lifeline.environment()},
    start_new_session=True,
)
print(child.pid, flush=True)
if sys.argv[2] == "stays":
    time.sleep(600)
"""
CHILD = """
import os, signal, sys, time
from gameinfer_ros.system import lifeline
signal.signal(signal.SIGINT, signal.SIG_IGN)
sys.stdin.readline()
lifeline.watch()
assert lifeline.VARIABLE not in os.environ
print("watches", flush=True)
while True:
    time.sleep(600)
"""


class Family:
    """A parent and its child, which watches when it is told to."""

    def __init__(self, parent: str, log: Path) -> None:
        self._log = log
        with log.open("wb") as output:
            self.parent = subprocess.Popen(
                [sys.executable, "-c", PARENT, CHILD, parent],
                stdin=subprocess.PIPE,
                stdout=output,
                stderr=subprocess.STDOUT,
            )
        self.until(lambda: "\n" in self.words)
        self.child = int(self.words.split()[0])

    @property
    def words(self) -> str:
        return self._log.read_text()

    @property
    def child_state(self) -> str:
        """As in /proc; empty if it has ended."""
        try:
            text = Path(f"/proc/{self.child}/stat").read_text()
        except OSError:
            return ""
        return text.rpartition(")")[2].split()[0].replace("Z", "")

    def let_child_watch(self) -> None:
        assert self.parent.stdin is not None
        self.parent.stdin.close()

    def until(self, condition: Callable[[], object]) -> None:
        deadline = time.monotonic() + DEADLINE
        while not condition():
            assert time.monotonic() < deadline, self.words
            time.sleep(0.02)

    def end(self) -> None:
        self.parent.kill()
        self.parent.wait(DEADLINE)
        if self.child_state:
            os.kill(self.child, signal.SIGKILL)


@pytest.fixture
def family(tmp_path: Path) -> Iterator[Callable[[str], Family]]:
    families: list[Family] = []

    def make(parent: str) -> Family:
        families.append(Family(parent, tmp_path / f"{len(families)}.log"))
        return families[-1]

    yield make
    for made in families:
        made.end()


@pytest.mark.parametrize("stopped", [False, True])
def test_a_child_ends_when_its_parent_is_killed(
    stopped: bool, family: Callable[[str], Family]
) -> None:
    members = family("stays")
    members.let_child_watch()
    members.until(lambda: "watches" in members.words)
    if stopped:
        os.kill(members.child, signal.SIGSTOP)
        members.until(lambda: members.child_state == "T")
    assert members.child_state
    members.parent.kill()
    members.until(lambda: not members.child_state)


def test_so_does_one_that_begins_to_watch_too_late(family: Callable[[str], Family]) -> None:
    members = family("leaves")
    members.parent.wait(DEADLINE)
    assert members.child_state
    members.let_child_watch()
    members.until(lambda: not members.child_state)
    assert "watches" not in members.words


def test_a_process_without_such_a_parent_goes_on() -> None:
    code = "from gameinfer_ros.system import lifeline; lifeline.watch(); print('goes on')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.stdout == "goes on\n", done.stderr
