"""A robot planner, with a test in the place of the simulator and the inference."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from geometry_msgs.msg import TwistStamped
from sensor_msgs.msg import MultiDOFJointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import MultiDOFJointTrajectory

from gameinfer_ros.nodes.robot_planner import RobotPlanner
from gameinfer_ros.scenario import Scenario
from msg_adapters import cmd_vel, diagnostics, qos, stamp, strategy


class Robot:
    def __init__(
        self,
        world: Any,
        wire: Any,
        scenario: Path,
        namespace: str | None = None,
        state_topic: str = "joint_state",
        cli_args: list[str] | None = None,
        **parameters: Any,
    ) -> None:
        # Strategies of these tests are random, and the machine may be busy.
        parameters = {"safety": False, "brake_after": 60.0, "max_strategy_age": 60.0, **parameters}
        self.world, self.scenario = world, Scenario.load(scenario)
        self.wire, self.game = wire(self.scenario), self.scenario.game
        self.node = world.add(
            RobotPlanner, namespace=namespace, cli_args=cli_args, scenario=scenario, **parameters
        )
        prefix = f"{namespace or ''}/"
        self.reports: list[diagnostics.NodeStatus] = world.reports(self.node)
        state_topic = state_topic if state_topic[0] == "/" else prefix + state_topic
        self._states = world.publisher(MultiDOFJointState, state_topic, qos.STREAM)
        self._run_start = f"{prefix}run_start"
        world.start_run(topic=self._run_start)
        self._strategies = world.publisher(Float64MultiArray, f"{prefix}robot_strategy", qos.LATEST)
        self._controls = world.hear(MultiDOFJointTrajectory, f"{prefix}robot/control", qos.STREAM)
        self._velocities = world.hear(
            TwistStamped, f"{prefix}robot/cmd_vel", qos.queued(qos.COMMAND)
        )

    def start_run(self) -> None:
        self.wire.clock.start += 10 * stamp.SECOND
        self.world.start_run(self.wire.clock.start, self._run_start)

    def show(self, step: int, x: np.ndarray) -> None:
        """Publish a state, and do not wait until it has been handled."""
        self._states.publish(self.wire.state(step, x))

    def see(self, step: int, x: np.ndarray) -> None:
        self.world.send(self._states, self.wire.state(step, x))

    def be_told(self, step: int, horizon: int = 5) -> strategy.AffineStrategy:
        """Send a strategy that starts at a step; returns it."""
        rng, nx = np.random.default_rng(step), self.game.players.n_states
        shapes = (horizon, 2), (horizon, 2, nx), (horizon, nx)
        told = strategy.AffineStrategy(
            self.wire.clock.stamp(step), 0, *(rng.uniform(-1, 1, shape) for shape in shapes)
        )
        self.world.send(self._strategies, strategy.encode(told))
        return told

    def be_told_to(self, step: int, inputs: Any) -> None:
        """Send a strategy that plays inputs (T, 2) from a step on, in any state."""
        self.world.send(self._strategies, self.wire.strategy(step, inputs))

    @property
    def controls(self) -> list[tuple[int, np.ndarray]]:
        """Step and inputs (S, m) of each control message so far."""
        return [self.wire.read_control("robot", message) for message in self._controls]

    @property
    def velocities(self) -> list[np.ndarray]:
        return [cmd_vel.decode(m, "robot") for m in self._velocities]

    def reaction(self, told: strategy.AffineStrategy, step: int, x: np.ndarray) -> np.ndarray:
        """Input (m,) of a strategy in a state."""
        k = step - self.wire.clock.step(told.stamp)
        return told.u_ref[k] - told.P[k] @ (x - told.x_ref[k])

    def wait(self, count: int) -> None:
        """Wait for this many control messages, velocities and reports."""
        heard = (self._controls, self._velocities, self.reports)
        self.world.until(lambda: all(len(messages) >= count for messages in heard))


def some_state(robot: Robot, step: int) -> np.ndarray:
    noise = np.random.default_rng(100 + step).uniform(-0.1, 0.1, robot.game.players.n_states)
    return robot.scenario.initial_state + noise
