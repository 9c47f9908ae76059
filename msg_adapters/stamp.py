"""Stamps: builtin_interfaces/Time, in whole nanoseconds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msg_adapters.error import MessageError

if TYPE_CHECKING:
    from builtin_interfaces.msg import Time

#: Nanoseconds in a second.
SECOND = 1_000_000_000


def encode(nanoseconds: int) -> Time:
    """Convert a time in ns to a stamp."""
    from builtin_interfaces.msg import Time

    return Time(sec=nanoseconds // SECOND, nanosec=nanoseconds % SECOND)


def decode(stamp: Time) -> int:
    """Convert a stamp to a time in ns.

    Raises:
        MessageError: `nanosec` is a second or more.
    """
    if stamp.nanosec >= SECOND:
        raise MessageError(
            f"stamp.nanosec: {stamp.nanosec} is not allowed: it must be from 0 to {SECOND - 1}"
        )
    return int(stamp.sec) * SECOND + int(stamp.nanosec)


def text(nanoseconds: int) -> str:
    """Format a time in ns as seconds with nine digits after the point."""
    return f"{nanoseconds // SECOND}.{nanoseconds % SECOND:09d}"
