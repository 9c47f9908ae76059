"""The node that controls the robot."""

import atexit
import sys
from collections import Counter
from time import monotonic
from typing import Any

import numpy as np
from geometry_msgs.msg import TwistStamped
from rclpy.duration import Duration
from rclpy.impl.implementation_singleton import rclpy_implementation
from std_msgs.msg import Float64MultiArray
from typing_extensions import override

from gameinfer_ros.games import ROBOT
from gameinfer_ros.nodes.base.follower_node import Observation
from gameinfer_ros.nodes.base.player_node import PlayerNode
from gameinfer_ros.nodes.base.spin import spin
from gameinfer_ros.nodes.robot.commanded_base import CommandedBase
from gameinfer_ros.nodes.robot.freshness import Freshness
from gameinfer_ros.nodes.robot.last_publisher import PATIENCE, last_publisher
from gameinfer_ros.nodes.robot.unhandled_signals import treat_like_ctrl_c
from gameinfer_ros.planning import BRAKES, GOES_ON, LIMITED, OFF, PASSES, SafetyFilter
from gameinfer_ros.solver import Strategy
from gameinfer_ros.system.interruption import interrupts_deferred
from msg_adapters import cmd_vel, diagnostics, multi_array, qos
from msg_adapters import strategy as strategy_message

#: Words for the actions of the safety layer, except passing a plan unchanged.
_ACTIONS = {BRAKES: "brakes", LIMITED: "limits the input", GOES_ON: "does not brake"}

#: Latest time of the last command after a shutdown, in s. `spin` ends the node by force later.
LAST_COMMAND = 7.0


