"""Nodes in one process, on a domain of their own, with real messages between them."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

import pytest
import rclpy
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from ros_context import make_context
from sensor_msgs.msg import MultiDOFJointState
from wire import START

from gameinfer_ros.nodes.base.game_node import GameNode
from msg_adapters import diagnostics, qos, stamp

AnyNode = TypeVar("AnyNode", bound=GameNode)
#: How long anything may take, in s, on however busy a machine.
DEADLINE = 60.0


class World:
    """Nodes that are spun one callback at a time, and a node of the test's own beside them."""

    def __init__(self, context: rclpy.Context) -> None:
        self._context = context
        self._executor = SingleThreadedExecutor(context=context)
        self.tester = Node("tester", context=context)
        self._executor.add_node(self.tester)
        self.nodes: list[GameNode] = []
        self._starts: dict[str, Publisher] = {}
        self._half_made = False

    def add(
        self,
        make: Callable[..., AnyNode],
        name: str | None = None,
        namespace: str | None = None,
        cli_args: list[str] | None = None,
        **parameters: Any,
    ) -> AnyNode:
        """Construct a node and spin it from now on."""
        overrides = [
            Parameter(key, value=str(value) if isinstance(value, Path) else value)
            for key, value in parameters.items()
        ]
        try:
            node = make(
                *([name] if name else []),
                context=self._context,
                namespace=namespace,
                cli_args=cli_args,
                parameter_overrides=overrides,
            )
        except Exception:
            self._half_made = True
            raise
        self._executor.add_node(node)
        self.nodes.append(node)
        return node

    def remove(self, node: GameNode) -> None:
        self.nodes.remove(node)
        self._executor.remove_node(node)
        node.destroy_node()

    def end(self) -> None:
        for node in (self.tester, *self.nodes):
            self._executor.remove_node(node)
            node.destroy_node()
        self.nodes.clear()
        self._context.try_shutdown()
        if self._half_made:
            gc.collect()  # or a half-made node would still publish

    def spin(self, seconds: float = 0.0) -> None:
        """Handle what there is to handle, and what comes up in some seconds."""
        end = time.monotonic() + seconds
        for _ in range(5 + 5 * len(self.nodes)):
            self._executor.spin_once(timeout_sec=0)
        while time.monotonic() < end:
            self._executor.spin_once(timeout_sec=0.01)

    def until(self, condition: Callable[[], object], what: str = "waited in vain") -> None:
        deadline = time.monotonic() + DEADLINE
        while not condition():
            assert time.monotonic() < deadline, what
            self._executor.spin_once(timeout_sec=0.05)

    def hear(
        self, message_type: Any, topic: str, profile: QoSProfile, senders: int = 1
    ) -> list[Any]:
        """Messages that arrive on a topic from now on; its publishers are connected."""
        heard: list[Any] = []
        subscription = self.tester.create_subscription(message_type, topic, heard.append, profile)
        name = subscription.topic_name
        if senders:
            self.until(
                lambda: self.tester.count_publishers(name) >= senders, f"no node publishes {name}"
            )
        return heard

    def publisher(
        self, message_type: Any, topic: str, profile: QoSProfile, listeners: int = 1
    ) -> Publisher:
        """A publisher to which the nodes listen."""
        publisher = self.tester.create_publisher(message_type, topic, profile)
        self.until(
            lambda: publisher.get_subscription_count() >= listeners, f"no node hears {topic}"
        )
        return publisher

    def start_run(self, start: int = START, topic: str = "run_start", listeners: int = 1) -> None:
        """Tell the nodes that a run has started, in the place of the simulator."""
        if topic not in self._starts:
            self._starts[topic] = self.publisher(Time, topic, qos.LATEST, listeners)
        self.send(self._starts[topic], stamp.encode(start))

    def states(self, topic: str = "joint_state", listeners: int = 1) -> Publisher:
        """A publisher of the states of a run that has started at `START`."""
        publisher = self.publisher(MultiDOFJointState, topic, qos.STREAM, listeners)
        self.start_run(topic=topic.replace("joint_state", "run_start"), listeners=listeners)
        return publisher

    def send(self, publisher: Publisher, message: Any) -> None:
        """Publish a message and wait until it has been handled."""
        publisher.publish(message)
        assert publisher.wait_for_all_acked(Duration(seconds=DEADLINE))
        self.spin(0.02)

    def call(self, kind: Any, service: str, **request: Any) -> Any:
        client = self.tester.create_client(kind, service)
        self.until(client.service_is_ready, f"no node serves {service}")
        future = client.call_async(kind.Request(**request))
        self.until(future.done, f"{service} does not answer")
        return future.result()

    def reports(self, node: GameNode, first_state: bool = True) -> list[diagnostics.NodeStatus]:
        """Statuses of a node from now on; the list grows.

        On a busy machine, a node may report that it waits for the first state; without
        `first_state`, the list contains these statuses too.
        """
        statuses: list[diagnostics.NodeStatus] = []
        name = node.get_fully_qualified_name()  # which a removed node has no more

        def receive(message: DiagnosticArray) -> None:
            said = (s for s in diagnostics.decode(message) if s.name == name)
            statuses.extend(
                s for s in said if not first_state or s.message != "waits for the first joint_state"
            )

        subscription = self.tester.create_subscription(
            DiagnosticArray, "/diagnostics", receive, qos.ANY_DIAGNOSTICS
        )
        connected = len(self.nodes)
        self.until(lambda: subscription.get_publisher_count() >= connected)
        return statuses


@pytest.fixture
def make_world(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[], World]]:
    """Makes worlds that do not hear one another."""
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    worlds: list[World] = []

    def make() -> World:
        worlds.append(World(make_context()))
        return worlds[-1]

    yield make
    for world in worlds:
        world.end()


@pytest.fixture
def world(make_world: Callable[[], World]) -> World:
    return make_world()
