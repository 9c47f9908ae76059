"""Simulated time: rosgraph_msgs/Clock."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msg_adapters import stamp

if TYPE_CHECKING:
    from rosgraph_msgs.msg import Clock


def encode(time: int) -> Clock:
    """Convert a time, in ns, to a message."""
    from rosgraph_msgs.msg import Clock

    return Clock(clock=stamp.encode(time))


def decode(message: Clock) -> int:
    """Convert a message to a time, in ns.

    Raises:
        MessageError: `nanosec` is a second or more.
    """
    return stamp.decode(message.clock)
