"""The executables besides `gameinfer`; they import what they run only when they run it.

The module has a function for each node of `gameinfer_ros.nodes.table`, with its name.
"""

import sys
from collections.abc import Callable
from functools import partial

from gameinfer_ros.commands import gameinfer
from gameinfer_ros.nodes.table import NODES
from gameinfer_ros.system.load import load


def orchestrator() -> int:
    """Run `gameinfer run`, for `ros2 run gameinfer_ros orchestrator`."""
    return gameinfer.command(["run", *sys.argv[1:]])


def __getattr__(name: str) -> Callable[[], int]:
    if name not in NODES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return partial(_node, name)


def _node(name: str) -> int:
    """Run a node in this process, and return its exit code."""
    return int(load("gameinfer_ros.commands.node_command").main(name, sys.argv[1:]))
