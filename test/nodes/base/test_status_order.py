"""What is believed of what nodes say of themselves, when runs begin anew."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import MultiDOFJointState

from gameinfer_ros.nodes.base.status_order import MOST_NODES, StatusOrder
from gameinfer_ros.nodes.base.step_order import AHEAD
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.nodes.viewer import Viewer
from gameinfer_ros.view import Mark
from msg_adapters import MessageError, diagnostics, qos


def status(step: int | None, node: str = "/inference") -> diagnostics.NodeStatus:
    figures = {} if step is None else {"step": str(step), "solve_ms": "1.5"}
    return diagnostics.NodeStatus(node, "goes on", figures)


@pytest.fixture
def order() -> StatusOrder:
    """A run of which two nodes have told the steps 0 to 51, and which has begun anew."""
    order = StatusOrder()
    for step in range(52):
        assert order.admits(status(step), step)
        assert order.admits(status(step, "/planner"), step)
    order.begin()
    return order


@pytest.mark.parametrize("late", [51, 52, 53, 52 + AHEAD])
def test_a_late_status_of_a_run_that_is_over_does_not_count(late: int, order: StatusOrder) -> None:
    assert not order.admits(status(late), 0)
    assert not order.admits(status(late), 3)
    assert order.late == 2


@pytest.mark.parametrize("first", [0, 7])
def test_a_node_whose_steps_go_back_is_in_the_new_run(first: int, order: StatusOrder) -> None:
    order.admits(status(52), 0)
    for step in range(first, 100):  # also if the states come later than what it says
        assert order.admits(status(step), max(0, step - 5))
    assert not order.admits(status(52, "/planner"), 0), "each node by itself"
    with pytest.raises(MessageError, match=f"at most {AHEAD} later ones are believed"):
        order.admits(status(200), 99)


def test_a_node_that_the_new_run_has_reached_is_in_it(order: StatusOrder) -> None:
    assert not order.admits(status(55), 54)
    assert order.admits(status(56), 56)
    assert order.admits(status(57), 56)


def test_a_node_that_is_ahead_of_the_new_run_is_in_it(order: StatusOrder) -> None:
    assert order.admits(status(0), 0)
    assert order.admits(status(1), 1)
    assert order.admits(status(0), 1)  # of a third run, whose first state comes later
    order.begin()
    assert order.admits(status(1), 0)


def test_a_node_that_was_not_heard_before_may_be_late_too(order: StatusOrder) -> None:
    assert not order.admits(status(52, "/human_agent"), 0)
    assert order.admits(status(0, "/human_agent"), 0)


def test_so_many_nodes_as_a_run_can_have_are_known() -> None:
    order = StatusOrder()
    for i in range(MOST_NODES):
        assert order.admits(status(None if i % 2 else 0, f"/node_{i}"), 0)
    with pytest.raises(MessageError, match=f"{MOST_NODES} nodes are known"):
        order.admits(status(0, "/another"), 0)


@pytest.mark.parametrize("kind", [Recorder, Viewer])
def test_who_watches_runs_takes_no_late_status_for_an_error(
    kind: Any, world: Any, wire: Any, scenario_file: Callable[..., Path]
) -> None:
    port = {"port": 0} if kind is Viewer else {}
    node = world.add(kind, scenario=scenario_file("uu", steps=1000), **port)
    states = world.publisher(MultiDOFJointState, "joint_state", qos.STREAM)
    told = world.publisher(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)
    s, wires = node.scenario.initial_vehicle_state, wire(node.scenario)
    for state, step in ((0, 0), (40, 40), (80, 80), (0, 81), (1, 0), (2, 1)):
        world.send(states, wires.state(state, s))
        world.send(told, diagnostics.encode(status(step), Time()))
    world.until(lambda: node._statuses.late == 1)
    assert not node.topic_faults.rejected
    if kind is Recorder:
        assert node.solve_ms == {"/inference": {0: 1.5, 1: 1.5}}
        assert node.figures["/inference"]["step"] == "1"
    else:
        update, _ = node.run.since(Mark())
        assert [step for _, step, _ in update["solves"]] == [0, 1]
