"""Predicted trajectories of all players: trajectory_msgs/MultiDOFJointTrajectory.

The joints are those of `msg_adapters.joint_state`: the players, then the joints of their vehicles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from msg_adapters import stamp, trajectory
from msg_adapters.error import check_equal
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
    """Convert trajectories of the joints `names`, with steps of `dt` in s, to a message."""
    return trajectory.encode(
        equilibrium.stamp,
        FRAME,
        names,
        dt,
        transforms=equilibrium.poses,
        velocities=equilibrium.twists,
        accelerations=equilibrium.accelerations,
    )


def decode(message: MultiDOFJointTrajectory, names: Sequence[str]) -> Equilibrium:
    """Convert a message to the trajectories of the joints `names`.

    Raises:
        MessageError: the joints do not match, the frame is not `map`, there are no points, the
            length of an array does not match, a rotation is invalid, or a number is not finite.
    """
    check_equal("header.frame_id", message.header.frame_id, FRAME)
    fields = trajectory.decode(message, names, "transforms", "velocities", "accelerations")
    return Equilibrium(stamp.decode(message.header.stamp), *fields)
