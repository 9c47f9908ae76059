"""Planar poses and rates in the three-dimensional types of geometry_msgs.

A pose is (x, y, yaw) in m and rad; rates are (x, y, yaw) in m/s and rad/s, or in m/s^2 and
rad/s^2. What is out of the plane is 0 in messages made here and left aside in others.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gameinfer_ros.games import heading
from msg_adapters.error import MessageError

if TYPE_CHECKING:
    from geometry_msgs.msg import Pose, Quaternion, Transform, Twist


def quaternion(yaw: float) -> Quaternion:
    """Rotation about the vertical axis."""
    from geometry_msgs.msg import Quaternion

    x, y, z, w = heading.quaternion(yaw)
    return Quaternion(x=x, y=y, z=z, w=w)


def yaw(field: str, rotation: Quaternion) -> float:
    """Yaw of a rotation, in (-pi, pi].

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
    """Transform at a pose (3,)."""
    from geometry_msgs.msg import Transform, Vector3

    return Transform(
        translation=Vector3(x=float(pose[0]), y=float(pose[1]), z=0.0),
        rotation=quaternion(pose[2]),
    )


def from_transform(field: str, message: Transform) -> np.ndarray:
    """Pose (3,) of a transform.

    Raises:
        MessageError: the quaternion is not of unit length.
    """
    t = message.translation
    return np.array([t.x, t.y, yaw(f"{field}.rotation", message.rotation)])


def pose(values: np.ndarray) -> Pose:
    """Pose message of a pose (3,)."""
    from geometry_msgs.msg import Point, Pose

    return Pose(
        position=Point(x=float(values[0]), y=float(values[1]), z=0.0),
        orientation=quaternion(values[2]),
    )


def from_pose(field: str, message: Pose) -> np.ndarray:
    """Pose (3,) of a pose message.

    Raises:
        MessageError: the quaternion is not of unit length.
    """
    p = message.position
    return np.array([p.x, p.y, yaw(f"{field}.orientation", message.orientation)])


def twist(rates: np.ndarray) -> Twist:
    """Twist with these rates (3,)."""
    from geometry_msgs.msg import Twist, Vector3

    return Twist(
        linear=Vector3(x=float(rates[0]), y=float(rates[1]), z=0.0),
        angular=Vector3(x=0.0, y=0.0, z=float(rates[2])),
    )


def from_twist(message: Twist) -> np.ndarray:
    """Rates (3,) of a twist."""
    return np.array([message.linear.x, message.linear.y, message.angular.z])
