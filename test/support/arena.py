"""A simulator with external players, whose clock and odometry the test sets."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from nav_msgs.msg import Odometry
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import MultiDOFJointState

from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.nodes.simulator import Simulator
from gameinfer_ros.scenario import Scenario
from msg_adapters import diagnostics, joint_state, odometry, qos, stamp

#: The clock of the external players does not begin at 0.
EPOCH = 1000.0
#: Rates of the external players: a circle, in m/s and rad/s.
TWIST = np.array([0.8, 0.0, 0.5])


def time_of(seconds: float) -> Time:
    nanoseconds = round(seconds * 1e9)
    return Time(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)


def circle(time: float) -> np.ndarray:
    """Pose (3,) at a time of a person who walks in a circle with the rates `TWIST`."""
    radius, yaw = TWIST[0] / TWIST[2], TWIST[2] * time
    return np.array([radius * np.sin(yaw), -radius * np.cos(yaw), yaw])


class Arena:
    """A simulator, a clock that the test sets, and players that the test moves."""

    def __init__(self, world: Any, wire: Any, file: Path, external: str, **parameters: Any) -> None:
        self.world, self.scenario = world, Scenario.load(file)
        self.dt = self.scenario.dt
        self.node = world.add(
            Simulator,
            scenario=file,
            time="realtime",
            external=external,
            use_sim_time=True,
            **parameters,
        )
        self.wire = wire(self.scenario, self.node.clock)
        self.reports: list[diagnostics.NodeStatus] = world.reports(self.node)
        self._heard = world.hear(MultiDOFJointState, "joint_state", qos.STREAM)
        self._clock = world.publisher(Clock, "/clock", qos.CLOCK)
        self._odom: dict[str, Publisher] = {}

    def set_clock(self, time: float) -> None:
        self._clock.publish(Clock(clock=time_of(EPOCH + time)))
        self.world.until(lambda: abs(1e-9 * self.node.now - EPOCH - time) < 1e-6, "no time arrives")
        self.world.spin(0.02)

    def tell(
        self,
        player: str,
        time: float,
        profile: QoSProfile = qos.SENSOR,
        edit: Callable[[Odometry], None] = lambda message: None,
    ) -> None:
        """Tell where a player is on its circle at a time."""
        if player not in self._odom:
            self._odom[player] = self.world.publisher(Odometry, f"{player}/odom", profile)
        message = odometry.encode(round(1e9 * (EPOCH + time)), circle(time), TWIST, "base_link")
        edit(message)
        self._odom[player].publish(message)
        self.world.spin(0.01)

    def go(self, player: str, time: float) -> None:
        self.tell(player, time)
        self.set_clock(time)

    def add_recorder(self) -> Recorder:
        scenario = self.node.get_parameter("scenario").value
        return self.world.add(Recorder, scenario=scenario, time="realtime")

    @property
    def states(self) -> dict[int, joint_state.JointState]:
        clock, names = self.node.clock, self.scenario.vehicles.joint_names
        decoded = [joint_state.decode(message, names) for message in self._heard]
        of_run = [s for s in decoded if clock.start is not None and s.stamp >= clock.start]
        return {clock.step(state.stamp): state for state in of_run}

    def restarts(self, heard: int, time: float) -> bool:
        """Whether the state with index `heard` is the first of a run after a time."""
        start = stamp.decode(self._heard[heard].header.stamp)
        return start == self.node.clock.start and 0 <= 1e-9 * start - EPOCH - time < 0.15

    def begin(self, *players: str) -> None:
        """Tell of all external players until the first state is published."""
        self.set_clock(0.0)
        for player in players:
            self.tell(player, 0.0)
        self.world.until(lambda: self._heard, "the run does not begin")

    def say(self, what: str) -> Callable[[], bool]:
        return lambda: any(what in report.message for report in self.reports)
