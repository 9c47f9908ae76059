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

#: Starts a child with a lifeline, tells its process id, and waits to be killed.
PARENT = """
import os, subprocess, sys, time
from gameinfer_ros.system.lifeline import Lifeline
line = Lifeline()
child = subprocess.Popen(
    [sys.executable, "-c", sys.argv[1]],
    env={**os.environ, **line.environment},
    pass_fds=(line.inherited,),
    start_new_session=True,
)
line.tied()
print(child.pid, flush=True)
time.sleep(600)
"""
POLITE = """
import time
from gameinfer_ros.system import lifeline
lifeline.watch()
try:
    print("watches", flush=True)
    time.sleep(600)
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""
STUBBORN = """
import signal, time
from gameinfer_ros.system import lifeline
lifeline.PATIENCE = 0.5
signal.signal(signal.SIGINT, signal.SIG_IGN)
lifeline.watch()
print("watches", flush=True)
while True:
    time.sleep(600)
"""


class Family:
    def __init__(self, child: str, log: Path) -> None:
        self._log = log
        with log.open("wb") as output:
            self.parent = subprocess.Popen(
                [sys.executable, "-c", PARENT, child],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
            )
        self.until(lambda: "watches" in self.words)
        self.child = next(int(word) for word in self.words.split() if word.isdigit())

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

    def make(child: str) -> Family:
        families.append(Family(child, tmp_path / f"{len(families)}.log"))
        return families[-1]

    yield make
    for made in families:
        made.end()


@pytest.mark.parametrize("stopped", [False, True])
def test_a_child_ends_well_when_its_parent_is_killed(
    stopped: bool, family: Callable[[str], Family]
) -> None:
    members = family(POLITE)
    if stopped:
        os.kill(members.child, signal.SIGSTOP)
        members.until(lambda: members.child_state == "T")
    members.parent.kill()
    members.until(lambda: not members.child_state)
    assert "interrupted" in members.words


def test_a_child_that_does_not_heed_the_signal_ends_by_force(
    family: Callable[[str], Family],
) -> None:
    members = family(STUBBORN)
    members.parent.kill()
    members.until(lambda: not members.child_state)


def test_a_process_without_a_lifeline_continues() -> None:
    code = "from gameinfer_ros.system import lifeline; lifeline.watch(); print('goes on')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.stdout == "goes on\n", done.stderr
