"""Tables for the terminal and for the page of a report."""

from collections.abc import Sequence
from typing import NamedTuple

from rich.table import Table as RichTable


class Table(NamedTuple):
    """A table of text.

    Attributes:
        title: title above the table.
        header: names of the columns.
        rows: cells of each row; the first one names the row.
    """

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]

    def in_terminal(self) -> RichTable:
        """Convert the table for printing with rich."""
        table = RichTable(title=self.title, title_justify="left")
        for i, name in enumerate(self.header):
            table.add_column(name, justify="right" if i else "left")
        for row in self.rows:
            table.add_row(*row)
        return table

    def in_markdown(self) -> str:
        """Format header and rows as a table of a Markdown page."""
        lines = (self.header, ["---"] * len(self.header), *self.rows)
        return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def milliseconds(time: float | None) -> str:
    """Format a time in ms; None means that it is unknown."""
    return "unknown" if time is None else f"{time:.1f} ms"


def metres(length: float | None) -> str:
    """Format a length in m; None means that there is none."""
    return "none" if length is None else f"{length:.2f} m"
