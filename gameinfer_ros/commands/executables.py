"""The executables besides `gameinfer`: they import what they run when it is to be run."""

from __future__ import annotations

import sys

from gameinfer_ros.commands import gameinfer
from gameinfer_ros.system.load import load


def orchestrator() -> int:
    """`gameinfer run` by the name that `ros2 run` knows it by."""
    return gameinfer.main(["run", *sys.argv[1:]])


def human_agent() -> int:
    """A human of the simulation."""
    return _node("human_agent", "Plays one human's part of an equilibrium.")


def inference() -> int:
    """The robot's belief."""
    return _node("inference", "Keeps the belief over equilibria.")


def robot_planner() -> int:
    """The robot."""
    return _node("robot_planner", "Controls the robot.")


def simulator() -> int:
    """The world."""
    return _node("simulator", "Moves all players.")


def viewer() -> int:
    """The page that shows a run."""
    return _node("viewer", "Shows a run in a web browser.")


def _node(name: str, purpose: str) -> int:
    """Run a node by itself; returns its exit code."""
    return int(load("gameinfer_ros.commands.node_command").main(name, purpose, sys.argv[1:]))
