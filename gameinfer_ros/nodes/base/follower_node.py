"""Base class of the nodes that follow the runs of a simulator."""

from collections.abc import Callable
from time import monotonic
from typing import Any, NamedTuple

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import QoSProfile
from sensor_msgs.msg import MultiDOFJointState
from std_msgs.msg import Float64MultiArray

from gameinfer_ros.inference import MOST_PARTICLES
from gameinfer_ros.nodes.base.checked_subscription import LARGEST, CheckedSubscription
from gameinfer_ros.nodes.base.game_node import GameNode
from gameinfer_ros.nodes.base.run_statuses import RunStatuses
from msg_adapters import MessageError, belief, diagnostics, joint_state, multi_array, qos, stamp

#: A node reports that it waits if no state has arrived for `SILENCE`, in s, or `SILENT_STEPS` time
#: steps, whichever is longer. It repeats the report every `SILENCE`.
SILENCE, SILENT_STEPS = 1.0, 5


class Observation(NamedTuple):
    """An observed state of all players."""

    step: int
    x: np.ndarray  # joint state (nx,) of the game
    s: np.ndarray  # joint state (ns,) of the vehicles
    w: np.ndarray  # joint input (nw,) of the vehicles, applied during the previous step
    waited: float  # time between the arrival of the message and its handling, in s
    age: float  # time between the publication of the message and its handling, in s


class FollowerNode(GameNode):
    """A node that follows the runs of a simulator.

    A new start on `run_start` is a new run. Messages with earlier stamps belong to an earlier run
    and are rejected. Messages of an unknown run are kept, up to the depth of the topic's profile,
    and handled when the start of their run arrives.

    Subscribers:
        run_start (builtin_interfaces/Time, `LATEST`)
    """

    def __init__(self, name: str, **node_options: Any) -> None:
        super().__init__(name, **node_options)
        self._last_step: dict[str, int] = {}  # of the present run, by topic
        self._last_s = self.scenario.initial_vehicle_state
        self.subscribe(Time, "run_start", self._on_run_start, qos.LATEST, sole=True)

    def on_run(self) -> None:
        """Called when a new run starts, before its first state. Calls `begin` by default."""
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

        A message is rejected as stale if its step is not later than that of the last message of
        the run.

        Args:
            message_type: type of the messages.
            topic: name of the topic.
            decode: converts a message to an object with the attribute `stamp`, in ns.
            handle: callback. It gets the step, the decoded message, and the time the message
                waited to be handled, in s.
            profile: quality of service.
            largest: largest size of a message, in bytes.
        """

        def receive(message: Any, waited: float) -> None:
            content = decode(message)
            step, last = self.clock.step(content.stamp), self._last_step.get(topic, -1)
            if step <= last:
                raise MessageError(
                    f"stamp: step {step} is stale: step {last} has already been received"
                )
            handle(step, content, waited)
            self._last_step[topic] = step

        return self.subscribe(message_type, topic, receive, profile, largest, sole=True, keep=True)

    def subscribe_state(self, handle: Callable[[Observation], None], profile: QoSProfile) -> None:
        """Subscribe to `joint_state`; `handle` gets each state of the present run.

        The node reports when no state arrives. States are ignored while several nodes publish them.
        """
        vehicles, names = self.vehicles, self.vehicles.joint_names
        last_time = started = monotonic()

        def receive(step: int, state: joint_state.JointState, waited: float) -> None:
            nonlocal last_time
            # A pose gives the heading only up to full turns, but the goals depend on them.
            s = vehicles.unwrap(vehicles.state(state.poses, state.twists), self._last_s)
            w = vehicles.input(state.twists, state.accelerations)
            self._last_s, last_time = s, monotonic()
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

        # A joint takes 152 bytes of numbers, and its name.
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

    def subscribe_belief(self, handle: Callable[[int, belief.BeliefSummary, float], None]) -> None:
        """Subscribe to `belief`; for `handle`, see `subscribe_steps`."""
        players = len(self.players)
        self.subscribe_steps(
            Float64MultiArray,
            "belief",
            lambda message: belief.decode(message, players),
            handle,
            qos.STREAM,
            multi_array.largest(MOST_PARTICLES, 3 + players),
        )

    def subscribe_statuses(
        self,
        handle: Callable[[diagnostics.NodeStatus], None],
        profile: QoSProfile,
        shared: bool = False,
    ) -> None:
        """Subscribe to the statuses that `RunStatuses` selects from `/diagnostics`."""
        statuses = RunStatuses(self.get_namespace(), self.clock)

        def receive(message: DiagnosticArray, waited: float) -> None:
            for status in statuses.of(message):
                handle(status)

        self.subscribe(DiagnosticArray, "/diagnostics", receive, profile, keep=True, shared=shared)

    def _on_run_start(self, message: Time, waited: float) -> None:
        start = stamp.decode(message)
        if start < 0:
            raise MessageError(f"sec: {message.sec} is not allowed: it must not be negative")
        if start == self.clock.start:
            return  # the publisher sent it again
        self.clock.start = start
        self._last_step.clear()
        self._last_s = self.scenario.initial_vehicle_state
        self.on_run()
        for subscription in list(self._checked):
            subscription.offer_again()
