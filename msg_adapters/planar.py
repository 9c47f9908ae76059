"""Planar poses and rates in the three-dimensional types of geometry_msgs.

A pose is (x, y, yaw) in m and rad. Rates are (x, y, yaw) in m/s and rad/s, or in m/s^2 and rad/s^2.
Components out of the plane are set to 0 in encoded messages and ignored in decoded ones.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gameinfer_ros.games import heading
from msg_adapters.error import MessageError

if TYPE_CHECKING:
    from geometry_msgs.msg import Pose, Quaternion, Transform, Twist


def quaternion(yaw: float) -> Quaternion:
    """Convert a yaw angle, in rad, to a quaternion."""
    from geometry_msgs.msg import Quaternion

    x, y, z, w = heading.quaternion(yaw)
    return Quaternion(x=x, y=y, z=z, w=w)


def yaw(field: str, rotation: Quaternion) -> float:
    """Convert a quaternion, in the field `field`, to a yaw angle in (-pi, pi].

    Raises:
        MessageError: the quaternion is not of unit length.
    """
    x, y, z, w = rotation.x, rotation.y, rotation.z, rotation.w
    length = np.sqrt(x * x + y * y + z * z + w * w)
    if not abs(length - 1.0) < 1e-3:
        raise MessageError(
            f"{field}: quaternion ({x}, {y}, {z}, {w}) is not allowed: its length must be 1"
        )
    return heading.yaw(x, y, z, w)


def transform(pose: np.ndarray) -> Transform:
    """Convert a pose (3,) to a transform."""
    from geometry_msgs.msg import Transform, Vector3

    return Transform(
        translation=Vector3(x=float(pose[0]), y=float(pose[1]), z=0.0),
        rotation=quaternion(pose[2]),
    )


def from_transform(field: str, message: Transform) -> np.ndarray:
    """Convert a transform, in the field `field`, to a pose (3,).

    Raises:
        MessageError: the quaternion is not of unit length.
    """
    t = message.translation
    return np.array([t.x, t.y, yaw(f"{field}.rotation", message.rotation)])


def pose(values: np.ndarray) -> Pose:
    """Convert a pose (3,) to a message."""
    from geometry_msgs.msg import Point, Pose

    return Pose(
        position=Point(x=float(values[0]), y=float(values[1]), z=0.0),
        orientation=quaternion(values[2]),
    )


def from_pose(field: str, message: Pose) -> np.ndarray:
    """Convert a message, in the field `field`, to a pose (3,).

    Raises:
        MessageError: the quaternion is not of unit length.
    """
    p = message.position
    return np.array([p.x, p.y, yaw(f"{field}.orientation", message.orientation)])


def twist(rates: np.ndarray) -> Twist:
    """Convert rates (3,) to a twist."""
    from geometry_msgs.msg import Twist, Vector3

    return Twist(
        linear=Vector3(x=float(rates[0]), y=float(rates[1]), z=0.0),
        angular=Vector3(x=0.0, y=0.0, z=float(rates[2])),
    )


def from_twist(message: Twist) -> np.ndarray:
    """Convert a twist to rates (3,)."""
    return np.array([message.linear.x, message.linear.y, message.angular.z])
