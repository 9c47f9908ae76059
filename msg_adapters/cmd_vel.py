"""The velocity that a real base is to have: geometry_msgs/TwistStamped in its body frame."""

from __future__ import annotations

import numpy as np
from geometry_msgs.msg import TwistStamped
from std_msgs.msg import Header

from msg_adapters import planar, stamp
from msg_adapters.error import check_finite, check_frame


def encode(step: int, twist: np.ndarray, name: str, dt: float) -> TwistStamped:
    """Message with the body rates (3,), in m/s and rad/s, that player `name` is to have."""
    header = Header(stamp=stamp.encode(step, dt), frame_id=name)
    return TwistStamped(header=header, twist=planar.twist(twist))


def decode(message: TwistStamped, name: str, dt: float) -> tuple[int, np.ndarray]:
    """Step and body rates (3,) for player `name`.

    Raises:
        MessageError: another frame, a stamp between steps, or a number that is not finite.
    """
    check_frame(message.header.frame_id, name)
    twist = planar.from_twist(message.twist)
    check_finite("twist", twist)
    return stamp.decode(message.header.stamp, dt), twist
