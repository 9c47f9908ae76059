"""Trajectories of S points and N joints: trajectory_msgs/MultiDOFJointTrajectory."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from msg_adapters import planar, stamp
from msg_adapters.error import MessageError, check_equal, check_finite, check_length

if TYPE_CHECKING:
    from geometry_msgs.msg import Twist
    from trajectory_msgs.msg import MultiDOFJointTrajectory


def encode(
    time: int, frame: str, names: Sequence[str], dt: float, **fields: np.ndarray
) -> MultiDOFJointTrajectory:
    """Convert the fields of all points (S, N, 3), `dt` apart, to a message.

    The field `transforms` contains poses; `velocities` and `accelerations` contain rates.
    """
    from builtin_interfaces.msg import Duration
    from std_msgs.msg import Header
    from trajectory_msgs.msg import MultiDOFJointTrajectory, MultiDOFJointTrajectoryPoint

    points = []
    for k, rows in enumerate(zip(*fields.values(), strict=True)):
        seconds, nanoseconds = divmod(round(k * dt * 1e9), stamp.SECOND)
        later = Duration(sec=seconds, nanosec=nanoseconds)
        point = MultiDOFJointTrajectoryPoint(time_from_start=later)
        for field, row in zip(fields, rows, strict=True):
            make = planar.transform if field == "transforms" else planar.twist
            setattr(point, field, [make(values) for values in row])
        points.append(point)
    header = Header(stamp=stamp.encode(time), frame_id=frame)
    return MultiDOFJointTrajectory(header=header, joint_names=list(names), points=points)


def decode(
    message: MultiDOFJointTrajectory, names: Sequence[str], *fields: str
) -> list[np.ndarray]:
    """Convert a message to an array (S, N, 3) for each of some fields.

    Raises:
        MessageError: the joints do not match, there are no points, a point lacks an item, a
            rotation is invalid, or a number is not finite.
    """
    check_equal("joint_names", list(message.joint_names), list(names))
    if not message.points:
        raise MessageError("points: is empty; at least one is expected")
    arrays = []
    for field in fields:
        read = planar.from_transform if field == "transforms" else _rates
        rows = []
        for k, point in enumerate(message.points):
            path, items = f"points[{k}].{field}", getattr(point, field)
            check_length(path, items, len(names))
            rows.append([read(f"{path}[{i}]", item) for i, item in enumerate(items)])
        arrays.append(np.array(rows))
        check_finite(f"points.{field}", arrays[-1])
    return arrays


def _rates(path: str, item: Twist) -> np.ndarray:
    return planar.from_twist(item)
