"""What the recorder keeps of statuses and states."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from ros_context import ros_context
from wire import START

from gameinfer_ros.nodes.base.follower_node import Observation
from gameinfer_ros.nodes.base.run_statuses import MOST_NODES
from gameinfer_ros.nodes.recorder import Recorder
from msg_adapters import MessageError, diagnostics, stamp

#: Steps between two states.
GAP = 50


@pytest.fixture
def recorder() -> Iterator[Recorder]:
    with ros_context() as context:
        node = Recorder(context=context, namespace="/demo")
        node._on_run_start(stamp.encode(START), 0.0)
        yield node
        node.destroy_node()


def tell(recorder: Recorder, name: str, **figures: str) -> None:
    if "step" in figures:
        figures = {"run": stamp.text(START), **figures}
    status = diagnostics.NodeStatus(name, "goes on", figures, diagnostics.OK)
    recorder._on_status(status)


def test_figures_and_solve_times_are_kept_by_node(recorder: Recorder) -> None:
    tell(recorder, "/demo/inference", step="3", solve_ms="1.5")
    tell(recorder, "/demo/inference", step="4", solve_ms="2.5")
    tell(recorder, "/demo/simulator", step="4")
    assert recorder.figures["/demo/inference"]["solve_ms"] == "2.5"
    assert recorder.solve_ms == {"/demo/inference": {3: 1.5, 4: 2.5}}


@pytest.mark.parametrize(
    ("figure", "value"),
    [
        ("solve_ms", "soon"),
        ("solve_ms", "nan"),
        ("step", "-1"),
        ("late_steps", "1.5"),
        ("safety_braked", "x"),
        ("safety_limited", "-2"),
    ],
)
def test_a_figure_that_is_no_number_is_refused(figure: str, value: str, recorder: Recorder) -> None:
    with pytest.raises(MessageError, match=f"/demo/planner: {figure}: '{value}' is not allowed"):
        tell(recorder, "/demo/planner", **{figure: value})
    assert not recorder.figures and not recorder.solve_ms


def test_a_flood_of_steps_does_not_fill_the_memory(recorder: Recorder) -> None:
    observe(recorder, 0)
    for step in range(3 * MOST_NODES):
        tell(recorder, "/demo/inference", step=str(step), solve_ms="1")
    with pytest.raises(MessageError, match="step: 1000000 is ignored: 300 steps are already"):
        tell(recorder, "/demo/inference", step="1000000", solve_ms="1")
    tell(recorder, "/demo/inference", step="7", solve_ms="2")
    observe(recorder, 1)
    tell(recorder, "/demo/inference", step="300", solve_ms="1")


def observe(recorder: Recorder, step: int) -> None:
    s, w = recorder.scenario.initial_vehicle_state, np.zeros(recorder.vehicles.n_inputs)
    recorder._on_state(Observation(step, recorder.vehicles.game_state(s), s, w, 0.0, 0.0))


def test_a_clock_that_jumps_by_years_does_not_fill_the_memory(recorder: Recorder) -> None:
    for step in range(3):
        observe(recorder, step)
    far = 2**31 * 10  # the last that a stamp can tell
    with pytest.raises(
        MessageError, match=f"stamp: step {far} is not allowed: .* would be missing"
    ):
        observe(recorder, far)
    observe(recorder, 3)
    assert recorder.record.steps == 3


def test_states_with_gaps_take_hardly_more_memory_than_those_that_arrive(
    recorder: Recorder,
) -> None:
    for step in range(0, 100 * GAP, GAP):
        observe(recorder, step)
    record = recorder.record
    assert record.steps == 99 * GAP
    assert len({id(array) for array in (*record.states, *record.inputs)}) <= 4 * 100
