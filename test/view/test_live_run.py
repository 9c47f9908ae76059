"""What pages receive of a run."""

from __future__ import annotations

import json
import time
from typing import Any

import numpy as np
import pytest

from gameinfer_ros.names.colours import COLOURS
from gameinfer_ros.runs.record import RunRecord
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.view import LiveRun, Mark, Trajectory, live_run

STEPS = 12


def played(scenario: Scenario) -> RunRecord:
    vehicles, rng = scenario.vehicles, np.random.default_rng(0)
    record = RunRecord(vehicles, [scenario.initial_vehicle_state])
    for _ in range(STEPS):
        record.inputs.append(rng.uniform(-0.3, 0.3, vehicles.n_inputs))
        record.states.append(vehicles.step(record.states[-1], record.inputs[-1]))
    return record


def fill(run: LiveRun, record: RunRecord, first: int = 0, end: int = STEPS + 1) -> None:
    nothing = np.zeros(record.vehicles.n_inputs)
    for step in range(first, end):
        run.add_state(step, record.states[step], record.inputs[step - 1] if step else nothing)


@pytest.fixture(params=["three_player", "five_player"])
def scenario(request: pytest.FixtureRequest) -> Scenario:
    content = request.getfixturevalue(request.param).model_dump()
    content["costs"][-1]["active_from"] = 0.05 * STEPS  # so that it matters which step it is
    return Scenario.model_validate(content)


@pytest.fixture
def run(scenario: Scenario) -> LiveRun:
    return LiveRun(scenario, "test", STEPS)


def told(run: LiveRun, mark: Mark = Mark()) -> tuple[dict[str, Any], Mark]:  # noqa: B008
    """An update as a page reads it."""
    update, mark = run.since(mark)
    return json.loads(json.dumps(update, allow_nan=False)), mark


def test_pages_receive_what_a_record_of_the_run_contains(run: LiveRun, scenario: Scenario) -> None:
    record = played(scenario)
    fill(run, record)
    rows = told(run)[0]["states"]
    assert [row["step"] for row in rows] == list(range(STEPS + 1))
    assert rows[0]["costs"] is None
    costs = np.sum([row["costs"] for row in rows[1:]], axis=0)
    np.testing.assert_allclose(costs, record.costs, rtol=1e-12)
    assert min(row["clearance"] for row in rows) == pytest.approx(record.smallest_distance)
    for row, s in zip(rows, record.states, strict=True):
        np.testing.assert_allclose(row["poses"], record.vehicles.poses(s))


def test_the_scenario_is_described(run: LiveRun, scenario: Scenario) -> None:
    described = told(run)[0]["scenario"]
    assert described["title"] == "test"
    assert (described["dt"], described["steps"]) == (scenario.dt, STEPS)
    players = described["players"]
    assert tuple(player["name"] for player in players) == scenario.game.players.names
    assert tuple(player["colour"] for player in players) == COLOURS[: len(players)]
    starts = np.array([player["start"] for player in players])
    (goals,) = np.array([player["goals"] for player in players]).swapaxes(0, 1)
    np.testing.assert_allclose(np.linalg.norm(starts, axis=1), 3.0)
    np.testing.assert_allclose(goals, -starts, atol=1e-9)  # on the other side of the circle


def test_nothing_is_sent_twice(run: LiveRun, scenario: Scenario) -> None:
    record = played(scenario)
    fill(run, record, end=4)
    run.add_belief(3, 7, {7: 0.75, 2: 0.25})
    run.add_solve_time("inference", 3, 1.5)
    run.add_trajectories([Trajectory("robot", 7, 0.75, np.ones((3, 2)))], [])
    first, mark = told(run)
    assert {"scenario", "states", "belief", "solves", "trajectories"} <= first.keys()
    assert first["belief"] == {"step": 3, "map": 7, "weights": [[2, 0.25], [7, 0.75]]}
    assert first["solves"] == [["inference", 3, 1.5]]
    assert first["trajectories"]["particles"][0]["points"] == [1.0] * 6
    second, mark = told(run, mark)
    assert second.keys() == {"run", "over", "paused", "age", "more"}
    fill(run, record, first=4, end=6)
    third, _ = told(run, mark)
    assert [row["step"] for row in third["states"]] == [4, 5]
    assert "scenario" not in third and "belief" not in third
    assert third["states"][0]["costs"] is not None
    # Another page, that is opened now, is told all of it.
    assert [row["step"] for row in told(run)[0]["states"]] == list(range(6))


