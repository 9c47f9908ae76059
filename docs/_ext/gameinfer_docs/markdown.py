"""Pieces of Markdown."""

from __future__ import annotations

from collections.abc import Sequence


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table; columns in which no row has anything are left out."""
    used = [j for j in range(len(head)) if any(row[j] for row in rows)]
    lines = [[head[j] for j in used], ["---"] * len(used)]
    lines += [[row[j].replace("|", "\\|").replace("\n", " ") for j in used] for row in rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def code(text: object) -> str:
    """Some text as code; nothing if there is none."""
    return f"`{text}`" if str(text) else ""
