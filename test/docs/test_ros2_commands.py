"""Every `ros2` command of the pages speaks of what there is; where there is a `ros2`, it is run."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from importlib.metadata import distribution

import pytest
import rclpy
from gameinfer_docs.node_interface import COMMON_TOPICS, type_name
from pages import PAGES, ROOT, blocks, commands
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from ros_domain import free_domain

from gameinfer_ros.nodes.human_agent import HumanAgent
from gameinfer_ros.nodes.inference import Inference
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.nodes.robot_planner import RobotPlanner
from gameinfer_ros.nodes.simulator import Simulator

SHOWN = sorted(
    {
        command
        for page in PAGES
        for block in blocks(page)
        if block.language == "sh"
        for command in commands(block.text)
        if command.startswith("ros2 ")
    }
)

#: How long anything may take, in s, on however busy a machine.
DEADLINE = 60.0


class Stack:
    """The nodes of a run in one process, and what their graph holds."""

    def __init__(self, context: rclpy.Context, domain: int) -> None:
        self.domain = domain

        def made(node_class: type[Node], *name: str, **parameters: object) -> Node:
            given = {"time": "realtime", **parameters}  # it goes on as long as it is spun
            overrides = [Parameter(key, value=value) for key, value in given.items()]
            return node_class(*name, context=context, parameter_overrides=overrides)

        self.nodes = [
            made(Simulator, steps=10**6),
            made(Inference, particles=8),
            made(RobotPlanner),
            made(Recorder),
            *(made(HumanAgent, f"{human}_agent", player=human) for human in ("human_1", "human_2")),
        ]
        self._executor = SingleThreadedExecutor(context=context)
        for node in self.nodes:
            self._executor.add_node(node)
        looker = self.nodes[0]
        self.topics = {name for name, _ in looker.get_topic_names_and_types()} - COMMON_TOPICS
        self.services = {
            node.resolve_service_name(service.srv_name): type_name(service.srv_type)
            for node in self.nodes
            for service in node.services
        }

    def node(self, name: str) -> Node:
        (found,) = [n for n in self.nodes if n.get_fully_qualified_name() == name]
        return found

    def spin_until(self, over: Callable[[], bool]) -> None:
        """Spin the nodes; messages and answers go their way."""
        deadline = time.monotonic() + DEADLINE
        while not over():
            assert time.monotonic() < deadline
            try:
                self._executor.spin_once(timeout_sec=0.05)
            except ExternalShutdownException:
                return


@pytest.fixture(scope="module")
def stack() -> Iterator[Stack]:
    domain = free_domain()
    context = rclpy.Context()
    before = os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE")
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    try:
        rclpy.init(context=context, domain_id=domain)
        yield Stack(context, domain)
    finally:
        context.try_shutdown()
        if before is None:
            del os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"]
        else:
            os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = before


def test_there_are_commands() -> None:
    assert len(SHOWN) > 5


@pytest.mark.parametrize("command", SHOWN)
def test_what_a_command_names_is_there(command: str, stack: Stack) -> None:
    _, noun, verb, *rest = shlex.split(command) if " run " not in command else command.split()
    given = [word for word in rest if not word.startswith("-")]
    match (noun, verb):
        case ("node" | "topic" | "service", "list") | ("daemon", "stop") | ("bag", "play"):
            pass  # these speak of nothing that is ours
        case ("run", "gameinfer_ros") | ("pkg", "executables"):
            assert verb == "gameinfer_ros" or given == ["gameinfer_ros"]
            assert noun == "pkg" or given[0] in distribution(verb).entry_points.names
        case ("security", "generate_artifacts"):
            assert (ROOT / given[-1]).is_file()
        case ("topic", _):
            assert given[-1] in stack.topics
        case ("param", _):
            node = stack.node(given[0])
            assert all(node.has_parameter(name) for name in given[1:2])
        case ("service", "call"):
            assert stack.services[given[0]] == given[1]
        case _:
            pytest.fail(f"say how to check '{command}'")


@pytest.mark.skipif(shutil.which("ros2") is None, reason="there is no ros2 command")
@pytest.mark.parametrize(
    "command", [c for c in SHOWN if not re.match("ros2 (run|daemon|bag|security) ", c)]
)
def test_a_command_runs(command: str, stack: Stack) -> None:
    process = subprocess.Popen(
        shlex.split(command),
        env={**os.environ, "ROS_DOMAIN_ID": str(stack.domain)},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        stack.spin_until(lambda: process.poll() is not None)
        output, _ = process.communicate(timeout=DEADLINE)
    finally:
        process.kill()
        process.wait(DEADLINE)
    assert process.returncode == 0, output
