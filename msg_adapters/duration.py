"""Durations: builtin_interfaces/Duration."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from builtin_interfaces.msg import Duration


def to_duration(seconds: float) -> Duration:
    """Convert a duration in s to a message, rounded to the nearest nanosecond."""
    from builtin_interfaces.msg import Duration

    nanoseconds = round(seconds * 1e9)
    return Duration(sec=nanoseconds // 1_000_000_000, nanosec=nanoseconds % 1_000_000_000)
