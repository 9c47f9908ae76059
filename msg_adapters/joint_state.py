"""The states of all players: sensor_msgs/MultiDOFJointState.

The first joints are the players. Their transform is the pose in the frame `map`, their twist the
rates in the body frame. The wrench, read as that of a unit mass, holds the accelerations in the
body frame that were commanded and applied during the step that led to this state: from them and
from the twist the players know what really was done, and not only what somebody asked for. Further
joints are those that players have, such as the steering of a car, called `<player>/<joint>`; their
transform is against the body of the player, the rest in the frame of the joint.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from msg_adapters import planar, stamp
from msg_adapters.error import check_finite, check_frame, check_length, check_names

if TYPE_CHECKING:
    from sensor_msgs.msg import MultiDOFJointState

FRAME = "map"


@dataclass(frozen=True)
class JointState:
    """What a joint state message says.

    Attributes:
        stamp: time of the step that the state belongs to, in ns.
        poses: x, y, yaw of each joint (N, 3), in m and rad.
        twists: rates of each joint (N, 3), in m/s and rad/s.
        accelerations: accelerations applied before (N, 3), in m/s^2 and rad/s^2.
    """

    stamp: int
    poses: np.ndarray
    twists: np.ndarray
    accelerations: np.ndarray


def encode(state: JointState, names: Sequence[str]) -> MultiDOFJointState:
    """Message with the states of the joints with these names."""
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
    """What a message about the joints with these names says.

    Raises:
        MessageError: the message is about others, in another frame, has arrays of other lengths, a
            rotation that is none, or a number that is not finite.
    """
    check_frame(message.header.frame_id, FRAME)
    check_names("joint_names", message.joint_names, names)
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
