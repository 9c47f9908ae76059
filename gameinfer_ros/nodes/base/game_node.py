"""Base class of the nodes of a game."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock, ClockType
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.timer import Timer
from std_srvs.srv import Trigger

# A signal must not interrupt this import later; see `gameinfer_ros.system.load`.
from gameinfer_ros.games import evaluation as _evaluation  # noqa: F401
from gameinfer_ros.names.choices import LOCKSTEP, REALTIME
from gameinfer_ros.nodes.base.checked_subscription import LARGEST, CheckedSubscription
from gameinfer_ros.nodes.base.parameter_node import ParameterNode
from gameinfer_ros.nodes.base.sole_subscription import SoleSubscription
from gameinfer_ros.nodes.base.topic_faults import TopicFaults
from gameinfer_ros.nodes.base.unused_arguments import check_effect_on
from gameinfer_ros.nodes.interface import NodeInterface
from gameinfer_ros.nodes.table import kind_of
from gameinfer_ros.runs.run_clock import RunClock
from gameinfer_ros.scenario import Scenario
from msg_adapters import diagnostics, qos


class GameNode(ParameterNode):
    """A node that takes part in a game.

    Publishers:
        /diagnostics (diagnostic_msgs/DiagnosticArray, `DIAGNOSTICS`)

    Args:
        name: name of the node.
        for_ros: the words after `--ros-args` to check; by default, none.
        node_options: passed to `rclpy.node.Node`, such as `context`, `namespace` and
            `parameter_overrides`.

    Attributes:
        own: name of the player that the node plays, if it is a parameter; otherwise empty.
        lockstep: whether each step waits for the inputs of all players.
        clock: converts between stamps and steps of the present run.
        topic_faults: rejected messages and incompatible peers so far.

    Raises:
        ScenarioError: the scenario is invalid.
        ParameterError: the value of a parameter is invalid.
        RosArgsError: a word after `--ros-args` is invalid.
    """

    def __init__(self, name: str, for_ros: Sequence[str] = (), **node_options: Any) -> None:
        super().__init__(name, **node_options)
        self.topic_faults = TopicFaults(self.get_logger())
        self._resets: dict[str, int] = {}  # number of resets since each seed was set
        scenario = self.declare("scenario", "three_player", "name or file of the scenario")
        time = self.declare(
            "time",
            LOCKSTEP,
            "`lockstep`: each step waits for the inputs of all players; `realtime`: steps follow "
            "the clock",
            choices=(LOCKSTEP, REALTIME),
        )
        self.lockstep = time == LOCKSTEP
        self.scenario = Scenario.load(scenario)
        for warning in self.scenario.warnings:
            self.get_logger().warn(f"{scenario}: {warning}")
        self.game = self.scenario.game
        self.players, self.vehicles = self.game.players, self.scenario.vehicles
        self.own = self.declare_own()
        self._check_arguments(for_ros)
        self.clock = RunClock(self.game.dt)
        self._checked: list[CheckedSubscription] = []
        self._diagnostics = self.advertise(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)

    def declare_seed(
        self, description: str, name: str = "seed"
    ) -> Callable[[], np.random.Generator]:
        """Declare a seed as a parameter, and offer the service `~/reset`.

        Returns:
            A function that creates a random generator. All its generators are in the same state
            until `~/reset` is called or the seed changes.
        """
        if not self._resets:
            self.create_service(Trigger, "~/reset", self._on_reset)
        self._resets[name] = 0
        seed = self.declare_live(
            name,
            0,
            f"{description}; a change takes effect with the next run",
            (0, 2**63 - 1),
            on_set=lambda: self._resets.update({name: 0}),
        )

        def generator() -> np.random.Generator:
            key = (self._resets[name],) if self._resets[name] else ()
            return np.random.default_rng(np.random.SeedSequence(seed(), spawn_key=key))

        return generator

    def _on_reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        for name in self._resets:
            self._resets[name] += 1
        self.begin()
        response.success = True
        response.message = "restarts with new seeds at the next state"
        self.get_logger().info(f"reset: {response.message}")
        return response

    def declare_own(self) -> str:
        """Declare the player that the node plays, if it is a parameter, and return its name."""
        return ""

    def _check_arguments(self, for_ros: Sequence[str]) -> None:
        kind = kind_of(self)
        if kind is None:
            return
        name, namespace = self.get_name(), self.get_namespace()
        interface = NodeInterface(kind, name, namespace, self.players.names, self.own)
        for remark in check_effect_on(for_ros, interface):
            self.get_logger().info(remark)

    def begin(self) -> None:
        """Discard everything observed so far. The next state counts as the first one."""

    def advertise(
        self,
        message_type: Any,
        topic: str,
        profile: QoSProfile,
        on_match: Callable[[Any], None] | None = None,
    ) -> Publisher:
        """Create a publisher that reports subscribers with an incompatible quality of service.

        `on_match` is called with an event whenever a subscriber appears or disappears.
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
        keep: bool = False,
        shared: bool = False,
    ) -> CheckedSubscription:
        """Subscribe to a topic, with the arguments of `CheckedSubscription`.

        If `sole`, all messages are ignored while the topic has several publishers, as needed for
        messages that can move a player.
        """
        make = SoleSubscription if sole else CheckedSubscription
        subscription = make(
            self, message_type, topic, handle, profile, self.topic_faults, largest, keep, shared
        )
        self._checked.append(subscription)
        return subscription

    def unsubscribe(self, subscription: CheckedSubscription) -> None:
        """End a subscription."""
        self._checked.remove(subscription)
        subscription.destroy()

    @property
    def now(self) -> int:
        """Time of the node's clock, in ns."""
        return int(self.get_clock().now().nanoseconds)

    def every(self, seconds: float, call: Callable[[], None]) -> Timer:
        """Create a timer that does not depend on simulated time."""
        return self.create_timer(seconds, call, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def report(
        self, message: str, values: Mapping[str, object], level: bytes = diagnostics.OK
    ) -> None:
        """Publish the status of the node. A status about a `step` also names its run."""
        figures = {key: str(value) for key, value in values.items()}
        if "step" in figures:
            figures["run"] = self.clock.run
        figures |= self.topic_faults.figures()
        status = diagnostics.NodeStatus(self.get_fully_qualified_name(), message, figures, level)
        self._diagnostics.publish(diagnostics.encode(status, self.now))