def test_a_new_run_contains_nothing_of_the_last_one(run: LiveRun, scenario: Scenario) -> None:
    record = played(scenario)
    fill(run, record)
    run.add_belief(3, 7, {7: 1.0})
    run.add_solve_time("inference", 3, 1.5)
    run.add_trajectories([], [])
    before, mark = told(run)
    assert before["over"]
    run.begin()
    fill(run, record, end=2)
    update, _ = told(run, mark)
    assert update["run"] != before["run"]
    assert not update["over"]
    assert "scenario" in update
    assert [row["step"] for row in update["states"]] == [0, 1]
    assert not {"belief", "solves", "trajectories"} & update.keys()


def test_a_new_run_may_be_seen_from_a_later_step_on(run: LiveRun, scenario: Scenario) -> None:
    record = played(scenario)
    fill(run, record, end=4)
    before, mark = told(run)
    run.begin()
    fill(run, record, first=5, end=6)
    update, _ = run.since(mark)
    assert update["run"] > before["run"]
    assert [row["step"] for row in update["states"]] == [5]


def test_the_number_of_solve_times_is_bounded(run: LiveRun, scenario: Scenario) -> None:
    fill(run, played(scenario), end=1)
    for step in range(2):
        for node in range(live_run.MOST_SOLVERS):
            run.add_solve_time(f"node_{node}", step, 1.0)
    with pytest.raises(ValueError, match="solve times are known"):
        run.add_solve_time("another", 0, 1.0)


def test_the_cost_of_a_step_is_unknown_where_a_state_is_missing(
    run: LiveRun, scenario: Scenario
) -> None:
    record = played(scenario)
    fill(run, record, first=3, end=5)
    fill(run, record, first=7, end=9)
    rows = told(run)[0]["states"]
    assert [(row["step"], row["costs"] is None) for row in rows] == [
        (3, True), (4, False), (7, True), (8, False),
    ]  # fmt: skip


def test_a_long_history_comes_in_pieces(
    run: LiveRun, scenario: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live_run, "PIECE", 5)
    fill(run, played(scenario))
    steps, more, mark = [], True, Mark()
    while more:
        update, mark = told(run, mark)
        steps.append([row["step"] for row in update["states"]])
        more = update["more"]
    assert [len(piece) for piece in steps] == [5, 5, 3]
    assert [step for piece in steps for step in piece] == list(range(STEPS + 1))


def test_the_age_of_the_newest_state(run: LiveRun, scenario: Scenario) -> None:
    assert told(run)[0]["age"] is None
    fill(run, played(scenario), end=1)
    first = told(run)[0]["age"]
    time.sleep(0.05)
    assert 0 <= first <= told(run)[0]["age"] - 0.05


def test_a_pause_ends_when_the_run_resumes(
    run: LiveRun, scenario: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    record = played(scenario)
    fill(run, record, end=3)
    assert not told(run)[0]["paused"]
    run.set_paused(True)
    fill(run, record, first=3, end=4)  # it was on its way
    assert told(run)[0]["paused"]
    monkeypatch.setattr(live_run, "SETTLING", 0.0)
    assert told(run)[0]["paused"] is False
    run.set_paused(True)
    run.begin()
    fill(run, record, end=1)  # reset, but not resumed
    assert told(run)[0]["paused"]
    run.set_paused(False)
    assert not told(run)[0]["paused"]
    run.set_paused(True)
    fill(run, record, first=1, end=2)  # by another node
    assert not told(run)[0]["paused"]


def test_a_time_that_is_no_number_is_refused(run: LiveRun) -> None:
    with pytest.raises(ValueError, match="nan ms is not allowed"):
        run.add_solve_time("inference", 3, float("nan"))


def test_one_player_has_no_clearance(three_player: Scenario) -> None:
    content = three_player.model_dump()
    content["players"] = {"robot": content["players"]["robot"]}
    content["costs"] = content["costs"][:2]
    scenario = Scenario.model_validate(content)
    run = LiveRun(scenario, "alone", STEPS)
    fill(run, played(scenario))
    assert {row["clearance"] for row in told(run)[0]["states"]} == {None}


def test_pages_receive_radii_and_distances_from_edge_to_edge(three_player: Scenario) -> None:
    content = three_player.model_dump()
    content["players"]["human_1"]["radius"] = 0.4
    for scenario, radius in ((three_player, 0.0), (Scenario.model_validate(content), 0.4)):
        run = LiveRun(scenario, "test", STEPS)
        s = three_player.initial_vehicle_state.copy()
        s[[4, 5]] = s[[0, 1]] + np.array([0.6, 0.8])
        run.add_state(0, s, np.zeros(scenario.vehicles.n_inputs))
        update, _ = told(run)
        assert [p["radius"] for p in update["scenario"]["players"]] == [0.0, radius, 0.0]
        assert update["states"][0]["clearance"] == pytest.approx(1.0 - radius)
