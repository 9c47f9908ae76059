"""The next inputs of a player: trajectory_msgs/MultiDOFJointTrajectory.

The first joint is the body of the player and has its name. Further joints belong to its vehicle,
such as the steering of a car. The first point is the input for the step of the stamp; later points
bridge the gap if the next message is late. Inputs that are rates, such as omega of a unicycle, are
in the velocities of a point. Inputs that are accelerations, such as a of a unicycle, are in its
accelerations. Both are in the frame of the joint.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from msg_adapters import stamp, trajectory
from msg_adapters.error import MessageError

if TYPE_CHECKING:
    from trajectory_msgs.msg import MultiDOFJointTrajectory

#: Largest number of points in a message.
LONGEST = 1000


@dataclass(frozen=True)
class Control:
    """The contents of a control message, for S steps and L joints.

    Attributes:
        stamp: stamp of the step of the first input, in ns.
        twists: commanded rates of each joint at each step (S, L, 3), in m/s and rad/s.
        accelerations: commanded accelerations of each joint at each step (S, L, 3), in m/s^2 and
            rad/s^2.
    """

    stamp: int
    twists: np.ndarray
    accelerations: np.ndarray


def largest(names: Sequence[str]) -> int:
    """Upper limit on the size of a message, in bytes, for a player with these joints."""
    # A twist takes 48 bytes, and a point has two for each joint.
    return 1024 + sum(8 + len(name) for name in names) + LONGEST * (64 + 96 * len(names))


def encode(control: Control, names: Sequence[str], dt: float) -> MultiDOFJointTrajectory:
    """Convert inputs to a message.

    Args:
        control: the inputs.
        names: names of the joints. The first is the name of the player.
        dt: length of a time step, in s.
    """
    return trajectory.encode(
        control.stamp,
        names[0],
        names,
        dt,
        velocities=control.twists,
        accelerations=control.accelerations,
    )


def decode(message: MultiDOFJointTrajectory, names: Sequence[str]) -> Control:
    """Convert a message to the inputs of the joints `names`, the first of which is the player.

    Raises:
        MessageError: the joints do not match, there are no points or more than `LONGEST`, a point
            lacks a rate or an acceleration, or a number is not finite.
    """
    if len(message.points) > LONGEST:
        raise MessageError(
            f"points: has {len(message.points)} items; at most {LONGEST} are allowed"
        )
    fields = trajectory.decode(message, names, "velocities", "accelerations")
    return Control(stamp.decode(message.header.stamp), *fields)
