"""The policy for SROS2 allows what the nodes do, and nothing else."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from rclpy.node import Node

from gameinfer_ros.bags.label import BagLabel
from gameinfer_ros.nodes.bag_recorder import BagRecorder
from gameinfer_ros.nodes.base import middleware
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.nodes.replayer import Replayer
from gameinfer_ros.nodes.table import NODES, class_of
from gameinfer_ros.scenario import files as scenario_files

PLAYERS = ("robot", "human_1", "human_2")
#: Names that nodes of the table have in a run, if it is not that of the table.
NAMES = {"human_agent": [f"{player}_agent" for player in PLAYERS[1:]]}
#: Parameters by which nodes do all that they can do, where the defaults are not enough.
PARAMETERS: dict[str, list[dict[str, Any]]] = {
    "simulator": [{"publish_clock": True}, {"external": ", ".join(PLAYERS), "time": "realtime"}],
    "inference": [{"particles": 2}],
    **{name: [{"player": name.removesuffix("_agent")}] for name in NAMES["human_agent"]},
    "viewer": [{"port": 0, "control": True}],
}
#: What a node does (publish, subscribe, reply or request), and the full name of what it does so to.
Rights = set[tuple[str, str]]
#: Which question to the graph tells what a node does.
QUESTIONS = {
    "publish": "get_publisher_names_and_types_by_node",
    "subscribe": "get_subscriber_names_and_types_by_node",
    "reply": "get_service_names_and_types_by_node",
    "request": "get_client_names_and_types_by_node",
}


def full_name(name: str, node: str, namespace: str) -> str:
    if name.startswith("/"):
        return name
    base = namespace.rstrip("/")
    return f"{base}/{node}/{name[2:]}" if name.startswith("~/") else f"{base}/{name}"


def allowed(namespace: str) -> dict[str, dict[str, Rights]]:
    """What the policy allows each node, by the path of its enclave."""
    text = (scenario_files.folder() / "sros2/policy.xml").read_text(encoding="utf-8")
    if namespace != "/":
        text = text.replace('ns="/"', f'ns="{namespace}"')  # as the file says
    found: dict[str, dict[str, Rights]] = {}
    for enclave in ElementTree.fromstring(text).iter("enclave"):
        nodes: dict[str, Rights] = defaultdict(set)
        for profile in enclave.iter("profile"):
            assert profile.attrib["ns"] == namespace
            for rules in profile:
                assert set(rules.attrib.values()) == {"ALLOW"}
                for verb in rules.attrib:
                    nodes[profile.attrib["node"]] |= {
                        (verb, full_name(rule.text or "", profile.attrib["node"], namespace))
                        for rule in rules
                    }
        found[enclave.attrib["path"]] = dict(nodes)
    return found


def done(node: Node) -> Rights:
    """What a node does, as others see it in the graph."""
    name, namespace = node.get_name(), node.get_namespace()
    return {
        (verb, found)
        for verb, question in QUESTIONS.items()
        for found, _ in getattr(node, question)(name, namespace)
    }


@pytest.fixture(params=["/", "/demo"])
def namespace(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture
def used(world: Any, namespace: str, tmp_path: Path) -> Iterator[dict[str, Rights]]:
    """What each node of the scenario does, with whatever parameters."""
    found: dict[str, Rights] = defaultdict(set)
    add = partial(world.add, namespace=namespace, scenario="three_player", use_sim_time=True)

    makers = {name: class_of(key) for key in NODES for name in NAMES.get(key, [key])}
    for name, make in {**makers, "recorder": Recorder}.items():
        for parameters in PARAMETERS.get(name, [{}]):
            node = add(make, name, **parameters)
            if name == "viewer":
                node.server._pages = {"a page": None}  # while one is open, markers are asked for
                node._subscribe_markers()
            found[name] |= done(node)
            if name == "viewer":
                node.server._pages = {}
            world.remove(node)
    context = world.tester.context
    others: list[Node] = [Replayer(0, context=context, namespace=namespace)]
    for external in ([], list(PLAYERS[1:])):
        label = BagLabel("three_player", "map", "realtime", 0, external=external)
        bag = tmp_path / f"{len(external)}"
        scenario = scenario_files.find("three_player")
        recorder = BagRecorder(bag, scenario, label, context=context, namespace=namespace)
        recorder._has_all_publishers = lambda: True  # then it asks for states
        recorder.start()
        world.until(lambda recorder=recorder: "joint_state" in recorder._topics)
        recorder.close()
        others.append(recorder)
    for node in others:
        found[node.get_name()] |= done(node)
        node.destroy_node()
    yield dict(found)


def test_nodes_may_do_what_they_do_and_nothing_else(
    used: dict[str, Rights], namespace: str
) -> None:
    for enclave, nodes in allowed(namespace).items():
        for node, rights in nodes.items():
            # With simulated time, any node listens to the clock.
            needed = used[node] | {("subscribe", "/clock")}
            assert rights - needed == set(), f"{enclave}: {node} does not need it"
            assert needed - rights == set(), f"{enclave}: {node} does so, and may not"


def test_every_process_has_an_enclave(used: dict[str, Rights], namespace: str) -> None:
    enclaves = allowed(namespace)
    expected = {name: {name} for key in NODES for name in NAMES.get(key, [key])}
    expected |= {"run": {"recorder", "bag_recorder"}, "replay": {"replayer", "inference"}}
    found = {path: set(nodes) for path, nodes in enclaves.items()}
    assert found == {middleware.enclave(name)[1]: nodes for name, nodes in expected.items()}
    assert set(used) == set().union(*expected.values())
    # Enclaves are folders of a keystore.
    assert all(re.fullmatch(r"(/[a-z0-9_]+)+", path) for path in found)


def test_only_the_simulator_tells_states_and_only_the_planner_moves_the_robot() -> None:
    for topic, speakers in {
        "/joint_state": {"simulator", "replayer"},
        "/robot_strategy": {"inference"},
        "/map_strategy": {"inference"},
        "/robot/control": {"robot_planner"},
        "/robot/cmd_vel": {"robot_planner"},
        "/human_1/control": {"human_1_agent"},
    }.items():
        found = {
            node
            for nodes in allowed("/").values()
            for node, rights in nodes.items()
            if ("publish", topic) in rights
        }
        assert found == speakers, topic
