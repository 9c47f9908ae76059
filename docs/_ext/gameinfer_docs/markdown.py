"""Markdown tables and code."""

from __future__ import annotations

from collections.abc import Sequence


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Format a table, without the columns that are empty in all rows."""
    used = [j for j in range(len(head)) if any(row[j] for row in rows)]
    lines = [[head[j] for j in used], ["---"] * len(used)]
    lines += [[row[j].replace("|", "\\|").replace("\n", " ") for j in used] for row in rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def code(text: object) -> str:
    """Format a text as code; an empty text stays empty."""
    return f"`{text}`" if str(text) else ""
