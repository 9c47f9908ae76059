"""What the package installs: its executables, and the classes of nodes behind them."""

from __future__ import annotations

import ast
import importlib
from pathlib import Path

from rclpy.node import Node

ROOT = Path(__file__).parents[3]


def executables() -> dict[str, str]:
    """Module of each executable that setup.py names."""
    source = (ROOT / "setup.py").read_text(encoding="utf-8")
    for statement in ast.parse(source).body:
        if isinstance(statement, ast.Assign) and ast.unparse(statement.targets[0]) == (
            "CONSOLE_SCRIPTS"
        ):
            scripts = ast.literal_eval(statement.value)
            return {name: _module_behind(name) for name in scripts}
    raise LookupError("setup.py: CONSOLE_SCRIPTS is missing")


def _module_behind(executable: str) -> str:
    """The module that does what an executable is there for."""
    if (ROOT / "gameinfer_ros" / "nodes" / f"{executable}.py").is_file():
        return f"gameinfer_ros.nodes.{executable}"
    return {
        "gameinfer": "gameinfer_ros.commands.cli",
        "orchestrator": "gameinfer_ros.orchestration.orchestrator",
    }[executable]


def node_classes(module_name: str) -> list[type[Node]]:
    """Classes of the nodes that an executable's module makes: its own, else those it imports."""
    module = importlib.import_module(module_name)
    classes = [
        member
        for member in vars(module).values()
        if isinstance(member, type)
        and issubclass(member, Node)
        and member.__module__.startswith("gameinfer_ros")
    ]
    return [cls for cls in classes if cls.__module__ == module_name] or classes
