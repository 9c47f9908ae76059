"""Predicted trajectories of all players: trajectory_msgs/MultiDOFJointTrajectory.

Joints are those of `msg_adapters.joint_state`: the players, then the joints that players have.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from rclpy.duration import Duration
from std_msgs.msg import Header
from trajectory_msgs.msg import MultiDOFJointTrajectory, MultiDOFJointTrajectoryPoint

from msg_adapters import planar, stamp
from msg_adapters.error import MessageError, check_finite, check_frame, check_length, check_names
from msg_adapters.joint_state import FRAME


@dataclass(frozen=True)
class Equilibrium:
    """What an equilibrium message says.

    Attributes:
        step: the step that the trajectories start at.
        poses: x, y, yaw at S steps (S, N, 3), in m and rad.
        twists: rates (S, N, 3), in m/s and rad/s.
        accelerations: accelerations (S, N, 3), in m/s^2 and rad/s^2.
    """

    step: int
    poses: np.ndarray
    twists: np.ndarray
    accelerations: np.ndarray


def encode(equilibrium: Equilibrium, names: Sequence[str], dt: float) -> MultiDOFJointTrajectory:
    """Message with the trajectories of the joints with these names."""
    return MultiDOFJointTrajectory(
        header=Header(stamp=stamp.encode(equilibrium.step, dt), frame_id=FRAME),
        joint_names=list(names),
        points=[
            MultiDOFJointTrajectoryPoint(
                transforms=[planar.transform(pose) for pose in poses],
                velocities=[planar.twist(rates) for rates in twists],
                accelerations=[planar.twist(rates) for rates in accelerations],
                time_from_start=Duration(nanoseconds=round(k * dt * 1e9)).to_msg(),
            )
            for k, (poses, twists, accelerations) in enumerate(
                zip(
                    equilibrium.poses,
                    equilibrium.twists,
                    equilibrium.accelerations,
                    strict=True,
                )
            )
        ],
    )


def decode(message: MultiDOFJointTrajectory, names: Sequence[str], dt: float) -> Equilibrium:
    """What a message about the joints with these names says.

    Raises:
        MessageError: the message is about others, in another frame, has a stamp between steps, no
            point, arrays of other lengths, a rotation that is none, or a number that is not
            finite.
    """
    check_frame(message.header.frame_id, FRAME)
    check_names("joint_names", message.joint_names, names)
    if not message.points:
        raise MessageError("points: is empty; at least one is expected")
    for k, point in enumerate(message.points):
        for field in ("transforms", "velocities", "accelerations"):
            check_length(f"points[{k}].{field}", getattr(point, field), len(names))
    poses = np.array(
        [
            [
                planar.from_transform(f"points[{k}].transforms[{i}]", transform)
                for i, transform in enumerate(point.transforms)
            ]
            for k, point in enumerate(message.points)
        ]
    )
    twists = np.array([[planar.from_twist(t) for t in p.velocities] for p in message.points])
    accelerations = np.array(
        [[planar.from_twist(t) for t in p.accelerations] for p in message.points]
    )
    check_finite("points.transforms", poses)
    check_finite("points.velocities", twists)
    check_finite("points.accelerations", accelerations)
    return Equilibrium(stamp.decode(message.header.stamp, dt), poses, twists, accelerations)
