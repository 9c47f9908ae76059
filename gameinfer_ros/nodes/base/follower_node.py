"""What the nodes have in common that follow the runs of a simulator."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic
from typing import Any, NamedTuple

import numpy as np
from builtin_interfaces.msg import Time
from rclpy.qos import QoSProfile
from sensor_msgs.msg import MultiDOFJointState

from gameinfer_ros.nodes.base.checked_subscription import LARGEST, CheckedSubscription
from gameinfer_ros.nodes.base.game_node import GameNode
from msg_adapters import MessageError, diagnostics, joint_state, qos, stamp

#: A node that has seen no state for so long, or for so many steps if that is longer, says that it
#: waits, and again and again, in s.
SILENCE, SILENT_STEPS = 1.0, 5


class Observation(NamedTuple):
    """Where the players are, as it was observed.

    Attributes:
        step: the step that it belongs to.
        x: joint state (nx,) in the game.
        s: joint state (ns,) of the vehicles.
        w: joint input (nw,) of the vehicles applied during the step before.
        waited: time between the arrival of the message and its handling, in s.
        age: time between its publication and its handling, in s.
    """

    step: int
    x: np.ndarray
    s: np.ndarray
    w: np.ndarray
    waited: float
    age: float


class FollowerNode(GameNode):
    """A node that follows the runs of a simulator.

    A new start on `run_start` is a new run. Messages whose stamps are before it are of an earlier
    run, and are rejected. Those that belong to no run that is known are kept, as many as the
    profile of the topic keeps, and are handled when the start of their run arrives.

    Subscribers:
        run_start (builtin_interfaces/Time, `LATEST`)

    Args:
        name: name of the node.
        node_options: passed on to `rclpy.node.Node`.
    """

    def __init__(self, name: str, **node_options: Any) -> None:
        super().__init__(name, **node_options)
        self.subscribe(Time, "run_start", self._on_run_start, qos.LATEST, sole=True)

    def on_run(self) -> None:
        """What the node does when a new run starts, before the first state: by default, begin."""
        self.begin()

    def subscribe_steps(
        self,
        message_type: Any,
        topic: str,
        decode: Callable[[Any], Any],
        handle: Callable[[int, Any, float], None],
        profile: QoSProfile,
        largest: int = LARGEST,
    ) -> CheckedSubscription:
        """Subscribe to a topic with one publisher, whose messages belong to steps of a run.

        `decode` returns what a message says, with its `stamp` in ns. `handle` gets the step, what
        `decode` returned, and for how many seconds the message waited. In each run, a message of
        a step that is not later than the last one is stale.
        """
        last_run, last = self.clock.start, -1

        def receive(message: Any, waited: float) -> None:
            nonlocal last_run, last
            content = decode(message)
            step = self.clock.step(content.stamp)
            if last_run == self.clock.start and step <= last:
                raise MessageError(
                    f"stamp: step {step} is stale: step {last} has already been received"
                )
            handle(step, content, waited)
            last_run, last = self.clock.start, step

        return self.subscribe(
            message_type, topic, receive, profile, largest, sole=True, keep=profile.depth
        )

    def subscribe_state(self, handle: Callable[[Observation], None], profile: QoSProfile) -> None:
        """Subscribe to `joint_state`; `handle` gets each state of the present run.

        When none arrives, the node says so. None counts while several nodes publish states.
        """
        vehicles, names = self.vehicles, self.vehicles.joint_names
        last_s, last_run = self.scenario.initial_vehicle_state, self.clock.start
        last_time = started = monotonic()

        def receive(step: int, state: joint_state.JointState, waited: float) -> None:
            nonlocal last_s, last_run, last_time
            if last_run != self.clock.start:
                last_s, last_run = self.scenario.initial_vehicle_state, self.clock.start
            # A pose tells the heading only up to whole turns, but the goals count them.
            s = vehicles.unwrap(vehicles.state(state.poses, state.twists), last_s)
            w = vehicles.input(state.twists, state.accelerations)
            last_s, last_time = s, monotonic()
            handle(Observation(step, vehicles.game_state(s), s, w, waited, states.age))

        def report_silence() -> None:
            if self.clock.start is not None:
                for subscription in self._checked:
                    subscription.report_kept(SILENCE)
            silence = monotonic() - last_time
            if silence > max(SILENCE, SILENT_STEPS * self.game.dt):
                what = "the first joint_state" if last_time == started else "joint_state"
                if self.clock.start is None and states.kept:
                    what = "run_start"
                self.report(f"waits for {what}", {"silent_s": f"{silence:.1f}"}, diagnostics.WARN)

        # A joint has 152 bytes of numbers, and its name.
        largest = 1024 + sum(256 + len(name) for name in names)
        states = self.subscribe_steps(
            MultiDOFJointState,
            "joint_state",
            lambda message: joint_state.decode(message, names),
            receive,
            profile,
            largest,
        )
        self.every(SILENCE, report_silence)

    def _on_run_start(self, message: Time, waited: float) -> None:
        start = stamp.decode(message)
        if start < 0:
            raise MessageError(f"sec: {message.sec} is not allowed: it must be from 0 on")
        if start == self.clock.start:
            return  # the publisher sent it once more
        self.clock.start = start
        self.on_run()
        for subscription in list(self._checked):
            subscription.offer_again()
