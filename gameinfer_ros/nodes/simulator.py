"""The world: moves all players and tells everybody where they are."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np
from nav_msgs.msg import Odometry
from rclpy.clock import Clock, ClockType
from rclpy.timer import Timer
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import MultiDOFJointState
from trajectory_msgs.msg import MultiDOFJointTrajectory

from gameinfer_ros.nodes.game_node import GameNode
from gameinfer_ros.nodes.spin import spin
from msg_adapters import MessageError, clock, control, diagnostics, joint_state, odometry, qos


class Simulator(GameNode):
    """Simulates the vehicles of all players on the grid of time steps.

    It publishes the state of step 0, once there are enough subscribers, and waits until each
    player has sent an input for it. From then on, in lockstep, it goes on to the next step
    whenever all inputs for the present one have arrived. In realtime it goes on when the time of
    the step is over: a player whose input has not come is late, its last plan bridges the gap,
    and when that ends the player brakes.

    Parameters, in addition to those of `GameNode`:
        steps (integer, read-only): steps to simulate; 0 for as many as the scenario says.
        subscribers (integer, read-only): subscribers of joint_state to wait for at the start.
        publish_clock (boolean, read-only): whether to publish the simulated time on /clock.

    Subscribers:
        <player>/control (trajectory_msgs/MultiDOFJointTrajectory, `LATEST`): one for each player.

    Publishers:
        joint_state (sensor_msgs/MultiDOFJointState, `STREAM`)
        <player>/odom (nav_msgs/Odometry, `LATEST`): one for each player, if there is a subscriber.
        /clock (rosgraph_msgs/Clock, `CLOCK`): if asked for.
    """

    def __init__(self, name: str = "simulator", **node_options: Any) -> None:
        super().__init__(name, **node_options)
        steps = self.declare("steps", 0, "steps to simulate; 0: as the scenario says", (0, 10**9))
        self.steps = steps or self.scenario.steps
        self._subscribers = self.declare(
            "subscribers",
            0,
            "joint_state subscribers to wait for before the first state",
            (0, 1000),
        )
        publish_clock = self.declare("publish_clock", False, "publish simulated time on /clock")
        self.step = 0
        self._s = self.scenario.initial_vehicle_state
        self._w = np.zeros(self.vehicles.n_inputs)
        self._controls: dict[int, control.Control] = {}
        self._latency_ms: dict[int, float] = {}
        self._late: Counter[int] = Counter()
        self._late_steps = 0
        self.vehicles.step(self._s, self._w)  # loads the kernels before time matters

        self._joint_state = self.create_publisher(MultiDOFJointState, "joint_state", qos.STREAM)
        self._odom = [
            self.create_publisher(Odometry, f"{name}/odom", qos.LATEST)
            for name in self.players.names
        ]
        self._clock_publisher = None
        if publish_clock:
            self._clock_publisher = self.create_publisher(ClockMessage, "/clock", qos.CLOCK)
        for i, name in enumerate(self.players.names):
            self.subscribe(
                MultiDOFJointTrajectory,
                f"{name}/control",
                partial(self._on_control, i),
                qos.LATEST,
            )
        self._published: float | None = None
        self._timer = self._every(0.02, self._start)
        self.get_logger().info(
            f"ready: waits for the first controls of {', '.join(self.players.names)}"
        )

    @property
    def done(self) -> bool:
        """Whether all steps have been simulated."""
        return bool(self.step >= self.steps)

    def _every(self, seconds: float, call: Callable[[], None]) -> Timer:
        # The simulator makes the simulated time, so its own timers must not depend on it.
        return self.create_timer(seconds, call, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _start(self) -> None:
        """Publish the first state once all who are to see it are there."""
        if self._joint_state.get_subscription_count() >= self._subscribers:
            self._timer.cancel()
            self._publish_state()

    def _on_control(self, player: int, message: MultiDOFJointTrajectory, waited: float) -> None:
        received = control.decode(message, self.vehicles.joints_of(player), self.game.dt)
        if self._published is None:
            raise MessageError(f"stamp: step {received.step}: the simulation has not started")
        if received.step > self.step:
            raise MessageError(
                f"stamp: step {received.step} is not allowed: the simulation is at {self.step}"
            )
        last = self._controls.get(player)
        if last is not None and received.step < last.step:
            raise MessageError(
                f"stamp: step {received.step} is stale: step {last.step} has been received"
            )
        self._controls[player] = received
        if received.step == self.step:
            self._latency_ms[player] = 1e3 * (perf_counter() - self._published)
        everyone = all(
            i in self._controls and self._controls[i].step == self.step
            for i in range(len(self.players))
        )
        if not everyone or self.done:
            return
        if self.lockstep:
            self._advance()
        elif self.step == 0 and self._timer.is_canceled():
            self.get_logger().info("all players are there: time starts")
            self._timer = self._every(self.game.dt, self._advance)

    def _advance(self) -> None:
        late = [i for i, c in self._controls.items() if c.step != self.step]
        self._late.update(late)
        self._late_steps += bool(late)
        self._w = np.concatenate([self._input(i) for i in range(len(self.players))])
        self._s = self.vehicles.step(self._s, self._w)
        self._report(late)
        self.step += 1
        self._publish_state()
        if self.done:
            self.get_logger().info(f"done: {self.steps} steps, {self._late_steps} of them late")
            self._timer.cancel()

    def _input(self, player: int) -> np.ndarray:
        """The input that a player applies now: the newest one, the last plan, or the brake."""
        vehicle, plan = self.vehicles.dynamics[player], self._controls[player]
        k = self.step - plan.step
        if k < len(plan.twists):
            return vehicle.input(plan.twists[k], plan.accelerations[k])
        return vehicle.braking_input(self._s[self.vehicles.states(player)], self.game.dt)

    def _publish_state(self) -> None:
        state = joint_state.JointState(
            self.step,
            self.vehicles.poses(self._s),
            self.vehicles.twists(self._s, self._w),
            self.vehicles.accelerations(self._w),
        )
        names, dt = self.vehicles.joint_names, self.game.dt
        if self._clock_publisher is not None:
            self._clock_publisher.publish(clock.encode(self.step, dt))
        self._published = perf_counter()
        self._joint_state.publish(joint_state.encode(state, names, dt))
        for i, publisher in enumerate(self._odom):
            if publisher.get_subscription_count():
                publisher.publish(
                    odometry.encode(self.step, state.poses[i], state.twists[i], names[i], dt)
                )

    def _report(self, late: list[int]) -> None:
        names = self.players.names
        figures: dict[str, object] = {"step": self.step, "late_steps": self._late_steps}
        for i, name in enumerate(names):
            figures[f"{name}/late_steps"] = self._late[i]
            if i not in late and i in self._latency_ms:
                figures[f"{name}/latency_ms"] = f"{self._latency_ms[i]:.2f}"
        self.report(
            f"late: {', '.join(names[i] for i in late)}" if late else "all controls in time",
            figures,
            diagnostics.WARN if late else diagnostics.OK,
        )


def main(args: list[str] | None = None) -> int:
    """Run the node until it is shut down."""
    return spin(Simulator, args)


if __name__ == "__main__":
    sys.exit(main())
