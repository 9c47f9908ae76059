"""A table to be shown in a terminal or on a page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from rich.table import Table as RichTable


class Table(NamedTuple):
    """A title, a header and rows of text; the first column says what a row is about."""

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]

    def in_terminal(self) -> RichTable:
        """The table for rich to print."""
        table = RichTable(title=self.title, title_justify="left")
        for i, name in enumerate(self.header):
            table.add_column(name, justify="right" if i else "left")
        for row in self.rows:
            table.add_row(*row)
        return table


def milliseconds(time: float | None) -> str:
    """A time in words."""
    return "unknown" if time is None else f"{time:.1f} ms"


def metres(length: float | None) -> str:
    """A length in words."""
    return "none" if length is None else f"{length:.2f} m"
