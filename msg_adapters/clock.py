"""Simulated time: rosgraph_msgs/Clock."""

from __future__ import annotations

from rosgraph_msgs.msg import Clock

from msg_adapters import stamp


def encode(step: int, dt: float) -> Clock:
    """Message with the time of a step."""
    return Clock(clock=stamp.encode(step, dt))


def decode(message: Clock, dt: float) -> int:
    """Step that the time belongs to.

    Raises:
        MessageError: the time is before 0, or between two steps.
    """
    return stamp.decode(message.clock, dt)
