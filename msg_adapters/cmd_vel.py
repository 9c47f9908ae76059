"""Velocity commands for a real base: geometry_msgs/TwistStamped in its body frame.

The stamp is the time of the command, not that of a step: bases compare it with their clock and
ignore outdated commands.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from msg_adapters import planar, stamp
from msg_adapters.error import check_equal, check_finite

if TYPE_CHECKING:
    from geometry_msgs.msg import TwistStamped


def encode(now: int, twist: np.ndarray, name: str) -> TwistStamped:
    """Convert body rates (3,), in m/s and rad/s, to a message.

    Args:
        now: time of the command, in ns.
        twist: the commanded rates.
        name: name of the player, which is also that of its body frame.
    """
    from geometry_msgs.msg import TwistStamped
    from std_msgs.msg import Header

    header = Header(stamp=stamp.encode(now), frame_id=name)
    return TwistStamped(header=header, twist=planar.twist(twist))


def decode(message: TwistStamped, name: str) -> np.ndarray:
    """Convert a message to body rates (3,) of the player `name`, in m/s and rad/s.

    Raises:
        MessageError: the frame is not that of the player, or a number is not finite.
    """
    check_equal("header.frame_id", message.header.frame_id, name)
    twist = planar.from_twist(message.twist)
    check_finite("twist", twist)
    return twist
