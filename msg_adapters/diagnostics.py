"""How a node is doing: diagnostic_msgs/DiagnosticArray with one status."""

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
    """What a node says of itself.

    Attributes:
        name: the node's name, with its namespace.
        message: in words.
        values: figures by name.
        level: OK, WARN, ERROR or STALE.
    """

    name: str
    message: str
    values: Mapping[str, str] = field(default_factory=dict)
    level: bytes = OK


def encode(status: NodeStatus, now: int) -> DiagnosticArray:
    """Message with a status, stamped with the time on the node's clock, in ns."""
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
    """All statuses of a message, which may come from any node.

    Raises:
        MessageError: a level is none of the known ones.
    """
    return [
        NodeStatus(s.name, s.message, {v.key: v.value for v in s.values}, _level(s.level))
        for s in message.status
    ]


def _level(level: bytes | int) -> bytes:
    """A level as rclpy has it; for rosbags it is a number with a sign."""
    level = level if isinstance(level, bytes) else bytes([level % 256])
    if level not in (OK, WARN, ERROR, STALE):
        raise MessageError(f"level: {level!r} is not allowed: it is from 0 to 3")
    return level


def whole_number(status: NodeStatus, figure: str) -> int | None:
    """The figure with this name as a whole number; None if the status does not have it.

    Raises:
        MessageError: it is none, or below 0.
    """
    text = status.values.get(figure)
    if text is None:
        return None
    if not re.fullmatch(r"[0-9]{1,18}", text):
        raise MessageError(
            f"{status.name}: {figure}: '{text}' is not allowed: it must be a whole number from 0 on"
        )
    return int(text)


def number(status: NodeStatus, figure: str) -> float | None:
    """The figure with this name as a number; None if the status does not have it.

    Raises:
        MessageError: it is no finite number.
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
