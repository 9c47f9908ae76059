"""The pages of the documentation, and the blocks of code in them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
PAGES = [*sorted((ROOT / "docs").rglob("*.md")), ROOT / "README.md"]


class Block(NamedTuple):
    """A block of code; `file` is what its caption calls it, empty if it has none."""

    language: str
    file: str
    text: str


def name_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


def blocks(page: Path) -> list[Block]:
    """Blocks of a page in order, whether fenced plainly or with a caption."""
    found = re.findall(
        r"^```(?:\{code-block\} )?(\w+)\n(?::caption: (\S+)\n\n)?(.*?)^```$",
        page.read_text(encoding="utf-8"),
        re.DOTALL | re.MULTILINE,
    )
    return [Block(*parts) for parts in found]


def shell_commands(*pages: Path) -> list[str]:
    """Commands of all shell blocks of pages, of all by default."""
    found = (block for page in pages or PAGES for block in blocks(page) if block.language == "sh")
    return [command for block in found for command in commands(block.text)]


def commands(text: str) -> list[str]:
    """Commands of a shell block, without comments, and with continued lines joined."""
    lines = text.replace("\\\n", " ").splitlines()
    stripped = (re.sub(r"(^|\s)#.*", "", line).strip() for line in lines)
    return [line for line in stripped if line]
