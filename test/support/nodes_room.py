"""All nodes that listen, and a run whose topics can be spoiled."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from all_nodes import add_stack
from bad_messages import mutated
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message
from std_msgs.msg import Float64MultiArray

from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.nodes.robot_planner import RobotPlanner
from gameinfer_ros.nodes.simulator import Simulator
from gameinfer_ros.nodes.table import NODES, class_of
from gameinfer_ros.runs.run_clock import RunClock
from msg_adapters import qos, stamp

#: Every node that listens, with parameters by which it listens to all that it can listen to.
LISTENERS: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    **{name: (class_of(name), {"port": 0} if name == "viewer" else {}) for name in NODES},
    "simulator of an external player": (Simulator, {"time": "realtime", "external": "human_1"}),
    "robot planner in realtime": (RobotPlanner, {"time": "realtime"}),
    "recorder": (Recorder, {}),
}
#: Topics that rclpy itself listens to.
NOT_OURS = ("/parameter_events", "/clock")


def topics(node: Any) -> Iterator[tuple[str, Any, QoSProfile]]:
    """Name, type and profile of all that a node listens to."""
    for subscription in list(node.subscriptions):
        if subscription.topic_name not in NOT_OURS:
            yield subscription.topic_name, subscription.msg_type, subscription.qos_profile


class Run:
    """All nodes of a game of two, in one process, and what passes between them."""

    def __init__(
        self, world: Any, scenario: Path, steps: int, listeners: int = 0, **common: Any
    ) -> None:
        self.world, self.steps = world, steps
        self.heard: dict[str, list[bytes]] = {}
        self.types: dict[str, tuple[Any, QoSProfile]] = {}
        stack = add_stack(
            world, scenario, simulator={"steps": steps}, listeners=listeners, **common
        )
        self.recorder, self.inference, self.planner, (self.human,), self.simulator = stack
        self.nodes = stack.nodes
        self._publishers = {p.topic_name: p for node in self.nodes for p in node.publishers}
        for node in self.nodes:
            for topic, message_type, profile in topics(node):
                self.types[topic] = message_type, profile

    def listen(self) -> None:
        """Keep what is published from now on, in order."""
        for topic, (message_type, profile) in self.types.items():
            self.heard[topic] = []
            self.world.tester.create_subscription(
                message_type, topic, self.heard[topic].append, qos.queued(profile), raw=True
            )

    def spoil(self, other: Run, step: int, rng: np.random.Generator) -> None:
        """Publish, on every topic, something like a message of some steps before, but worse.

        It is made of what was heard in another run. It comes from the node that publishes there:
        messages of other publishers do not count anyway. A start would be that of a new run.
        """
        for topic, (message_type, _) in self.types.items():
            if step < len(other.heard[topic]) and topic != "/run_start":
                old = deserialize_message(other.heard[topic][step], message_type)
                restamp(old, other.simulator.clock, self.simulator.clock)
                self._publishers[topic].publish(mutated(old, rng, keep_stamp=True))

    @property
    def done(self) -> bool:
        return self.simulator.done and len(self.recorder.record.beliefs) == self.steps + 1

    def bits(self) -> list[bytes]:
        record = self.recorder.record
        beliefs = [str(sorted(record.beliefs.items())), str(sorted(record.maps.items()))]
        return [
            *(s.tobytes() for s in record.states),
            *(w.tobytes() for w in record.inputs),
            *(b.encode() for b in beliefs),
        ]


def restamp(message: Any, before: RunClock, after: RunClock) -> None:
    """Make a message of one run one of another."""
    later = after.start - before.start
    if hasattr(message, "header"):
        message.header.stamp = stamp.encode(stamp.decode(message.header.stamp) + later)
    if isinstance(message, Float64MultiArray):
        seconds, nanoseconds = (int(number) for number in message.data[:2])
        time = seconds * stamp.SECOND + nanoseconds + later
        message.data[0], message.data[1] = divmod(time, stamp.SECOND)
    for status in message.status if isinstance(message, DiagnosticArray) else ():
        for value in status.values:
            if value.key == "run":
                value.value = after.run


def memory() -> int:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096
