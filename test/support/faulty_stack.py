"""The nodes of a run, each a process, with a relay that spoils what some of them hear."""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable, Collection, Mapping
from functools import partial
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from passing import write_scenario
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from ros_context import make_context
from run_command import DEADLINE
from sensor_msgs.msg import MultiDOFJointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import MultiDOFJointTrajectory

from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.orchestration.node_process import NodeProcess, stop_all
from msg_adapters import qos

#: What can be done to messages on their way.
PASS, DROP, DELAY, DUPLICATE, REORDER = "pass", "drop", "delay", "duplicate", "reorder"

#: How long messages are held up that are delayed, in s.
HELD = 0.3

#: Topics that go by the relay: type, profile, and the node that hears them there.
RELAYED: dict[str, tuple[Any, QoSProfile, str]] = {
    "joint_state": (MultiDOFJointState, qos.STREAM, "robot_planner"),
    "robot_strategy": (Float64MultiArray, qos.RECENT, "robot_planner"),
    "robot/control": (MultiDOFJointTrajectory, qos.LATEST, "simulator"),
}


class Relay(Node):
    """Hands on the messages of some topics to one node each.

    Args:
        topics: some of those in `RELAYED`.
        node_options: passed on to `rclpy.node.Node`.

    Attributes:
        modes: what is done to the messages of each topic.
    """

    def __init__(self, topics: Collection[str], **node_options: Any) -> None:
        super().__init__("relay", **node_options)
        self.modes = dict.fromkeys(RELAYED, PASS)
        self._held: deque[tuple[float, Callable[[], None]]] = deque()
        self._overtaken: dict[str, Callable[[], None]] = {}
        for topic in topics:
            message_type, profile, _ = RELAYED[topic]
            publisher = self.create_publisher(message_type, f"relayed/{topic}", profile)
            self.create_subscription(
                message_type,
                topic,
                lambda data, topic=topic, publisher=publisher: self._hand_on(
                    topic, partial(publisher.publish, data)
                ),
                qos.queued(profile),
                raw=True,
            )
        self.create_timer(0.01, self._let_go)

    def _hand_on(self, topic: str, send: Callable[[], None]) -> None:
        mode = self.modes[topic]
        if mode == DELAY:
            self._held.append((time.monotonic() + HELD, send))
        elif mode == REORDER and topic not in self._overtaken:
            self._overtaken[topic] = send
        elif mode != DROP:
            send()
            if mode == DUPLICATE:
                send()
            if topic in self._overtaken:
                self._overtaken.pop(topic)()

    def _let_go(self) -> None:
        while self._held and self._held[0][0] < time.monotonic():
            self._held.popleft()[1]()


class FaultyStack:
    """A run of two players in realtime, without an orchestrator.

    Args:
        folder: where scenario, parameters and logs are written.
        domain: ROS domain, as `ROS_DOMAIN_ID` says too.
        order: names of the nodes in the order in which they start.
        gap: how long each waits for the one before, in s.
        relayed: topics that go by the relay.
        environments: variables that nodes get, by their name.
    """

    def __init__(
        self,
        folder: Path,
        domain: int,
        order: tuple[str, ...] = ("simulator", "inference", "robot_planner", "human_1_agent"),
        gap: float = 0.0,
        relayed: Collection[str] = tuple(RELAYED),
        environments: Mapping[str, Mapping[str, str]] | None = None,
    ) -> None:
        self._scenario, self._relayed = write_scenario(folder), relayed
        context = make_context(domain)
        self._context, self._executor = context, SingleThreadedExecutor(context=context)
        self.relay = Relay(relayed, context=context)
        self.recorder = Recorder(
            context=context, parameter_overrides=[Parameter("scenario", value=str(self._scenario))]
        )
        for node in (self.relay, self.recorder):
            self._executor.add_node(node)
        self.nodes: list[NodeProcess] = []
        for name in order:
            self.nodes.append(self._start(folder, name, (environments or {}).get(name, {})))
            self.spin(gap)

    def _start(self, folder: Path, name: str, environment: Mapping[str, str]) -> NodeProcess:
        common = {"scenario": str(self._scenario), "time": "realtime"}
        more: Mapping[str, Any] = {
            # Inference, human, recorder, and planner or relay.
            "simulator": {"steps": 10**6, "subscribers": 4},
            "human_1_agent": {"player": "human_1", "seed": 4},
        }.get(name, {"seed": 3})
        own = [f"{t}:=relayed/{t}" for t in self._relayed if RELAYED[t][-1] == name]
        module = "human_agent" if name.startswith("human") else name
        remaps = [word for rule in own for word in ("-r", rule)]
        with mock.patch.dict(os.environ, environment):
            return NodeProcess(name, module, {**common, **more}, folder, remaps)

    def end(self) -> None:
        stop_all(self.nodes)
        self.relay.destroy_node()
        self.recorder.destroy_node()
        self._context.try_shutdown()

    def spin(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._executor.spin_once(timeout_sec=0.02)

    def until(self, condition: Callable[[], object]) -> None:
        deadline = time.monotonic() + DEADLINE
        while not condition():
            words = "\n".join(f"{node.name}:\n{node.last_output(5)}" for node in self.nodes)
            assert time.monotonic() < deadline, words
            assert all(node.exit_code is None for node in self.nodes), words
            self._executor.spin_once(timeout_sec=0.02)

    @property
    def step(self) -> int:
        """The newest step; -1 before the first."""
        return len(self.recorder.record.states) - 1

    def for_steps(self, count: int) -> None:
        end = self.step + count
        self.until(lambda: self.step >= end)

    @property
    def speeds(self) -> np.ndarray:
        """The robot's speed at each step so far, in m/s."""
        return np.abs(np.array(self.recorder.record.states)[:, 3])

    @property
    def inputs(self) -> np.ndarray:
        """The joint input (nw,) of each step so far."""
        return np.array(self.recorder.record.inputs)

    @property
    def robot_is_late(self) -> bool:
        """Whether the simulator waits for the robot's input in the newest step."""
        return "robot/latency_ms" not in self.recorder.figures.get("/simulator", {})
