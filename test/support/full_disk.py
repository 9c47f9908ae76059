"""Disks that are full for some processes, and nodes that write logs.

A limit of the size of a process's files stands for the full disk: it can be set at any time, by
anyone, and only ends the growth of files, as of a disk that is full.
"""

from __future__ import annotations

import resource
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from rcl_interfaces.srv import SetParameters
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from ros_context import make_context
from run_command import DEADLINE

#: A parameter of each node that may change while it runs, and some value.
_LIVE: dict[str, tuple[str, Any]] = {
    "simulator": ("odom_timeout", 0.7),
    "inference": ("seed", 7),
    "robot_planner": ("plan_length", 7),
    "human_1_agent": ("seed", 7),
}

#: The answer to a first request may be missed: time until it is sent again, in s.
_AGAIN = 5.0


def fill_up(pid: int, size: int) -> None:
    """Let no file that a process writes become longer than `size` bytes."""
    resource.prlimit(pid, resource.RLIMIT_FSIZE, (size, size))


@contextmanager
def log_writer(domain: int) -> Iterator[Callable[[], None]]:
    """What sets a parameter of each node of a run, which the node then tells its log.

    It has done so once, so that no process needs new shared memory for it, which is files too.
    """
    context = make_context(domain)
    executor = SingleThreadedExecutor(context=context)
    node = Node("log_writer", context=context)
    executor.add_node(node)
    clients = {name: node.create_client(SetParameters, f"/{name}/set_parameters") for name in _LIVE}

    def write() -> None:
        for name, client in clients.items():
            parameter, value = _LIVE[name]
            change = Parameter(parameter, value=value).to_parameter_msg()
            deadline, answer = time.monotonic() + DEADLINE, None
            while answer is None:
                assert time.monotonic() < deadline, f"{name} does not answer"
                future = client.call_async(SetParameters.Request(parameters=[change]))
                executor.spin_until_future_complete(future, _AGAIN)
                answer = future.result()
            assert answer.results[0].successful, answer.results[0].reason

    try:
        for client in clients.values():
            assert client.wait_for_service(DEADLINE), client.srv_name
        write()
        yield write
    finally:
        node.destroy_node()
        context.try_shutdown()
