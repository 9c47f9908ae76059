"""Publisher of the states of a run."""

from time import perf_counter, time_ns

import numpy as np
from builtin_interfaces.msg import Time
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import MultiDOFJointState

from gameinfer_ros.nodes.base.game_node import GameNode
from msg_adapters import clock, joint_state, odometry, qos, stamp


class StatePublisher:
    """Publishes the start of a run and its states, in all messages that carry them.

    Each of the `simulated` players, given by index, gets its own odometry. The run waits for a
    number of `subscribers` of `joint_state`.
    """

    def __init__(
        self, node: GameNode, simulated: list[int], publish_clock: bool, subscribers: int
    ) -> None:
        names = node.players.names
        self._node, self._vehicles = node, node.vehicles
        self._last_stamp, self._subscribers = 0, subscribers
        self._run_start = node.advertise(Time, "run_start", qos.LATEST)
        self._joint_state = node.advertise(MultiDOFJointState, "joint_state", qos.STREAM)
        self._clock = node.advertise(Clock, "/clock", qos.CLOCK) if publish_clock else None
        self._odom = {
            i: node.advertise(Odometry, f"{names[i]}/odom", qos.RECENT) for i in simulated
        }

    @property
    def lacking(self) -> str:
        """The subscribers of `joint_state` to wait for, in words; empty if there are enough."""
        count = self._subscribers - self._joint_state.get_subscription_count()
        return f"{count} more subscriber{'s' * (count > 1)} of joint_state" if count > 0 else ""

    def start(self, after_last: bool) -> int:
        """Choose the start of a run, in ns, and publish it.

        With `after_last`, it is later than all published stamps. If the clock of the node does not
        run, it is then the system time, or follows the last stamp.
        """
        start = self._node.now
        if after_last:
            start = max(start or time_ns(), self._last_stamp + 1000)
        # Clocks may be coarse. Different digits below a microsecond keep the stamps of two runs
        # apart.
        start += time_ns() % 1000 - start % 1000
        self._run_start.publish(stamp.encode(start))
        return start

    def publish(self, time: int, s: np.ndarray, w: np.ndarray) -> float:
        """Publish the joint state `s` (ns,) at `time`, in ns, after the joint input `w` (nw,).

        Returns:
            Time of publication, by `time.perf_counter`, in s.
        """
        vehicles, names = self._vehicles, self._vehicles.joint_names
        self._last_stamp = time
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
