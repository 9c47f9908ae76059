"""Insertion of generated references into pages, at lines such as `<!-- generated: nodes -->`."""

from __future__ import annotations

import re
from collections.abc import Callable

from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment

from gameinfer_docs import command_reference, node_reference, scenario_reference

PARTS: dict[str, Callable[[], str]] = {
    "commands": command_reference.commands,
    "nodes": node_reference.nodes,
    "qos": node_reference.quality_of_service,
    "scenario": scenario_reference.scenario,
}
MARK = re.compile(r"^<!-- generated: (\w+) -->$", re.MULTILINE)


def expanded(text: str) -> str:
    """Replace all marks in a page by their generated parts.

    Raises:
        KeyError: a mark names an unknown part.
    """
    return MARK.sub(lambda mark: PARTS[mark[1]](), text)


def _expand(app: Sphinx, docname: str, source: list[str]) -> None:
    source[0] = expanded(source[0])


def _outdated(app: Sphinx, env: BuildEnvironment, *_: set[str]) -> list[str]:
    """Rebuild pages with marks in every build, because the code may have changed."""
    return [name for name in env.found_docs if MARK.search(env.doc2path(name).read_text("utf-8"))]


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the insertion before pages are parsed."""
    app.connect("source-read", _expand)
    app.connect("env-get-outdated", _outdated)
    return {"parallel_read_safe": False, "parallel_write_safe": True}