class RobotPlanner(PlayerNode):
    """Controls the robot: evaluates its strategy, brakes if data is missing, and checks each input.

    The strategy arrives on `robot_strategy`, from the planner in the inference node. In lockstep
    the robot waits for the strategy of the same step as the state. In realtime it reacts to each
    state at once, with the newest strategy.

    The robot brakes, within its limits and until it is at rest, if

    - in realtime, states or strategies are missing or stale (`Freshness`),
    - no equilibrium is known, so that the strategy itself brakes (`Belief.equilibrium`), or
    - the safety layer, the last check of each input, replaces the plan (`SafetyFilter`).

    It resumes by itself.

    A base that follows `<robot>/cmd_vel` also slows down, within the limits, when states are
    missing in lockstep, and before the node ends: when it is closed or destroyed, when its context
    is shut down, or when the process ends without having done so. The last command is zero. For
    this, SIGTERM and SIGHUP end the process like Ctrl-C, unless the program handles them.

    Subscribers:
        robot_strategy (std_msgs/Float64MultiArray, `RECENT`)

    Publishers:
        <robot>/cmd_vel (geometry_msgs/TwistStamped, `COMMAND`)
    """

    def __init__(self, name: str = "robot_planner", **node_options: Any) -> None:
        super().__init__(name, **node_options)
        brake_after = self.declare_live(
            "brake_after",
            0.0,
            "in realtime, the robot brakes if the last state that it reacted to is older than "
            "this, in s; 0 for 0.5 s or five time steps, whichever is longer",
            (0.0, 60.0),
        )
        max_strategy_age = self.declare_live(
            "max_strategy_age",
            0.0,
            "in realtime, the robot brakes if the state that its strategy was computed from is "
            "older than this, in s; 0 for 1 s or ten time steps, whichever is longer",
            (0.0, 60.0),
        )
        self._freshness = Freshness(self.game.dt, brake_after, max_strategy_age)
        self._safety = self.declare_live(
            "safety", True, "whether the safety layer is on; a change takes effect at once"
        )
        self._guard = SafetyFilter(self.vehicles, self.scenario.safety)
        self._guard.warm_up()
        self._acted: Counter[str] = Counter()
        self._name = self.players.names[ROBOT]
        self._listeners = 0
        self._cmd_vel = self.advertise(TwistStamped, f"{self._name}/cmd_vel", qos.COMMAND)
        self._strategy: Strategy | None = None
        self._message, self._level = "follows its strategy", diagnostics.OK
        self._waiting: Observation | None = None
        self._published = self._state_time = self._strategy_time = 0.0
        self._base = CommandedBase(self.vehicles, ROBOT, self._send_velocity)
        self._brakes = False
        m, nx = self.players.dynamics[ROBOT].n_inputs, self.players.n_states
        self.subscribe_steps(
            Float64MultiArray,
            "robot_strategy",
            lambda message: strategy_message.decode(message, m, nx),
            self._on_strategy,
            qos.RECENT,  # with a depth of 1, a stray message could replace the newest one
            multi_array.largest(self.game.horizon, m * (1 + nx) + nx),
        )
        self.control(ROBOT)
        self.every(self.game.dt, self._watch)
        self._domain = self.context.get_domain_id()
        self.context.on_shutdown(self._on_shutdown)
        treat_like_ctrl_c()
        atexit.register(self._at_exit)
        self.get_logger().info(f"ready: {self._name} waits for states")

    @override
    def begin(self) -> None:
        self._acted.clear()
        self._waiting = self._strategy = None

    @override
    def on_state(self, observation: Observation) -> None:
        self._waiting, self._published = observation, monotonic() - observation.age
        self._react()
        if self._waiting is not None and not self.lockstep and not self._brakes:
            self.get_logger().info(
                f"no strategy for step {observation.step} yet: the last plan, if any, continues",
                throttle_duration_sec=5.0,
            )

    def _on_strategy(
        self, step: int, decoded: strategy_message.AffineStrategy, waited: float
    ) -> None:
        # The message lacks the state at the end of the horizon, which no input depends on.
        x_ref = np.concatenate([decoded.x_ref, decoded.x_ref[-1:]])
        self._strategy = Strategy(
            step, x_ref[..., None], decoded.u_ref[..., None], decoded.P[..., None]
        )
        if decoded.particle >= 0:
            self._message, self._level = "follows its strategy", diagnostics.OK
        else:
            self._message, self._level = "no equilibrium is known: brakes", diagnostics.WARN
        self._react()

    def _react(self) -> None:
        """React to the waiting state, if there is one and the strategy applies to it."""
        observation, strategy = self._waiting, self._strategy
        if observation is None or strategy is None:
            return
        first, step = strategy.first_step, observation.step
        if step != first if self.lockstep else step < first:
            return
        strategy_time = self._published - (step - first) * self.game.dt
        outdated = self._freshness.complaint(self._published, strategy_time, self._missing)
        if outdated and not self.lockstep:
            s = observation.s[self.vehicles.states(ROBOT)]
            w = self.vehicles.braking_input(ROBOT, s)
            self.publish_control(step, w[None])
            if not self._freshness.complaint(self._published, np.inf, ""):
                self._base.move(s, w)  # otherwise `_watch` slows it down from its last command
            # Braking does not become outdated. The state waits for a newer strategy.
            self._state_time, self._strategy_time = self._published, np.inf
            self._report_braking(outdated)
        elif step < strategy.end:
            self._state_time, self._strategy_time = self._published, strategy_time
            if self.lockstep:  # the strategy is that of the state, however long it took
                self._strategy_time = np.inf
            self._act(strategy, observation)

    def _act(self, strategy: Strategy, observation: Observation) -> None:
        self._waiting = None
        age = observation.step - strategy.first_step
        length = self.plan_length()
        if not self.lockstep:  # later inputs must not start when the data is too old
            length = min(length, self._freshness.inputs(self._state_time, self._strategy_time))
        self.execution.safety = self._guard if self._safety() else None
        plan = self.execution.act(strategy, observation.step, observation.s, length)
        message, level = self._message, self._level if age <= 1 else diagnostics.WARN
        if plan.action not in (OFF, PASSES):
            self._acted[plan.action] += 1
            message = f"the safety layer {_ACTIONS[plan.action]}: {plan.reason}"
            level = diagnostics.WARN
            self.get_logger().warn(message, throttle_duration_sec=1.0)
        self.publish_control(observation.step, plan.inputs)
        self._base.move(plan.states[0], plan.inputs[0])
        if self._brakes:
            self._brakes = False
            self.get_logger().info(f"{self._name} resumes at step {observation.step}")
        own = {
            "step": observation.step,
            "waited_ms": f"{1e3 * observation.waited:.2f}",
            "strategy_age_steps": age,
            "safety": plan.action,
        }
        self._report(message, own, level)

    def _watch(self) -> None:
        """Slow the base down at each time step while data is missing or too old."""
        if not self._base.commanded:
            return
        times = self._state_time, self._strategy_time
        outdated = self._freshness.complaint(*times, self._missing)
        if outdated:
            self._base.brake()
            self._report_braking(outdated)

    @property
    def _missing(self) -> str:
        if self._waiting is None:
            return "joint_state"
        return f"strategy for the state of step {self._waiting.step}"

    def _report_braking(self, reason: str) -> None:
        message = f"brakes: {reason}"
        if not self._brakes:
            self._brakes = True
            self.get_logger().warn(message)
        self._report(message, {}, diagnostics.WARN)

    def _report(self, message: str, figures: dict[str, object], level: bytes) -> None:
        counts = {"safety_braked": self._acted[BRAKES], "safety_limited": self._acted[LIMITED]}
        self.report(message, {**figures, **counts}, level)

    def _send_velocity(self, velocity: np.ndarray) -> None:
        self._cmd_vel.publish(self._command(velocity))
        self._listeners = self._cmd_vel.get_subscription_count()

    def _command(self, velocity: np.ndarray) -> TwistStamped:
        return cmd_vel.encode(self.now, velocity, self._name)

    @override
    def close(self) -> None:
        """Slow the base down, within its limits, and end with a command of zeros."""
        atexit.unregister(self._at_exit)
        try:
            if self.context.ok() and self._base.moving:
                self._base.stop(paced=self._listeners > 0)
                self._cmd_vel.wait_for_all_acked(Duration(seconds=PATIENCE))
        except rclpy_implementation.RCLError:
            if self.context.ok():
                raise
        if not self.context.ok():  # a signal has shut it down, perhaps meanwhile
            self._on_shutdown()

    def _at_exit(self) -> None:
        with interrupts_deferred():  # a second Ctrl-C must not leave the base moving
            self.close()

    @override
    def destroy_node(self) -> None:
        self.close()
        super().destroy_node()

    def _on_shutdown(self) -> None:
        """Slow the base down after the context has been shut down, with another publisher."""
        if self._base.moving and self._listeners:
            publisher = last_publisher(
                self._cmd_vel,
                self._listeners,
                self._domain,
                repeated=lambda: self._command(self._base.velocity),
                discovery=LAST_COMMAND - self._base.stopping_time,
            )
            with publisher as publish:
                self._base.stop(lambda velocity: publish(self._command(velocity)))


if __name__ == "__main__":
    sys.exit(spin(RobotPlanner, sys.argv[1:]))
