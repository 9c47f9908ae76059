"""A player's next inputs: trajectory_msgs/MultiDOFJointTrajectory.

The first joint is the player's body, named as the player; others are those of its vehicle, such as
the steering of a car. The first point is for the step of the stamp; the later ones bridge the gap
if the next message is late. The twist of a point holds the rates that are inputs (omega of a
unicycle), its acceleration the accelerations that are (a of a unicycle); both in the joint's frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from rclpy.duration import Duration
from std_msgs.msg import Header
from trajectory_msgs.msg import MultiDOFJointTrajectory, MultiDOFJointTrajectoryPoint

from msg_adapters import planar, stamp
from msg_adapters.error import MessageError, check_finite, check_length, check_names

#: A message has at most so many points.
LONGEST = 1000


@dataclass(frozen=True)
class Control:
    """What a control message says.

    Attributes:
        step: the step that the first input is for.
        twists: rates of each joint commanded at each step (S, L, 3), in m/s and rad/s.
        accelerations: accelerations commanded likewise (S, L, 3), in m/s^2 and rad/s^2.
    """

    step: int
    twists: np.ndarray
    accelerations: np.ndarray


def largest(names: Sequence[str]) -> int:
    """A message of the player with these joints has at most so many bytes."""
    # A twist has 48, a point two for each joint.
    return 1024 + sum(8 + len(name) for name in names) + LONGEST * (64 + 96 * len(names))


def encode(control: Control, names: Sequence[str], dt: float) -> MultiDOFJointTrajectory:
    """Message with the inputs of the player with these joints, of which the first is its body."""
    return MultiDOFJointTrajectory(
        header=Header(stamp=stamp.encode(control.step, dt), frame_id=names[0]),
        joint_names=list(names),
        points=[
            MultiDOFJointTrajectoryPoint(
                velocities=[planar.twist(rates) for rates in twists],
                accelerations=[planar.twist(rates) for rates in accelerations],
                time_from_start=Duration(nanoseconds=round(k * dt * 1e9)).to_msg(),
            )
            for k, (twists, accelerations) in enumerate(
                zip(control.twists, control.accelerations, strict=True)
            )
        ],
    )


def decode(message: MultiDOFJointTrajectory, names: Sequence[str], dt: float) -> Control:
    """What a message of the player with these joints says.

    Raises:
        MessageError: the message is of another player, has a stamp between steps, no point or more
            than `LONGEST`, a point without a rate or an acceleration of a joint, or a number that
            is not finite.
    """
    check_names("joint_names", message.joint_names, names)
    if not message.points:
        raise MessageError("points: is empty; at least one is expected")
    if len(message.points) > LONGEST:
        raise MessageError(
            f"points: has {len(message.points)} items; at most {LONGEST} are allowed"
        )
    for k, point in enumerate(message.points):
        check_length(f"points[{k}].velocities", point.velocities, len(names))
        check_length(f"points[{k}].accelerations", point.accelerations, len(names))
    twists = np.array([[planar.from_twist(t) for t in p.velocities] for p in message.points])
    accelerations = np.array(
        [[planar.from_twist(t) for t in p.accelerations] for p in message.points]
    )
    check_finite("points.velocities", twists)
    check_finite("points.accelerations", accelerations)
    return Control(stamp.decode(message.header.stamp, dt), twists, accelerations)
