"""What the robot does, and what it does it for, as anybody could see it."""

from __future__ import annotations

import time
from collections import defaultdict
from typing import Any, NamedTuple

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from promise import STATE_AGE, STRATEGY_AGE, promise
from rclpy.node import Node
from trajectory_msgs.msg import MultiDOFJointTrajectory

from gameinfer_ros.games import ROBOT
from gameinfer_ros.scenario import Scenario
from msg_adapters import control, diagnostics, odometry, qos

#: Slower than this, in m/s, is a standstill.
STANDS = 0.01

#: Inputs that differ by no more than this do so by rounding only.
_ROUNDING = 1e-6


class Seen(NamedTuple):
    """Where the robot was at a step.

    Attributes:
        time: when that was heard, by `time.monotonic`, in s.
        step: the step.
        speed: in m/s.
        omega: its turning rate during the step before, in rad/s.
    """

    time: float
    step: int
    speed: float
    omega: float


class Witness(Node):
    """Hears odometry, inputs, velocities and figures of a robot that is a unicycle.

    The states themselves it does not hear, because the simulator counts those who do.

    Args:
        scenario: what is played.
        node_options: passed on to `rclpy.node.Node`.

    Attributes:
        seen: what was seen of the robot, in order of arrival.
        plans: inputs (S, 2) of each message of the planner, by its step.
        strategy_ages: how old the strategy was that the planner followed at each step, in steps.
        commands: when each velocity was sent to the base, and its speed in m/s.
    """

    def __init__(self, scenario: Scenario, **node_options: Any) -> None:
        super().__init__("witness", **node_options)
        self.scenario, self._joints = scenario, scenario.vehicles.joints_of(ROBOT)
        self.seen: list[Seen] = []
        self.plans: defaultdict[int, list[np.ndarray]] = defaultdict(list)
        self.strategy_ages: dict[int, int] = {}
        self.commands: list[tuple[float, float]] = []
        for kind, topic, handle, profile in (
            (Odometry, "robot/odom", self._on_odom, qos.RECENT),
            (MultiDOFJointTrajectory, "robot/control", self._on_control, qos.LATEST),
            (TwistStamped, "robot/cmd_vel", self._on_command, qos.COMMAND),
            (DiagnosticArray, "/diagnostics", self._on_diagnostics, qos.DIAGNOSTICS),
        ):
            self.create_subscription(kind, topic, handle, qos.queued(profile))

    def _on_odom(self, message: Odometry) -> None:
        stamp, _, twist = odometry.decode(message)
        step = round(stamp / self.scenario.dt)
        self.seen.append(Seen(time.monotonic(), step, float(twist[0]), float(twist[2])))

    def _on_control(self, message: MultiDOFJointTrajectory) -> None:
        plan = control.decode(message, self._joints, self.scenario.dt)
        vehicle = self.scenario.vehicles.dynamics[ROBOT]
        self.plans[plan.step].append(vehicle.input(plan.twists, plan.accelerations))

    def _on_command(self, message: TwistStamped) -> None:
        self.commands.append((time.monotonic(), abs(message.twist.linear.x)))

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in diagnostics.decode(message):
            age = diagnostics.whole_number(status, "strategy_age_steps")
            step = diagnostics.whole_number(status, "step")
            if status.name == "/robot_planner" and age is not None and step is not None:
                self.strategy_ages[step] = age

    # --- What it tells --------------------------------------------------------------------------

    def publishers(self, topic: str) -> list[str]:
        """Names and gids of those who are said to publish a topic just now."""
        found = self.get_publishers_info_by_topic(topic)
        return [f"{p.node_name} {bytes(p.endpoint_gid).hex()}" for p in found]

    def speeds(self, begin: float, end: float) -> np.ndarray:
        """Speeds (S,), in m/s, of all steps that were heard of between two times, in s."""
        return np.abs([s.speed for s in list(self.seen) if begin < s.time <= end])

    def stood_after(self, begin: float, end: float, bound: int) -> dict[str, float]:
        """Steps after which the robot stood, from a loss on until what was lost came back.

        Nothing if less time passed than it may take.
        """
        moving = np.flatnonzero(self.speeds(begin, end) > STANDS)
        if len(self.speeds(begin, end)) <= bound:
            return {}
        after = int(moving.max(initial=-1)) + 1
        promise(after <= bound, f"the robot stands after {after} steps, and not {bound}")
        return {"brake_steps": float(after)}

    def check(self) -> dict[str, float]:
        """Check what every input came from, and that the robot can do it; tells the worst."""
        scenario = self.scenario
        vehicles, own = scenario.vehicles, scenario.vehicles.inputs(ROBOT)
        oldest_state = oldest_strategy = 0
        for before, after in zip(self.seen, self.seen[1:], strict=False):
            if after.step != before.step + 1:
                continue  # time has jumped, or begins anew
            w = np.array([after.omega, (after.speed - before.speed) / scenario.dt])
            where = f"the input {w.tolist()} of step {before.step}"
            low, high = vehicles.low[own] - _ROUNDING, vehicles.high[own] + _ROUNDING
            promise((low <= w).all() and (w <= high).all(), f"{where} is beyond its limits")
            s = np.array([0.0, 0.0, 0.0, before.speed])
            if np.allclose(w, vehicles.braking_input(ROBOT, s), rtol=0.0, atol=_ROUNDING):
                continue
            ages = self._ages(before.step, w)
            promise(ages, f"{where} comes from no plan")
            state, strategy = min(ages)
            promise(state <= STATE_AGE, f"{where} comes from a state of {state} steps before")
            promise(strategy <= STRATEGY_AGE, f"{where} comes from a strategy {strategy} steps old")
            oldest_state = max(oldest_state, state)
            oldest_strategy = max(oldest_strategy, strategy)
        return {"oldest_state_steps": oldest_state, "oldest_strategy_steps": oldest_strategy}

    def _ages(self, step: int, w: np.ndarray) -> list[tuple[int, int]]:
        """How old state and strategy were, in steps, of each plan with this input for a step."""
        return [
            (k, k + self.strategy_ages.get(step - k, 0))
            for k in range(control.LONGEST)
            for plan in self.plans.get(step - k, [])
            if k < len(plan) and np.allclose(plan[k], w, rtol=0.0, atol=_ROUNDING)
        ]
