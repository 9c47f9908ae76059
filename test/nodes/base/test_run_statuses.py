"""What is taken in of what nodes say of themselves."""

from __future__ import annotations

from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from small_scenario import ScenarioFile
from wire import START

from gameinfer_ros.nodes.base.run_statuses import MOST_NODES, RunStatuses
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.nodes.viewer import Viewer
from gameinfer_ros.runs.run_clock import EarlyError, RunClock
from gameinfer_ros.view import Mark
from msg_adapters import MessageError, diagnostics, qos, stamp
from msg_adapters.stamp import SECOND


def message(
    step: int | None = 1, start: int = START, name: str = "/inference", **more: str
) -> DiagnosticArray:
    figures = {} if step is None else {"step": str(step), "run": stamp.text(start)}
    return diagnostics.encode(diagnostics.NodeStatus(name, "goes on", {**figures, **more}), 0)


@pytest.fixture
def statuses() -> RunStatuses:
    clock = RunClock(0.1)
    clock.start = START
    return RunStatuses("/", clock)


def test_a_status_of_the_present_run_counts_whatever_its_step(statuses: RunStatuses) -> None:
    for step in (5, 0, 10**9):
        (found,) = statuses.of(message(step))
        assert found.values["step"] == str(step)


def test_a_status_of_an_earlier_run_does_not_count(statuses: RunStatuses) -> None:
    assert statuses.of(message(7, START - 1)) == []


def test_a_status_that_is_about_no_step_always_counts(statuses: RunStatuses) -> None:
    assert len(statuses.of(message(None))) == 1


def test_a_status_of_a_later_run_is_early(statuses: RunStatuses) -> None:
    with pytest.raises(EarlyError):
        statuses.of(message(0, START + 1))


def test_a_status_about_a_step_names_its_run(statuses: RunStatuses) -> None:
    said = diagnostics.NodeStatus("/inference", "goes on", {"step": "3"})
    with pytest.raises(MessageError, match="/inference: run: is missing"):
        statuses.of(diagnostics.encode(said, 0))
    with pytest.raises(MessageError, match="run: 'first' is not allowed"):
        statuses.of(message(run="first"))


def test_what_nodes_elsewhere_say_does_not_count() -> None:
    clock = RunClock(0.1)
    clock.start = START
    statuses = RunStatuses("/demo", clock)
    for name in ("/inference", "battery", "/demo/child/inference", "/demonstration/inference"):
        assert statuses.of(message(name=name, run="first")) == []
    assert len(statuses.of(message(name="/demo/inference"))) == 1


def test_as_many_nodes_as_a_run_can_have_are_known(statuses: RunStatuses) -> None:
    for i in range(MOST_NODES):
        assert statuses.of(message(None if i % 2 else 0, name=f"/node_{i}"))
    with pytest.raises(MessageError, match=f"{MOST_NODES} other nodes are known"):
        statuses.of(message(name="/another"))
    assert statuses.of(message(name="/node_0"))


@pytest.mark.parametrize("kind", [Recorder, Viewer])
def test_who_watches_runs_takes_in_what_is_said_of_the_present_one(
    kind: Any, world: Any, scenario_file: ScenarioFile
) -> None:
    port = {"port": 0} if kind is Viewer else {}
    node = world.add(kind, scenario=scenario_file("uu", steps=1000), **port)
    told = world.publisher(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)
    later = START + 60 * SECOND

    def solves() -> list[int]:
        if kind is Recorder:
            return list(node.solve_ms["/inference"])
        return [step for _, step, _ in node.run.since(Mark())[0].get("solves", [])]

    for step in (80, 81):
        world.send(told, message(step, START, solve_ms="1.5"))
    assert solves() == []  # no run has started
    world.start_run(START)
    assert solves() == [80, 81]
    world.send(told, message(0, later, solve_ms="1.5"))  # sooner than the start of its run
    assert solves() == [80, 81]
    world.start_run(later)
    world.send(told, message(82, START, solve_ms="1.5"))  # of a node that is late
    world.send(told, message(1, later, solve_ms="1.5"))
    world.until(lambda: solves() == [0, 1])
    assert not node.topic_faults.rejected
