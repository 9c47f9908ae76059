"""Disks that are full for some processes, and nodes that write logs.

A limit of the size of a process's files stands for the full disk: it can be set at any time, by
anyone, and only ends the growth of files, as of a disk that is full.
"""

from __future__ import annotations

import resource
from typing import Any

from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.task import Future
from test_orchestrator import DEADLINE

#: A parameter of each node that may change while it runs, and some value.
_LIVE: dict[str, tuple[str, Any]] = {
    "simulator": ("odom_timeout", 0.7),
    "inference": ("seed", 7),
    "robot_planner": ("seed", 7),
    "human_1_agent": ("seed", 7),
}


def fill_up(pid: int, size: int) -> None:
    """Let no file that a process writes become longer than so many bytes."""
    resource.prlimit(pid, resource.RLIMIT_FSIZE, (size, size))


def set_live(node: Node) -> dict[str, Future]:
    """Ask each node of a run for a change that it writes into its log.

    Returns:
        What becomes the `rcl_interfaces.srv.SetParameters.Response` of each.
    """
    answers = {}
    for name, (parameter, value) in _LIVE.items():
        client = node.create_client(SetParameters, f"/{name}/set_parameters")
        assert client.wait_for_service(DEADLINE), name
        change = Parameter(parameter, value=value).to_parameter_msg()
        answers[name] = client.call_async(SetParameters.Request(parameters=[change]))
    return answers
