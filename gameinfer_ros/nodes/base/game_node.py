"""What all nodes have in common."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock, ClockType
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.timer import Timer
from std_srvs.srv import Trigger

from gameinfer_ros.names.choices import LOCKSTEP, REALTIME
from gameinfer_ros.nodes.base.checked_subscription import LARGEST, CheckedSubscription
from gameinfer_ros.nodes.base.parameter_node import ParameterNode
from gameinfer_ros.nodes.base.sole_subscription import SoleSubscription
from gameinfer_ros.nodes.base.topic_faults import TopicFaults
from gameinfer_ros.runs.run_clock import RunClock
from gameinfer_ros.scenario import Scenario
from msg_adapters import diagnostics, qos


class GameNode(ParameterNode):
    """A node that takes part in a game.

    Parameters:
        scenario (string, read-only): name or file of the scenario.
        time (string, read-only): `lockstep`, where every step waits for all who take part in it,
            or `realtime`, where no one waits for anyone.

    Publishers:
        /diagnostics (diagnostic_msgs/DiagnosticArray, `DIAGNOSTICS`)

    Args:
        name: name of the node.
        node_options: passed on to `rclpy.node.Node`, such as `context`, `namespace` and
            `parameter_overrides`.

    Attributes:
        clock: tells which stamp belongs to which step of the present run.

    Raises:
        ScenarioError: the scenario cannot be used.
        ParameterError: a parameter has a value that is not allowed.
    """

    def __init__(self, name: str, **node_options: Any) -> None:
        super().__init__(name, **node_options)
        self.topic_faults = TopicFaults(self.get_logger())
        self._resets: dict[str, int] = {}  # of each seed since it was set
        scenario = self.declare("scenario", "three_player", "name or file of the scenario")
        self.time = self.declare(
            "time", LOCKSTEP, "who waits for whom at each step", choices=(LOCKSTEP, REALTIME)
        )
        self.scenario = Scenario.load(scenario)
        self.game = self.scenario.game
        self.players, self.vehicles = self.game.players, self.scenario.vehicles
        self.clock = RunClock(self.game.dt)
        self._checked: list[CheckedSubscription] = []
        self._diagnostics = self.advertise(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)

    @property
    def lockstep(self) -> bool:
        """Whether every step waits for all who take part in it."""
        return bool(self.time == LOCKSTEP)

    def declare_seed(
        self, description: str, name: str = "seed"
    ) -> Callable[[], np.random.Generator]:
        """Declare a seed as a parameter; returns a function that makes its generator.

        Each run gets the same generator, until `~/reset` is called or the seed changes.
        """
        seed = self.declare_live(
            name, 0, f"{description}; a change takes effect with the next run", (0, 2**63 - 1)
        )
        if not self._resets:
            self.add_post_set_parameters_callback(self._on_parameters_set)
            self.create_service(Trigger, "~/reset", self._on_reset)
        self._resets[name] = 0

        def generator() -> np.random.Generator:
            key = (self._resets[name],) if self._resets[name] else ()
            return np.random.default_rng(np.random.SeedSequence(seed(), spawn_key=key))

        return generator

    def _on_parameters_set(self, parameters: list[Parameter]) -> None:
        for parameter in parameters:
            if parameter.name in self._resets:
                self._resets[parameter.name] = 0

    def _on_reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        for name in self._resets:
            self._resets[name] += 1
        self.begin()
        response.success = True
        response.message = "begins anew with the next state, with seeds not drawn before"
        self.get_logger().info(f"reset: {response.message}")
        return response

    def begin(self) -> None:
        """Forget what happened so far: the next state is the first one that counts."""

    def advertise(
        self,
        message_type: Any,
        topic: str,
        profile: QoSProfile,
        on_match: Callable[[Any], None] | None = None,
    ) -> Publisher:
        """A publisher; a subscriber that it cannot serve is reported.

        `on_match` is called whenever a subscriber has come or gone.
        """
        callbacks = PublisherEventCallbacks(
            incompatible_qos=partial(self.topic_faults.incompatible, topic, "subscriber"),
            matched=on_match,
        )
        return self.create_publisher(message_type, topic, profile, event_callbacks=callbacks)

    def subscribe(
        self,
        message_type: Any,
        topic: str,
        handle: Callable[[Any, float], None],
        profile: QoSProfile,
        largest: int = LARGEST,
        sole: bool = False,
        keep: int = 0,
    ) -> CheckedSubscription:
        """Subscribe to a topic; a message that cannot be used is reported and then forgotten.

        `handle` gets each message, and for how many seconds it waited to be handled. One of more
        than `largest` bytes is not read. What can move somebody has a `sole` publisher: while
        there are several, nothing counts. `keep` is the number of messages to keep that arrive
        before the start of their run.
        """
        make = SoleSubscription if sole else CheckedSubscription
        faults = self.topic_faults
        subscription = make(self, message_type, topic, handle, profile, faults, largest, keep)
        self._checked.append(subscription)
        return subscription

    def unsubscribe(self, subscription: CheckedSubscription) -> None:
        """End a subscription."""
        self._checked.remove(subscription)
        subscription.destroy()

    def every(self, seconds: float, call: Callable[[], None]) -> Timer:
        """A timer that does not depend on simulated time."""
        return self.create_timer(seconds, call, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def report(
        self, message: str, values: Mapping[str, object], level: bytes = diagnostics.OK
    ) -> None:
        """Publish how the node is doing; what it says of a step names the run of that step."""
        figures = {key: str(value) for key, value in values.items()}
        if "step" in figures:
            figures["run"] = self.clock.run
        figures |= self.topic_faults.figures()
        status = diagnostics.NodeStatus(self.get_fully_qualified_name(), message, figures, level)
        self._diagnostics.publish(diagnostics.encode(status, self.get_clock().now().nanoseconds))
