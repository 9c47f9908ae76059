"""Predicted trajectories of all players: trajectory_msgs/MultiDOFJointTrajectory.

The joints are those of `msg_adapters.joint_state`: the players, then the joints of their vehicles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from msg_adapters import planar, stamp
from msg_adapters.duration import to_duration
from msg_adapters.error import MessageError, check_finite, check_frame, check_length, check_names
from msg_adapters.joint_state import FRAME

if TYPE_CHECKING:
    from trajectory_msgs.msg import MultiDOFJointTrajectory


@dataclass(frozen=True)
class Equilibrium:
    """The contents of an equilibrium message, for S steps and N joints.

    Attributes:
        stamp: stamp of the first step, in ns.
        poses: x, y, yaw (S, N, 3), in m and rad.
        twists: rates (S, N, 3), in m/s and rad/s.
        accelerations: accelerations (S, N, 3), in m/s^2 and rad/s^2.
    """

    stamp: int
    poses: np.ndarray
    twists: np.ndarray
    accelerations: np.ndarray


def encode(equilibrium: Equilibrium, names: Sequence[str], dt: float) -> MultiDOFJointTrajectory:
    """Convert trajectories to a message.

    Args:
        equilibrium: the trajectories.
        names: names of the joints.
        dt: length of a time step, in s.
    """
    from std_msgs.msg import Header
    from trajectory_msgs.msg import MultiDOFJointTrajectory, MultiDOFJointTrajectoryPoint

    return MultiDOFJointTrajectory(
        header=Header(stamp=stamp.encode(equilibrium.stamp), frame_id=FRAME),
        joint_names=list(names),
        points=[
            MultiDOFJointTrajectoryPoint(
                transforms=[planar.transform(pose) for pose in poses],
                velocities=[planar.twist(rates) for rates in twists],
                accelerations=[planar.twist(rates) for rates in accelerations],
                time_from_start=to_duration(k * dt),
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


def decode(message: MultiDOFJointTrajectory, names: Sequence[str]) -> Equilibrium:
    """Convert a message to trajectories.

    Args:
        message: the message.
        names: names of the joints.

    Raises:
        MessageError: the joints do not match, the frame is not `map`, there are no points, the
            length of an array does not match, a rotation is invalid, or a number is not finite.
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
    return Equilibrium(stamp.decode(message.header.stamp), poses, twists, accelerations)
