"""The velocity that a real base is to have: geometry_msgs/TwistStamped in its body frame.

Its stamp is the time at which it was commanded, and not that of a step: bases compare it to their
clock, and ignore what is old.
"""

from __future__ import annotations

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import TwistStamped
from std_msgs.msg import Header

from msg_adapters import planar
from msg_adapters.error import check_finite, check_frame


def encode(now: Time, twist: np.ndarray, name: str) -> TwistStamped:
    """Message with the body rates (3,), in m/s and rad/s, that player `name` is to have."""
    header = Header(stamp=now, frame_id=name)
    return TwistStamped(header=header, twist=planar.twist(twist))


def decode(message: TwistStamped, name: str) -> np.ndarray:
    """Body rates (3,) for player `name`.

    Raises:
        MessageError: another frame, or a number that is not finite.
    """
    check_frame(message.header.frame_id, name)
    twist = planar.from_twist(message.twist)
    check_finite("twist", twist)
    return twist
