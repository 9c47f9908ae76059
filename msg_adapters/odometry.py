"""The state of one player as a base reports it: nav_msgs/Odometry, pose in the frame `map`."""

from __future__ import annotations

import numpy as np
from geometry_msgs.msg import PoseWithCovariance, TwistWithCovariance
from nav_msgs.msg import Odometry
from std_msgs.msg import Header

from msg_adapters import planar, stamp
from msg_adapters.error import MessageError, check_finite, check_frame
from msg_adapters.joint_state import FRAME


def encode(step: int, pose: np.ndarray, twist: np.ndarray, name: str, dt: float) -> Odometry:
    """Message with the pose (3,), in m and rad, and body rates (3,), in m/s and rad/s."""
    return Odometry(
        header=Header(stamp=stamp.encode(step, dt), frame_id=FRAME),
        child_frame_id=name,
        pose=PoseWithCovariance(pose=planar.pose(pose)),
        twist=TwistWithCovariance(twist=planar.twist(twist)),
    )


def decode(message: Odometry, name: str, dt: float) -> tuple[int, np.ndarray, np.ndarray]:
    """Step, pose (3,) and body rates (3,) of player `name`.

    Raises:
        MessageError: another frame or player, a stamp between steps, a rotation that is none, or
            a number that is not finite.
    """
    check_frame(message.header.frame_id, FRAME)
    if message.child_frame_id != name:
        raise MessageError(
            f"child_frame_id: '{message.child_frame_id}' is not allowed: '{name}' is expected"
        )
    pose = planar.from_pose("pose.pose", message.pose.pose)
    twist = planar.from_twist(message.twist.twist)
    check_finite("pose", pose)
    check_finite("twist", twist)
    return stamp.decode(message.header.stamp, dt), pose, twist
