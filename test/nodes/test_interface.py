"""The table of parameters, topics and services is that of the nodes."""

from __future__ import annotations

from typing import Any

import pytest

from gameinfer_ros.nodes.interface import ALL_PARAMETERS, NodeInterface, known_nodes
from gameinfer_ros.nodes.table import NODES, class_of

#: What nodes use only with other parameters, or while a page is open; and the topic of ROS's log.
SOMETIMES = {"/clock", "/ns/markers", "/rosout"}
PARAMETERS = {"viewer": {"port": 0, "control": True}, "simulator": {"publish_clock": True}}


@pytest.mark.parametrize("kind", NODES)
@pytest.mark.parametrize("scenario", ["two_player", "three_player"])
def test_a_node_has_the_names_of_the_table(kind: str, scenario: str, world: Any) -> None:
    node = world.add(class_of(kind), namespace="/ns", scenario=scenario, **PARAMETERS.get(kind, {}))
    own = "human_1" if kind == "human_agent" else ""
    table = NodeInterface(kind, node.get_name(), "/ns", node.players.names, own)
    assert table.full_name == node.get_fully_qualified_name()
    assert set(table.parameters) == set(node.get_parameters_by_prefix(""))
    topics = {p.topic_name for p in node.publishers} | {s.topic_name for s in node.subscriptions}
    known = set(map(table.expanded, table.topics))
    assert topics <= known
    assert known - topics <= SOMETIMES
    services = {node.resolve_service_name(s.srv_name) for s in (*node.services, *node.clients)}
    assert services == set(map(table.expanded, table.services))


def test_all_parameters_are_those_of_all_nodes() -> None:
    found = {
        name for kind in NODES for name in NodeInterface(kind, kind, "/", ["robot"]).parameters
    }
    assert found == ALL_PARAMETERS


def test_the_nodes_of_a_run_have_known_names() -> None:
    assert set(known_nodes("/ns", ["robot", "ana"])) == {
        *(f"/ns/{kind}" for kind in NODES),
        *("/ns/robot_agent", "/ns/ana_agent", "/ns/recorder", "/ns/bag_recorder"),
    }
