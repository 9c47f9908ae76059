"""The state of one player as a base reports it: nav_msgs/Odometry, pose in the frame `map`."""

from __future__ import annotations

import numpy as np
from geometry_msgs.msg import PoseWithCovariance, TwistWithCovariance
from nav_msgs.msg import Odometry
from std_msgs.msg import Header

from msg_adapters import planar, stamp
from msg_adapters.error import check_finite, check_frame
from msg_adapters.joint_state import FRAME


def encode(step: int, pose: np.ndarray, twist: np.ndarray, name: str, dt: float) -> Odometry:
    """Message with the pose (3,), in m and rad, and body rates (3,), in m/s and rad/s."""
    return Odometry(
        header=Header(stamp=stamp.encode(step, dt), frame_id=FRAME),
        child_frame_id=name,
        pose=PoseWithCovariance(pose=planar.pose(pose)),
        twist=TwistWithCovariance(twist=planar.twist(twist)),
    )


def decode(message: Odometry) -> tuple[float, np.ndarray, np.ndarray]:
    """Time of the stamp, in s, pose (3,) and body rates (3,) of a base.

    The rates are in the frame `child_frame_id` of the base, whatever that is called. Covariances
    are left aside.

    Raises:
        MessageError: another frame than `map`, a rotation that is none, or a number that is not
            finite.
    """
    check_frame(message.header.frame_id, FRAME)
    pose = planar.from_pose("pose.pose", message.pose.pose)
    twist = planar.from_twist(message.twist.twist)
    check_finite("pose", pose)
    check_finite("twist", twist)
    return stamp.seconds(message.header.stamp), pose, twist
