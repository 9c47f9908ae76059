"""Stamps: a message belongs to a time step, and its stamp is the time of that step."""

from __future__ import annotations

from builtin_interfaces.msg import Time

from msg_adapters.error import MessageError

_NANOSECONDS = 1_000_000_000


def encode(step: int, dt: float) -> Time:
    """Stamp of a step (0 or later), with `dt` the length of a step in s."""
    nanoseconds = round(step * dt * _NANOSECONDS)
    return Time(sec=nanoseconds // _NANOSECONDS, nanosec=nanoseconds % _NANOSECONDS)


def decode(stamp: Time, dt: float) -> int:
    """Step that a stamp belongs to.

    Raises:
        MessageError: the stamp is before 0, or between two steps.
    """
    nanoseconds = stamp.sec * _NANOSECONDS + stamp.nanosec
    step = round(nanoseconds / (dt * _NANOSECONDS))
    # A stamp has whole nanoseconds.
    if step < 0 or abs(nanoseconds - step * dt * _NANOSECONDS) > 1.0:
        raise MessageError(
            f"stamp: {stamp.sec}.{stamp.nanosec:09d} s is not allowed: "
            f"it must be a multiple of {dt} s from 0 on"
        )
    return step


def seconds(stamp: Time) -> float:
    """Time of a stamp that is on a clock and not on the grid of steps, in s."""
    return float(stamp.sec + stamp.nanosec / _NANOSECONDS)
