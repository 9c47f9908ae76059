"""How far a study is, in the terminal."""

from __future__ import annotations

import time
from types import TracebackType

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
    """A bar with the time that remains; where the output is no terminal, a line now and then.

    Args:
        console: where to print.
        name: what is going on.
        total: number of runs.
        done: so many of them were made earlier.
    """

    #: Seconds between two lines.
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
            self._print(f"{self._earlier} of {self._total} runs were made earlier")
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._bar.stop()
        made, seconds = self._done - self._earlier, time.monotonic() - self._start
        if made:
            there = f"{self._done} of {self._total} are there"
            self._print(f"{made} runs made in {seconds:.0f} s, {there}")

    def advance(self) -> None:
        """One more run has ended."""
        self._done += 1
        self._bar.advance(self._task)
        now = time.monotonic()
        if not self._console.is_terminal and now - self._printed > self.INTERVAL:
            self._printed = now
            pace = (now - self._start) / (self._done - self._earlier)
            left = pace * (self._total - self._done)
            self._print(f"{self._done} of {self._total} runs, about {left:.0f} s remain")

    def _print(self, words: str) -> None:
        self._console.print(f"{self._name}: {words}", soft_wrap=True)
