"""Publisher of the states of a run."""

from __future__ import annotations

from time import perf_counter

import numpy as np
from builtin_interfaces.msg import Time
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import MultiDOFJointState

from gameinfer_ros.nodes.base.game_node import GameNode
from msg_adapters import clock, joint_state, odometry, qos, stamp


class StatePublisher:
    """Publishes the start of a run and its states, in all messages that carry them.

    Args:
        node: the node that publishes.
        simulated: indices of the simulated players; each gets its own odometry.
        publish_clock: whether to publish the simulated time on `/clock`.

    Attributes:
        last_stamp: the last published stamp of all runs, in ns; 0 if there is none.
    """

    def __init__(self, node: GameNode, simulated: list[int], publish_clock: bool) -> None:
        names = node.players.names
        self._vehicles = node.vehicles
        self.last_stamp = 0
        self._run_start = node.advertise(Time, "run_start", qos.LATEST)
        self._joint_state = node.advertise(MultiDOFJointState, "joint_state", qos.STREAM)
        self._clock = node.advertise(Clock, "/clock", qos.CLOCK) if publish_clock else None
        self._odom = {
            i: node.advertise(Odometry, f"{names[i]}/odom", qos.RECENT) for i in simulated
        }

    @property
    def subscribers(self) -> int:
        """Number of subscribers of `joint_state`."""
        return int(self._joint_state.get_subscription_count())

    def start(self, start: int) -> None:
        """Publish the start of a run, in ns."""
        self._run_start.publish(stamp.encode(start))

    def publish(self, time: int, s: np.ndarray, w: np.ndarray) -> float:
        """Publish a state.

        Args:
            time: its stamp, in ns.
            s: joint state (ns,) of the vehicles.
            w: joint input (nw,) of the vehicles, applied during the previous step.

        Returns:
            Time of publication, by `time.perf_counter`, in s.
        """
        vehicles, names = self._vehicles, self._vehicles.joint_names
        self.last_stamp = time
        state = joint_state.JointState(
            time, vehicles.poses(s), vehicles.twists(s, w), vehicles.accelerations(w)
        )
        if self._clock is not None:
            self._clock.publish(clock.encode(time))
        for i, publisher in self._odom.items():
            publisher.publish(odometry.encode(time, state.poses[i], state.twists[i], names[i]))
        # joint_state comes last: a node that reacts to the last state may end this process.
        published = perf_counter()
        self._joint_state.publish(joint_state.encode(state, names))
        return published
