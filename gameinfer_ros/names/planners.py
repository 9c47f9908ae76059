"""The available planners, for code that lists them without importing the solver."""

import ast
from functools import cache
from pathlib import Path

_FOLDER = Path(__file__).parents[1] / "planning" / "planners"


@cache
def planners() -> dict[str, str]:
    """Return the purpose of each planner by its name.

    The name is that of the planner's file, and the purpose the first line of its docstring.
    """
    files = sorted(_FOLDER.glob("[!_]*.py"))
    return {file.stem: _first_line(file) for file in files}


def _first_line(file: Path) -> str:
    text = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
    return text.partition("\n")[0].rstrip(".")
