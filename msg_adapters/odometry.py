"""The state of one player: nav_msgs/Odometry, with the pose in the frame `map`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from msg_adapters import planar, stamp
from msg_adapters.error import check_equal, check_finite
from msg_adapters.joint_state import FRAME

if TYPE_CHECKING:
    from nav_msgs.msg import Odometry


def encode(time: int, pose: np.ndarray, twist: np.ndarray, name: str) -> Odometry:
    """Convert a state to a message.

    Args:
        time: stamp, in ns.
        pose: x, y, yaw (3,), in m and rad.
        twist: body rates (3,), in m/s and rad/s.
        name: name of the player, which is also that of its body frame.
    """
    from geometry_msgs.msg import PoseWithCovariance, TwistWithCovariance
    from nav_msgs.msg import Odometry
    from std_msgs.msg import Header

    return Odometry(
        header=Header(stamp=stamp.encode(time), frame_id=FRAME),
        child_frame_id=name,
        pose=PoseWithCovariance(pose=planar.pose(pose)),
        twist=TwistWithCovariance(twist=planar.twist(twist)),
    )


def decode(message: Odometry) -> tuple[int, np.ndarray, np.ndarray]:
    """Convert a message to a state.

    Covariances and `child_frame_id` are ignored.

    Returns:
        Stamp in ns, pose (3,) in m and rad, and body rates (3,) in m/s and rad/s.

    Raises:
        MessageError: the frame is not `map`, the rotation is invalid, or a number is not finite.
    """
    check_equal("header.frame_id", message.header.frame_id, FRAME)
    pose = planar.from_pose("pose.pose", message.pose.pose)
    twist = planar.from_twist(message.twist.twist)
    check_finite("pose", pose)
    check_finite("twist", twist)
    return stamp.decode(message.header.stamp), pose, twist
