"""Every `ros2` command of the pages speaks of what there is; where there is a `ros2`, it is run."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
from collections.abc import Iterator
from importlib.metadata import distribution

import pytest
from all_nodes import add_stack
from gameinfer_docs.node_interface import COMMON_TOPICS, type_name
from pages import ROOT, shell_commands
from rclpy.node import Node
from ros_context import ros_context
from ros_domain import free_domain
from world import World

SHOWN = sorted({command for command in shell_commands() if command.startswith("ros2 ")})

#: How long anything may take, in s, on however busy a machine.
DEADLINE = 60.0


class Graph:
    """What the graph of a run holds, whose nodes are in one process."""

    def __init__(self, world: World, domain: int) -> None:
        self.domain, self.world = domain, world
        # It continues as long as it is spun.
        simulator, inference = {"steps": 10**6}, {"particles": 8}
        stack = add_stack(world, "three_player", inference, simulator=simulator, time="realtime")
        self.nodes, looker = stack.nodes, stack.simulator
        self.topics = {name for name, _ in looker.get_topic_names_and_types()} - COMMON_TOPICS
        self.services = {
            node.resolve_service_name(service.srv_name): type_name(service.srv_type)
            for node in self.nodes
            for service in node.services
        }

    def node(self, name: str) -> Node:
        (found,) = [n for n in self.nodes if n.get_fully_qualified_name() == name]
        return found


@pytest.fixture(scope="module")
def graph() -> Iterator[Graph]:
    domain = free_domain()
    with ros_context(domain) as context, pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        world = World(context)
        yield Graph(world, domain)
        world.end()


def test_there_are_commands() -> None:
    assert len(SHOWN) > 5


@pytest.mark.parametrize("command", SHOWN)
def test_what_a_command_names_is_there(command: str, graph: Graph) -> None:
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
            assert given[-1] in graph.topics
        case ("param", _):
            node = graph.node(given[0])
            assert all(node.has_parameter(name) for name in given[1:2])
        case ("service", "call"):
            assert graph.services[given[0]] == given[1]
        case _:
            pytest.fail(f"say how to check '{command}'")


def run(command: str, graph: Graph) -> tuple[int, str]:
    """Exit code and output of a command, while nodes go on."""
    process = subprocess.Popen(
        shlex.split(command),
        env={**os.environ, "ROS_DOMAIN_ID": str(graph.domain)},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        graph.world.until(lambda: process.poll() is not None)
        output, _ = process.communicate(timeout=DEADLINE)
    finally:
        process.kill()
        process.wait(DEADLINE)
    return process.returncode, output


@pytest.fixture(scope="module")
def daemon(graph: Graph) -> Iterator[None]:
    """The daemon of the command ros2, which knows all nodes."""
    run("ros2 daemon start", graph)
    graph.world.until(lambda: "/simulator" in run("ros2 node list", graph)[1])
    yield
    run("ros2 daemon stop", graph)


@pytest.mark.skipif(shutil.which("ros2") is None, reason="there is no ros2 command")
@pytest.mark.parametrize(
    "command", [c for c in SHOWN if not re.match("ros2 (run|daemon|bag|security) ", c)]
)
def test_a_command_runs(command: str, graph: Graph, daemon: None) -> None:
    code, output = run(command, graph)
    assert code == 0, output
