"""Makes and reads the messages of a scenario."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from sensor_msgs.msg import MultiDOFJointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import MultiDOFJointTrajectory

from gameinfer_ros.runs.run_clock import RunClock
from gameinfer_ros.scenario import Scenario
from msg_adapters import belief, control, joint_state, strategy

#: When runs of tests start, in ns.
START = 1_764_514_512_123_456_789


class Wire:
    """Makes and reads the messages of a run, which starts at `START` unless it has a clock."""

    def __init__(self, scenario: Scenario, clock: RunClock | None = None) -> None:
        self.vehicles, self.dt = scenario.vehicles, scenario.dt
        self.clock = clock or RunClock(self.dt)
        if clock is None:
            self.clock.start = START

    def state(self, step: int, s: Any, w: Any = None) -> MultiDOFJointState:
        """The message with the vehicles' joint state `s` (ns,) after the joint input `w` (nw,)."""
        vehicles = self.vehicles
        s, w = np.asarray(s, float), np.asarray(np.zeros(vehicles.n_inputs) if w is None else w)
        state = joint_state.JointState(
            self.clock.stamp(step),
            vehicles.poses(s),
            vehicles.twists(s, w),
            vehicles.accelerations(w),
        )
        return joint_state.encode(state, vehicles.joint_names)

    def read_state(self, message: MultiDOFJointState) -> np.ndarray:
        """The vehicles' joint state (ns,) that a message holds, with headings in (-pi, pi]."""
        decoded = joint_state.decode(message, self.vehicles.joint_names)
        return self.vehicles.state(decoded.poses, decoded.twists)

    def control(self, player: str, step: int, inputs: Any) -> MultiDOFJointTrajectory:
        """The message with the inputs (S, m) of a player's vehicle."""
        i = self.vehicles.index(player)
        vehicle = self.vehicles.dynamics[i]
        inputs = np.atleast_2d(np.asarray(inputs, dtype=float))
        at_rest = np.zeros((len(inputs), vehicle.n_states))
        message = control.Control(
            self.clock.stamp(step), vehicle.twists(at_rest, inputs), vehicle.accelerations(inputs)
        )
        return control.encode(message, self.vehicles.joints_of(i), self.dt)

    def read_control(self, player: str, message: MultiDOFJointTrajectory) -> tuple[int, np.ndarray]:
        """Step and inputs (S, m) of a message for a player's vehicle."""
        i = self.vehicles.index(player)
        vehicle = self.vehicles.dynamics[i]
        decoded = control.decode(message, self.vehicles.joints_of(i))
        step = self.clock.step(decoded.stamp)
        return step, vehicle.input(decoded.twists, decoded.accelerations)

    def strategy(self, step: int, u: Any) -> Float64MultiArray:
        """The message with a strategy that plays the inputs `u` (T, m) in any state."""
        u, nx = np.asarray(u, dtype=float), self.vehicles.game.players.n_states
        T, m = u.shape
        return strategy.encode(
            strategy.AffineStrategy(
                self.clock.stamp(step), 0, u, np.zeros((T, m, nx)), np.zeros((T, nx))
            )
        )

    def belief(self, step: int) -> Float64MultiArray:
        """The message with a belief of three particles that are equally probable."""
        ones, players = np.ones(3), len(self.vehicles)
        return belief.encode(
            belief.BeliefSummary(
                self.clock.stamp(step), 0, np.arange(3), ones / 3, ones > 0, np.ones((3, players))
            )
        )


@pytest.fixture(scope="session")
def wire() -> type[Wire]:
    return Wire
