"""The messages that pages show are those that the programs print."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import rclpy
from pages import PAGES, ROOT, blocks

from gameinfer_ros.solver import Status

PAGE = ROOT / "docs/troubleshooting.md"
TEXT = PAGE.read_text(encoding="utf-8")
#: Number of letters, beside what differs from case to case, by which a message is recognised:
#: anywhere, or in its first word.
ENOUGH, ENOUGH_AT_START = 12, 4


def sources() -> Iterator[Path]:
    yield from (ROOT / "gameinfer_ros").rglob("*.py")
    yield from (ROOT / "msg_adapters").rglob("*.py")
    yield Path(rclpy.__file__).parent / "event_handler.py"
    yield from (Path(np.__file__).parent / "core").glob("_multiarray_umath.py")


def patterns_of_python(source: str) -> Iterator[str]:
    """A pattern for each string; whatever is filled in may be anything."""
    for node in ast.walk(ast.parse(source)):
        parts = node.values if isinstance(node, ast.JoinedStr) else [node]
        texts = [part.value if isinstance(part, ast.Constant) else "{}" for part in parts]
        if all(isinstance(text, str) for text in texts):
            yield from (pattern(line.strip()) for line in "".join(texts).splitlines())


def patterns_of_shell(source: str) -> Iterator[str]:
    """Likewise of what `say` says, where it goes on in another line too."""
    joined = re.sub(r'" \\\n\s*"', " ", source)
    for said in re.findall(r'(?:say|fail) "((?:[^"$]|\$\S+)*)"', joined):
        yield pattern(re.sub(r"\$\{?\w+\}?", "{}", f"dev: {said}"))


def pattern(text: str) -> str:
    letters, first = re.sub(r"\{[^}]*\}|\W", "", text), re.match(r"[a-z]*", text)
    if len(letters) < ENOUGH and (first is None or len(first[0]) < ENOUGH_AT_START):
        return "(?!)"  # matches nothing
    return ".*".join(re.escape(part) for part in re.split(r"\{[^}]*\}", text))


SHOWN = {
    line: None
    for page in PAGES
    for block in blocks(page)
    if block.language == "text"
    for line in block.text.splitlines()
}
IN_TABLES = [
    message
    for row in re.findall(r"^\| .* \|$", TEXT, re.MULTILINE)
    for message in re.findall(r"^\| [\w`]+ \| `([^`]*)` \|", row)
]


@pytest.fixture(scope="module")
def patterns() -> set[str]:
    return {
        *(p for path in sources() for p in patterns_of_python(path.read_text(encoding="utf-8"))),
        *patterns_of_shell((ROOT / "dev").read_text(encoding="utf-8")),
    }


@pytest.mark.parametrize("line", [*SHOWN, *IN_TABLES])
def test_a_message_that_is_shown_is_one_of_the_sources(line: str, patterns: set[str]) -> None:
    if "NumPy 1.x" in line and np.__version__ < "2":
        pytest.skip("a message of NumPy 2")
    assert any(re.fullmatch(p, line) for p in patterns), line


def test_every_status_of_the_solver_is_explained() -> None:
    for status in Status:
        assert f"| `{status.name}` | `" in TEXT


def test_every_message_of_a_report_is_explained() -> None:
    """What nodes say of themselves in `/diagnostics`: the strings next to their levels."""
    found = 0
    for path in (ROOT / "gameinfer_ros/nodes").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            messages: list[ast.expr] = []
            if isinstance(node, ast.Tuple) and "diagnostics." in ast.unparse(node.elts[-1:]):
                messages = [node.elts[0]]
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "self.report":
                first = node.args[0]
                messages = [first.body, first.orelse] if isinstance(first, ast.IfExp) else [first]
            for message in messages:
                if isinstance(message, ast.Constant):
                    assert f"| `{message.value}` |" in TEXT, message.value
                    found += 1
    assert found > 7
