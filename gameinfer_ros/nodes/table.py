"""The table of nodes: executables, packaging, the reference of nodes and tests read it.

setup.py runs this file before anything is installed, so it imports only the standard library.
"""

from importlib import import_module
from typing import Any

#: Name and purpose of each node that has an executable. Its module, `gameinfer_ros.nodes.NAME`,
#: contains its class, such as `RobotPlanner` for `robot_planner`.
NODES = {
    "simulator": "Moves all players.",
    "inference": "Keeps the belief over equilibria.",
    "robot_planner": "Controls the robot.",
    "human_agent": "Plays one human's part of an equilibrium.",
    "viewer": "Shows a run in a web browser.",
}


def class_of(name: str) -> Any:
    """The class of a node of the table, a subclass of `rclpy.node.Node`; imports its module."""
    return getattr(import_module(f"gameinfer_ros.nodes.{name}"), _class_name(name))


def kind_of(node: object) -> str | None:
    """The name in the table of a node; None for nodes of other classes."""
    # Its module may be called `__main__`.
    return next((name for name in NODES if _class_name(name) == type(node).__name__), None)


def _class_name(name: str) -> str:
    return name.title().replace("_", "")
