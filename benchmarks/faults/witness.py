"""A node that observes the robot through its topics."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from threading import Thread
from typing import Any

import rclpy
from account import Account, Plan, Report, Seen
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import MultiDOFJointTrajectory

from gameinfer_ros.games import ROBOT
from gameinfer_ros.runs.run_clock import RunClock
from gameinfer_ros.scenario import Scenario
from msg_adapters import MessageError, control, diagnostics, odometry, qos, stamp

#: Gets the number of a run and a step of it.
Handle = Callable[[int, int], None]


class Witness(Node):
    """Receives odometry, inputs, velocities and reports of a robot that is a unicycle.

    It does not subscribe to the states, because the simulator counts their subscribers. It ignores
    inputs of other nodes than the planner: they have numbers of their own.

    Attributes:
        account: what it has heard so far.
    """

    def __init__(self, scenario: Scenario, **node_options: Any) -> None:
        super().__init__("witness", **node_options)
        self._scenario, self._joints = scenario, scenario.vehicles.joints_of(ROBOT)
        self.account = Account(scenario.vehicles)
        self._newest: dict[str, int] = {}  # number of the newest message of each topic
        self._clocks: list[RunClock] = []
        self._early: list[Callable[[], None]] = []
        for kind, topic, handle, profile in (
            (Time, "run_start", self._on_start, qos.LATEST),
            (Odometry, "robot/odom", self._on_odom, qos.RECENT),
            (MultiDOFJointTrajectory, "robot/control", self._on_control, qos.LATEST),
            (TwistStamped, "robot/cmd_vel", self._on_command, qos.COMMAND),
            (DiagnosticArray, "/diagnostics", self._on_diagnostics, qos.DIAGNOSTICS),
        ):
            self.create_subscription(kind, topic, handle, qos.queued(profile))

    def _on_start(self, message: Time) -> None:
        clock = RunClock(self._scenario.dt)
        clock.start = stamp.decode(message)
        self._clocks.append(clock)
        early, self._early = self._early, []
        for place in early:
            place()

    def _missed(self, topic: str, info: Mapping[str, int]) -> int:
        """Return the number of missed messages of a publisher before this one."""
        number, newest = info["publication_sequence_number"], self._newest.get(topic, 0)
        self._newest[topic] = number
        return number - 1 - (newest if number > newest else 0)  # a new publisher counts from 1

    def _place(self, time: int, handle: Handle) -> None:
        """Call with the run and the step of a stamp, in ns, once the start of its run is known."""
        for run, clock in enumerate(self._clocks):
            with suppress(MessageError):
                handle(run, clock.step(time))
                return
        self._early.append(partial(self._place, time, handle))

    def _on_odom(self, message: Odometry) -> None:
        heard, (sent, _, twist) = time.monotonic(), odometry.decode(message)
        speed, _, omega = twist.tolist()
        seen = self.account.seen
        self._place(sent, lambda run, step: seen.append(Seen(heard, step, speed, omega, run)))

    def _on_control(self, message: MultiDOFJointTrajectory, info: Mapping[str, int]) -> None:
        if message.header.frame_id != self._joints[0]:
            return
        plan, account = control.decode(message, self._joints), self.account
        inputs = account.vehicles.dynamics[ROBOT].input(plan.twists, plan.accelerations)
        lacking = self._missed("control", info)

        def add(run: int, step: int) -> None:
            if lacking:
                newest = account.plans[-1] if account.plans else None
                # Of a new run, all from its beginning on.
                first = newest.step if newest is not None and newest.run == run else 0
                account.unheard.update(range(first, step + 1))
            account.plans.append(Plan(step, inputs, run))

        self._place(plan.stamp, add)

    def _on_command(self, message: TwistStamped) -> None:
        self.account.commands.append((time.monotonic(), abs(message.twist.linear.x)))

    def _on_diagnostics(self, message: DiagnosticArray, info: Mapping[str, int]) -> None:
        for status in diagnostics.decode(message):
            if status.name != "/robot_planner":
                continue
            self.account.lost_reports += self._missed("reports", info)
            age = diagnostics.whole_number(status, "strategy_age_steps")
            step = diagnostics.whole_number(status, "step")
            if age is not None and step is not None:
                self._add_report(status.values["run"], step, age)

    def _add_report(self, name: str, step: int, age: int) -> None:
        for run, clock in enumerate(self._clocks):
            if clock.run == name:
                self.account.reports.append(Report(step, age, run))
                return
        self._early.append(partial(self._add_report, name, step, age))

    def hear_beliefs(self) -> list[float]:
        """Receive beliefs from now on; return their times, by `time.monotonic`, in s."""
        times: list[float] = []
        self.create_subscription(
            Float64MultiArray,
            "belief",
            lambda _: times.append(time.monotonic()),
            qos.queued(qos.STREAM),
            raw=True,
        )
        return times

    def hear_plans(self, player: int) -> list[int]:
        """Receive inputs of another player from now on; return the step of each message."""
        steps: list[int] = []
        names = self._scenario.vehicles.joints_of(player)
        self.create_subscription(
            MultiDOFJointTrajectory,
            f"{self._scenario.game.players.names[player]}/control",
            lambda message: self._place(
                control.decode(message, names).stamp, lambda run, step: steps.append(step)
            ),
            qos.queued(qos.LATEST),
        )
        return steps


class Bystander:
    """Runs a node in a thread of its own, which continues while a trial waits for something."""

    def __init__(self, domain: int, make: Callable[..., Node]) -> None:
        self._context = rclpy.Context()
        handlers = SignalHandlerOptions.NO
        rclpy.init(context=self._context, domain_id=domain, signal_handler_options=handlers)
        self.node: Any = make(context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._ends = False
        self._failure: Exception | None = None
        self._thread = Thread(target=self._spin, daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        try:
            while not self._ends:
                self._executor.spin_once(timeout_sec=0.05)
        except Exception as error:  # whatever it is, nothing was heard from then on
            self._failure = error

    def end(self) -> None:
        """Stop the node once, or raise the exception that ended it."""
        if not self._ends:
            self._ends = True
            self._thread.join()
            self.node.destroy_node()
            self._context.try_shutdown()
            if self._failure is not None:
                raise self._failure
