"""The states of all players: sensor_msgs/MultiDOFJointState.

The first joints are the players. Their transforms are poses in the frame `map`, and their twists
are rates in the body frame. The wrenches, as those of unit masses, are the accelerations in the
body frame that were commanded and applied during the previous step. Together with the twists, they
give the inputs that were applied, which may differ from the requested ones.

Further joints, called `<player>/<joint>`, belong to the vehicles of players, such as the steering
of a car. Their transforms are relative to the body of the player. Their twists and wrenches are in
the frame of the joint.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from msg_adapters import planar, stamp
from msg_adapters.error import check_equal, check_finite, check_length

if TYPE_CHECKING:
    from sensor_msgs.msg import MultiDOFJointState

#: Frame of all poses.
FRAME = "map"


@dataclass(frozen=True)
class JointState:
    """The contents of a joint state message, for N joints.

    Attributes:
        stamp: stamp of the step, in ns.
        poses: x, y, yaw of each joint (N, 3), in m and rad.
        twists: rates of each joint (N, 3), in m/s and rad/s.
        accelerations: accelerations of each joint during the previous step (N, 3), in m/s^2 and
            rad/s^2.
    """

    stamp: int
    poses: np.ndarray
    twists: np.ndarray
    accelerations: np.ndarray


def encode(state: JointState, names: Sequence[str]) -> MultiDOFJointState:
    """Convert the states of the joints `names` to a message."""
    from geometry_msgs.msg import Vector3, Wrench
    from sensor_msgs.msg import MultiDOFJointState
    from std_msgs.msg import Header

    return MultiDOFJointState(
        header=Header(stamp=stamp.encode(state.stamp), frame_id=FRAME),
        joint_names=list(names),
        transforms=[planar.transform(pose) for pose in state.poses],
        twist=[planar.twist(rates) for rates in state.twists],
        wrench=[
            Wrench(
                force=Vector3(x=float(a[0]), y=float(a[1]), z=0.0),
                torque=Vector3(x=0.0, y=0.0, z=float(a[2])),
            )
            for a in state.accelerations
        ],
    )


def decode(message: MultiDOFJointState, names: Sequence[str]) -> JointState:
    """Convert a message to the states of the joints `names`.

    Raises:
        MessageError: the joints do not match, the frame is not `map`, the length of an array does
            not match, a rotation is invalid, or a number is not finite.
    """
    check_equal("header.frame_id", message.header.frame_id, FRAME)
    check_equal("joint_names", list(message.joint_names), list(names))
    for field in ("transforms", "twist", "wrench"):
        check_length(field, getattr(message, field), len(names))
    poses = np.array(
        [planar.from_transform(f"transforms[{i}]", t) for i, t in enumerate(message.transforms)]
    )
    twists = np.array([planar.from_twist(t) for t in message.twist])
    accelerations = np.array([[w.force.x, w.force.y, w.torque.z] for w in message.wrench])
    check_finite("transforms", poses)
    check_finite("twist", twists)
    check_finite("wrench", accelerations)
    return JointState(stamp.decode(message.header.stamp), poses, twists, accelerations)
