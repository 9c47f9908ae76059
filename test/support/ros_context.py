"""ROS contexts of tests."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest
import rclpy
from rclpy.signals import SignalHandlerOptions
from ros_domain import free_domain


def make_context(domain: int | None = None) -> rclpy.Context:
    """A context on this machine only, in a domain of its own by default; Ctrl-C is for pytest."""
    context = rclpy.Context()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        rclpy.init(
            context=context,
            domain_id=free_domain() if domain is None else domain,
            signal_handler_options=SignalHandlerOptions.NO,
        )
    return context


@contextmanager
def ros_context(domain: int | None = None) -> Iterator[rclpy.Context]:
    """A context like that, which is shut down in the end."""
    context = make_context(domain)
    try:
        yield context
    finally:
        context.try_shutdown()
