"""A node in a thread of its own, which goes on while a trial waits for something."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Thread
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from gameinfer_ros.nodes.base import middleware

#: It keeps to the loopback interface, too: by the range LOCALHOST there would be shared memory.
#: Fast DDS reads it once in a process, so it is for all that follow.
_PROFILE = Path(__file__).with_name("no_shared_memory.xml")


@contextmanager
def environment(**variables: str) -> Iterator[None]:
    """Set variables of the environment for what is started in the block."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


class Bystander:
    """Runs a node in the background.

    It has no shared memory, which would keep that of processes that are killed.

    Args:
        domain: ROS domain that it is in.
        make: makes the node, with the options that `rclpy.node.Node` takes.
    """

    def __init__(self, domain: int, make: Callable[..., Node]) -> None:
        self._context = rclpy.Context()
        with environment(**{middleware.FAST_DDS: str(_PROFILE), middleware.RANGE: "SUBNET"}):
            rclpy.init(
                context=self._context,
                domain_id=domain,
                signal_handler_options=SignalHandlerOptions.NO,
            )
            self.node: Any = make(context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._ends = False
        self._failure: Exception | None = None
        self._thread = Thread(target=self._spin, daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        try:
            while not self._ends:
                self._executor.spin_once(timeout_sec=0.05)
        except Exception as error:  # whatever it is, nothing was heard from then on
            self._failure = error

    def end(self) -> None:
        """Stop the node; it may have been stopped before.

        Raises:
            Exception: the node had ended before, by this one.
        """
        if not self._ends:
            self._ends = True
            self._thread.join()
            self.node.destroy_node()
            self._context.try_shutdown()
            if self._failure is not None:
                raise self._failure
