"""The velocity that a real base is to have: geometry_msgs/TwistStamped in its body frame.

Its stamp is the time at which it was commanded, and not that of a step: bases compare it to their
clock, and ignore what is old.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from msg_adapters import planar, stamp
from msg_adapters.error import check_finite, check_frame

if TYPE_CHECKING:
    from geometry_msgs.msg import TwistStamped


def encode(now: int, twist: np.ndarray, name: str) -> TwistStamped:
    """Message with the body rates (3,), in m/s and rad/s, that player `name` is to have.

    Its stamp is `now`, in ns.
    """
    from geometry_msgs.msg import TwistStamped
    from std_msgs.msg import Header

    header = Header(stamp=stamp.encode(now), frame_id=name)
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
