"""Node statuses: diagnostic_msgs/DiagnosticArray."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from msg_adapters import stamp
from msg_adapters.error import MessageError

if TYPE_CHECKING:
    from diagnostic_msgs.msg import DiagnosticArray

#: Levels, as in diagnostic_msgs/DiagnosticStatus.
OK, WARN, ERROR, STALE = b"\x00", b"\x01", b"\x02", b"\x03"


@dataclass(frozen=True)
class NodeStatus:
    """The status of a node.

    Attributes:
        name: full name of the node.
        message: description of the status.
        values: values by key.
        level: `OK`, `WARN`, `ERROR` or `STALE`.
    """

    name: str
    message: str
    values: Mapping[str, str] = field(default_factory=dict)
    level: bytes = OK


def encode(status: NodeStatus, now: int) -> DiagnosticArray:
    """Convert a status to a message with the stamp `now`, in ns."""
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
    from std_msgs.msg import Header

    values = [KeyValue(key=key, value=value) for key, value in status.values.items()]
    return DiagnosticArray(
        header=Header(stamp=stamp.encode(now)),
        status=[
            DiagnosticStatus(
                level=status.level,
                name=status.name,
                message=status.message,
                hardware_id="",
                values=values,
            )
        ],
    )


def decode(message: DiagnosticArray) -> list[NodeStatus]:
    """Convert a message to statuses.

    Raises:
        MessageError: a level is unknown.
    """
    return [
        NodeStatus(s.name, s.message, {v.key: v.value for v in s.values}, _level(s.level))
        for s in message.status
    ]


def _level(level: bytes | int) -> bytes:
    """Convert a level to the type of rclpy, bytes; rosbags has a signed integer."""
    level = level if isinstance(level, bytes) else bytes([level % 256])
    if level not in (OK, WARN, ERROR, STALE):
        raise MessageError(f"level: {level!r} is not allowed: it must be from 0 to 3")
    return level


def whole_number(status: NodeStatus, figure: str) -> int | None:
    """The value with this key as a whole number; None if it is missing.

    Raises:
        MessageError: it is not a whole number of at most 18 digits.
    """
    text = status.values.get(figure)
    if text is None:
        return None
    if not re.fullmatch(r"[0-9]{1,18}", text):
        raise MessageError(
            f"{status.name}: {figure}: '{text}' is not allowed: it must be a whole number of at "
            "most 18 digits"
        )
    return int(text)


def number(status: NodeStatus, figure: str) -> float | None:
    """The value with this key as a number; None if it is missing.

    Raises:
        MessageError: it is not a finite number.
    """
    text = status.values.get(figure)
    if text is None:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise MessageError(
            f"{status.name}: {figure}: '{text}' is not allowed: it must be a finite number"
        )
    return value
