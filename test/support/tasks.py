"""Functions for worker processes to call."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path
from typing import NamedTuple


class Task(NamedTuple):
    """A number, and the folder in which calls leave traces."""

    number: int
    folder: str


def square(task: Task) -> int:
    """The square of a number, and a trace of the call."""
    with (Path(task.folder) / f"called-{task.number}").open("a") as trace:
        trace.write("called\n")
    time.sleep(0.05)
    return task.number**2


def square_unless_it_is_three(task: Task) -> int:
    """The first call with the number 3 kills its process without a word."""
    killed = Path(task.folder) / "killed"
    if task.number == 3 and not killed.exists():
        killed.touch()
        time.sleep(0.3)  # others shall have ended meanwhile
        os.kill(os.getpid(), signal.SIGKILL)
    return square(task)


def process_id(task: Task) -> int:
    return os.getpid()


def die(task: Task) -> int:
    os.kill(os.getpid(), signal.SIGKILL)
    return 0


def fail(task: Task) -> int:
    raise ZeroDivisionError(f"task {task.number}")
