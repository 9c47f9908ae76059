"""Why a run does not go on."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

from rich.console import Console
from typing_extensions import Self


class Idleness(NamedTuple):
    """What a simulator says that keeps it from publishing states.

    Attributes:
        reason: what is lacking, or that it is paused; empty if the run goes on.
        rejection: the last message that it could not use, and why; empty if there is none.
    """

    reason: str = ""
    rejection: str = ""

    @classmethod
    def of(cls, figures: Mapping[str, str]) -> Self:
        """What the figures of a report say."""
        return cls(figures.get("idle", ""), figures.get("last_rejection", ""))

    def tell(self, before: Idleness, console: Console) -> None:
        """Print what is new against the report before."""
        if self.reason != before.reason:
            words = f"No new states: {self.reason}" if self.reason else "There are states again."
            console.print(words, soft_wrap=True)
        if self.reason and _without_numbers(self.rejection) != _without_numbers(before.rejection):
            console.print(self.rejection, soft_wrap=True)


def _without_numbers(text: str) -> str:
    """A message by which it is known again, though its numbers differ each time."""
    return re.sub(r"[0-9.]+", "", text)
