"""Conversion of docstrings for Sphinx: they are plain text with tables in Markdown."""

from __future__ import annotations

from itertools import groupby
from typing import Any

from pydantic import BaseModel
from sphinx.application import Sphinx


def in_sphinx_markup(lines: list[str]) -> list[str]:
    """Convert the tables in the lines of a docstring to list-tables."""
    found: list[str] = []
    for in_table, group in groupby(lines, key=lambda line: line.startswith("|")):
        if not in_table:
            found += group
            continue
        header, _, *rows = (line.strip("| ").split("|") for line in group)
        found += [".. list-table::", "   :header-rows: 1", ""]
        for row in (header, *rows):
            found += [f"   {' ' if j else '*'} - {cell.strip()}" for j, cell in enumerate(row)]
        found.append("")
    return found


#: Replaces a colon while napoleon parses the comment on a variable or a property, where it would
#: take the text before a colon for a type.
NO_COLON = "\N{MODIFIER LETTER COLON}"


def _before_napoleon(
    app: Sphinx, what: str, name: str, member: Any, options: Any, lines: list[str]
) -> None:
    if what in ("attribute", "data", "property") and lines:
        lines[0] = lines[0].replace(":", NO_COLON)
    lines[:] = in_sphinx_markup(lines)


def _after_napoleon(
    app: Sphinx, what: str, name: str, member: Any, options: Any, lines: list[str]
) -> None:
    lines[:] = [line.replace(NO_COLON, ":") for line in lines]


def _skip(app: Sphinx, what: str, name: str, member: Any, skip: bool, options: Any) -> bool | None:
    return True if name == "model_config" else None


def _signature(
    app: Sphinx, what: str, name: str, member: Any, options: Any, arguments: str, result: str
) -> tuple[str, str] | None:
    if what == "class" and issubclass(member, BaseModel):
        return f"({', '.join(member.model_fields)})", result
    return None


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the conversion before and after napoleon."""
    app.connect("autodoc-process-docstring", _before_napoleon, priority=400)
    app.connect("autodoc-process-docstring", _after_napoleon, priority=600)
    app.connect("autodoc-skip-member", _skip)
    app.connect("autodoc-process-signature", _signature)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
