"""The progress of a study in the terminal."""

import time

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from typing_extensions import Self


class StudyProgress:
    """A progress bar with the remaining time, or regular lines if the output is not a terminal.

    Of `total` runs, `done` were played by earlier commands.
    """

    #: Time between two lines, in s.
    INTERVAL = 15.0

    def __init__(self, console: Console, name: str, total: int, done: int) -> None:
        self._console, self._name, self._total = console, name, total
        self._earlier = self._done = done
        self._start = self._printed = time.monotonic()
        self._bar = Progress(
            TextColumn("{task.description}"), BarColumn(30), MofNCompleteColumn(),
            TimeElapsedColumn(), TextColumn("remaining"), TimeRemainingColumn(),
            console=console, transient=True, disable=not console.is_terminal,
            speed_estimate_period=600,
        )  # fmt: skip
        self._task = self._bar.add_task(name, total=total, completed=done)

    def __enter__(self) -> Self:
        self._bar.start()
        if self._earlier:
            self._print(f"{self._earlier} of {self._total} runs already exist")
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()
        made, seconds = self._done - self._earlier, time.monotonic() - self._start
        if made:
            self._print(
                f"{made} runs played in {seconds:.0f} s, {self._done} of {self._total} exist now"
            )

    def advance(self) -> None:
        """Count one more run."""
        self._done += 1
        self._bar.advance(self._task)
        now = time.monotonic()
        if not self._console.is_terminal and now - self._printed > self.INTERVAL:
            self._printed = now
            pace = (now - self._start) / (self._done - self._earlier)
            left = pace * (self._total - self._done)
            self._print(f"{self._done} of {self._total} runs, about {left:.0f} s remaining")

    def _print(self, message: str) -> None:
        self._console.print(f"{self._name}: {message}", soft_wrap=True)
