"""Why a run does not advance."""

import re
from collections.abc import Mapping
from typing import NamedTuple

from rich.console import Console
from typing_extensions import Self


class Idleness(NamedTuple):
    """What keeps a simulator from publishing states, as it reports."""

    reason: str = ""  # what is missing, or that the run is paused; empty if the run advances
    rejection: str = ""  # the last rejected message, and why; empty if there is none

    @classmethod
    def of(cls, figures: Mapping[str, str]) -> Self:
        """Read the figures of a report."""
        return cls(figures.get("idle", ""), figures.get("last_rejection", ""))

    def tell(self, before: Self, console: Console) -> None:
        """Print what has changed since the previous report."""
        if self.reason != before.reason:
            words = f"No new states: {self.reason}" if self.reason else "New states arrive again."
            console.print(words, soft_wrap=True)
        if self.reason and _without_numbers(self.rejection) != _without_numbers(before.rejection):
            console.print(self.rejection, soft_wrap=True)


def _without_numbers(text: str) -> str:
    return re.sub(r"[0-9.]+", "", text)
