"""Whole closed loops in one process."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from all_nodes import add_stack
from small_scenario import ScenarioFile

from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.runs.record import RunRecord


def play(
    world: Any,
    scenario: str | Path,
    humans: int = 1,
    particles: int = 8,
    namespace: str | None = None,
) -> RunRecord:
    """Play a scenario in lockstep to the end; `humans` is their seed."""
    mind = {"seed": 2, "particles": particles}
    stack = add_stack(world, scenario, mind, human_seed=humans, namespace=namespace)
    recorder, steps = stack.recorder, stack.simulator.steps
    world.until(
        lambda: recorder.record.steps >= steps and steps in recorder.record.beliefs,
        "the run stands still",
    )
    return recorder.record


def assert_consistent(record: RunRecord, steps: int) -> None:
    """The record is whole, and each state follows from the last one by the inputs on the wire."""
    assert len(record.states) == steps + 1
    assert len(record.inputs) == steps
    for k, w in enumerate(record.inputs):
        s_next = record.vehicles.step(record.states[k], w)
        np.testing.assert_allclose(record.states[k + 1], s_next, rtol=0, atol=1e-12)
    assert sorted(record.beliefs) == list(range(steps + 1))
    for weights in record.beliefs.values():
        assert sum(weights.values()) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("kinds", ["u", "d", "du", "uud", "f", "uf", "c", "uc"])
def test_any_players_play_to_the_end(kinds: str, world: Any, scenario_file: ScenarioFile) -> None:
    record = play(world, scenario_file(kinds))
    assert_consistent(record, 8)
    assert len(record.costs) == len(kinds)


def test_nodes_in_a_namespace_play_among_themselves(
    make_world: Callable[[], Any], scenario_file: ScenarioFile
) -> None:
    scenario = scenario_file("uu")
    world = make_world()
    alone = play(make_world(), scenario)
    # Two games at a time in one domain, with other humans.
    first = play(world, scenario, namespace="/a")
    second = play(world, scenario, humans=9, namespace="/b/c")
    np.testing.assert_array_equal(first.states, alone.states)
    assert not np.array_equal(second.states, alone.states)
    assert {"/a/simulator", "/b/c/simulator"} <= {
        node.get_fully_qualified_name() for node in world.nodes
    }
    topics = {name for name, _ in world.tester.get_topic_names_and_types()}
    assert {"/a/joint_state", "/b/c/human_1/control", "/a/robot/cmd_vel"} <= topics
    assert not {"/joint_state", "/robot_strategy", "/robot/control"} & topics


def test_a_recorder_that_joins_late_misses_nothing(world: Any, scenario_file: ScenarioFile) -> None:
    scenario = scenario_file("uu")
    record = play(world, scenario)
    recorder = world.add(Recorder, "late_recorder", scenario=scenario)
    world.until(lambda: recorder.record.steps >= 8 and 8 in recorder.record.beliefs)
    late = recorder.record
    np.testing.assert_array_equal(late.states, record.states)
    np.testing.assert_array_equal(late.inputs, record.inputs)
    assert late.beliefs == record.beliefs


@pytest.mark.parametrize("heading", [3.0, 7.0, -10.0])
def test_a_heading_counts_whole_turns_though_the_wire_does_not(
    heading: float, world: Any, scenario_file: ScenarioFile
) -> None:
    # The goal has the heading of the start, so who forgets a turn wants to turn back.
    scenario = scenario_file("uu", heading=heading, steps=12, horizon=12)
    record = play(world, scenario)
    assert_consistent(record, 12)
    headings = np.array(record.states)[:, [2, 6]]
    np.testing.assert_allclose(headings, heading, atol=0.5)
    assert record.costs.max() < 20.0
