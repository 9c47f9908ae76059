"""The record of a run, its figures and its views; the seeds of a run."""

from __future__ import annotations

import io
import json
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from gameinfer_ros.games import Game, QuadraticInput, Unicycle, Vehicles
from gameinfer_ros.runs import animation, picture
from gameinfer_ros.runs.progress import RunProgress
from gameinfer_ros.runs.record import MOST_MISSING, RunRecord
from gameinfer_ros.runs.seeds import RunSeeds
from gameinfer_ros.scenario import Scenario


@pytest.fixture
def record(two_player: Scenario) -> RunRecord:
    """Five steps of two players who turn and accelerate."""
    game, rng = two_player.game, np.random.default_rng(0)
    record = RunRecord(two_player.vehicles, [two_player.initial_state], late_steps=2)
    for step in range(5):
        record.inputs.append(rng.uniform(-1.0, 1.0, 4))
        record.states.append(game.step(record.states[-1], record.inputs[-1]))
        record.beliefs[step], record.maps[step] = {3: 0.25, 7: 0.75}, 7
    record.beliefs[5], record.maps[5] = {7: 0.4, 9: 0.6}, 7  # 9 is not settled
    return record


@pytest.fixture
def lonely() -> RunRecord:
    """One player who stands still for a step, without a belief."""
    game = Game({"robot": Unicycle()}, [QuadraticInput(weights=(1.0, 1.0))], 0.1, 5)
    return RunRecord(Vehicles(game), [np.zeros(4), np.zeros(4)], [np.zeros(2)])


def test_the_cost_is_the_sum_over_the_steps_that_were_played(record: RunRecord) -> None:
    expected = np.zeros(2)
    for step in range(5):
        x, u = record.states[step][None], record.inputs[step][None]
        expected += record.game.costs(x, u, step)[:, 0]
    assert record.steps == 5
    np.testing.assert_allclose(record.costs, expected, rtol=1e-12)
    # A state without an input was not played.
    record.states[-1] = record.states[-1] + 100.0
    np.testing.assert_allclose(record.costs, expected, rtol=1e-12)


def test_the_cost_is_that_of_what_the_game_sees_of_the_vehicles(
    flat_three_player: Scenario,
) -> None:
    vehicles, rng = flat_three_player.vehicles, np.random.default_rng(0)
    record = RunRecord(vehicles, [flat_three_player.initial_vehicle_state])
    expected = np.zeros(3)
    for step in range(4):
        s, w = record.states[-1], rng.uniform(-0.5, 0.5, vehicles.n_inputs)
        x, u = vehicles.game_state(s), vehicles.game_input(s, w)
        expected += record.game.costs(x[None], u[None], step)[:, 0]
        record.inputs.append(w)
        record.states.append(vehicles.step(s, w))
    np.testing.assert_allclose(record.costs, expected, rtol=1e-9)


def test_a_later_goal_counts_from_its_time_on(record: RunRecord) -> None:
    # 99 steps of standing at the start; the goal counts at the steps 99 and 100.
    x, u = record.states[0], np.zeros(4)
    costs = [RunRecord(record.vehicles, [x] * (n + 1), [u] * n).costs for n in (98, 99, 100, 101)]
    np.testing.assert_allclose(costs[0], costs[1])
    np.testing.assert_allclose(costs[2] - costs[1], 0.5 * 300 * 36, rtol=1e-9)  # 6 m away
    np.testing.assert_allclose(costs[3] - costs[2], 0.5 * 300 * 36, rtol=1e-9)


def test_the_smallest_distance_is_that_of_the_closest_moment(record: RunRecord) -> None:
    near = record.states[2].copy()
    near[[4, 5]] = near[[0, 1]] + np.array([0.3, -0.4])
    record.states[2] = near
    assert record.smallest_distance == pytest.approx(0.5)


def test_the_map_probability_is_that_of_the_last_belief(record: RunRecord) -> None:
    assert record.map_probability == 0.4


@pytest.mark.parametrize("number", [-1, 12])
def test_a_map_that_is_no_particle_has_no_probability(
    number: int, record: RunRecord, tmp_path: Path
) -> None:
    # There has never been one, or it has become one with another particle since.
    record.maps[5] = number
    assert record.map_probability == record.summary()["map_probability"] == 0.0
    record.save(tmp_path)
    with np.load(tmp_path / "run.npz") as saved:
        assert saved["maps"][-1].tolist() == [5, number]
    output = io.StringIO()
    with RunProgress(Console(file=output, width=200), 25) as progress:
        record.states += [record.states[-1]] * 10
        record.inputs += [record.inputs[-1]] * 10
        progress.show(record, None)
    told = f"MAP equilibrium {number} with probability 0.000"
    assert ("no equilibrium is known" if number < 0 else told) in output.getvalue()


def test_progress_does_not_take_an_old_belief_for_a_new_one(record: RunRecord) -> None:
    output = io.StringIO()
    with RunProgress(Console(file=output, width=200), 25) as progress:
        record.states += [record.states[-1]] * 15
        record.inputs += [record.inputs[-1]] * 15
        progress.show(record, "12.34")
    told = output.getvalue()
    assert "the newest belief is 1.5 s old" in told
    assert "MAP" not in told and "12.34" not in told


def test_the_figures_are_fit_for_json(record: RunRecord) -> None:
    summary = json.loads(json.dumps(record.summary(), allow_nan=False))
    assert list(summary) == [
        "cost",
        "smallest_distance",
        "steps",
        "late_steps",
        "missing_steps",
        "map_probability",
        "safety_braked",
        "safety_limited",
    ]
    assert summary["cost"] == record.costs.tolist()
    assert summary["smallest_distance"] == record.smallest_distance
    assert (summary["steps"], summary["late_steps"], summary["map_probability"]) == (5, 2, 0.4)


def test_one_player_has_no_distance_and_no_belief_no_probability(lonely: RunRecord) -> None:
    assert lonely.smallest_distance == np.inf
    summary = json.loads(json.dumps(lonely.summary(), allow_nan=False))
    assert summary["smallest_distance"] is None
    assert summary["map_probability"] is None
    assert summary["cost"] == [0.0]


def test_before_the_first_step_there_are_no_costs(two_player: Scenario) -> None:
    record = RunRecord(two_player.vehicles, [two_player.initial_state])
    assert record.steps == 0
    np.testing.assert_array_equal(record.costs, [0.0, 0.0])


def test_what_is_saved_is_what_happened(record: RunRecord, tmp_path: Path) -> None:
    record.step_ms = [1.5, 0.25]
    record.save(tmp_path)
    assert json.loads((tmp_path / "run.json").read_text()) == record.summary()
    loaded = RunRecord.load(tmp_path, record.vehicles)
    np.testing.assert_array_equal(loaded.states, record.states)
    np.testing.assert_array_equal(loaded.inputs, record.inputs)
    assert loaded.beliefs == record.beliefs
    assert loaded.maps == record.maps
    assert loaded.late_steps == record.late_steps
    assert loaded.step_ms == [1.5, 0.25]
    assert loaded.summary() == record.summary()


def test_figures_without_a_safety_layer_are_unknown_and_not_zero(
    record: RunRecord, tmp_path: Path
) -> None:
    record.safety_braked, record.safety_limited = 3, 1
    record.save(tmp_path)
    assert RunRecord.load(tmp_path, record.vehicles).safety_braked == 3
    summary = record.summary()
    del summary["safety_braked"], summary["safety_limited"]  # as before there was one
    (tmp_path / "run.json").write_text(json.dumps(summary))
    loaded = RunRecord.load(tmp_path, record.vehicles)
    assert (loaded.safety_braked, loaded.safety_limited) == (None, None)
    assert loaded.late_steps == record.late_steps


def test_a_record_without_beliefs_can_be_saved(lonely: RunRecord, tmp_path: Path) -> None:
    lonely.save(tmp_path)
    with np.load(tmp_path / "run.npz") as saved:
        assert saved["beliefs"].shape == (0, 3)
    assert RunRecord.load(tmp_path, lonely.vehicles).summary() == lonely.summary()


@pytest.mark.parametrize("which", ["record", "lonely"])
def test_a_picture_can_be_drawn_of_any_run(
    which: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    picture.draw(request.getfixturevalue(which), tmp_path / "picture.png", "a title")
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")


def test_progress_is_a_line_for_each_second_where_there_is_no_terminal(
    two_player: Scenario,
) -> None:
    output = io.StringIO()
    record = RunRecord(two_player.vehicles, [two_player.initial_state])
    with RunProgress(Console(file=output, width=200), 25) as progress:
        for step in range(25):
            record.inputs.append(np.zeros(4))
            record.states.append(two_player.initial_state)
            record.beliefs[step], record.maps[step] = {4: 0.3, 8: 0.7}, 8
            progress.show(record, "12.34")
            progress.show(record, "12.34")
    lines = output.getvalue().splitlines()
    assert [line.split(":")[0] for line in lines] == ["step 10/25", "step 20/25"]
    for word in ("t = 1.0 s", "MAP equilibrium 8", "0.700", "2 particles", "12.34 ms"):
        assert word in lines[0]


def test_a_run_has_independent_seeds_that_its_number_decides() -> None:
    seeds = [RunSeeds.of_run(number) for number in range(200)]
    assert seeds == [RunSeeds.of_run(number) for number in range(200)]
    every = [seed for run in seeds for seed in run]
    assert len(set(every)) == len(every) == 600
    assert all(type(seed) is int and 0 <= seed < 2**63 for seed in every)


def test_the_seeds_of_a_number_never_change() -> None:
    # Results that name a seed can be had again with any version.
    assert RunSeeds.of_run(0) == tuple(int(s) for s in np.random.SeedSequence(0).generate_state(3))
    assert RunSeeds.of_run(0) == (2968811710, 3677149159, 745650761)


def test_steps_whose_state_is_missing_count_for_nothing_but_themselves(
    two_player: Scenario, tmp_path: Path
) -> None:
    s, nw = two_player.initial_vehicle_state, two_player.vehicles.n_inputs
    rng = np.random.default_rng(0)
    whole, gappy = RunRecord(two_player.vehicles), RunRecord(two_player.vehicles)
    for step in range(6):
        s, w = s + rng.uniform(-0.1, 0.1, len(s)), rng.uniform(-0.1, 0.1, nw)
        whole.add_state(step, s, w)
        if step not in (2, 3):
            gappy.add_state(step, s, w)
    assert (whole.missing_steps, gappy.missing_steps) == (0, 2)
    assert whole.steps == gappy.steps == 5
    np.testing.assert_array_equal(gappy.inputs[4], whole.inputs[4])
    x, u = np.array(whole.states), np.array([*whole.inputs, np.zeros(nw)])
    costs = two_player.game.costs(x, u)  # its players are what they are in the game
    np.testing.assert_allclose(gappy.costs, costs[:, [0, 4]].sum(axis=1), rtol=1e-12)
    distances = two_player.vehicles.distances(x)
    assert gappy.smallest_distance == distances[[0, 1, 4, 5]].min()
    json.dumps(gappy.summary(), allow_nan=False)
    # Pictures and animations show what is known.
    picture.draw(gappy, tmp_path / "gappy.png", "gappy")
    animation.draw(gappy, tmp_path / "gappy.gif", "gappy", Console(quiet=True))
    assert (tmp_path / "gappy.png").stat().st_size > 1000
    assert (tmp_path / "gappy.gif").stat().st_size > 1000


def test_missing_states_take_next_to_no_memory_and_are_not_without_bound(
    two_player: Scenario,
) -> None:
    s, w = two_player.initial_vehicle_state, np.zeros(two_player.vehicles.n_inputs)
    record, added = RunRecord(two_player.vehicles), 0
    with pytest.raises(ValueError, match=f"at most {MOST_MISSING} may be"):
        for step in range(50, 2 * MOST_MISSING, 50_000):
            record.add_state(step, s.copy(), w.copy())
            added += 1
    assert record.missing_steps == len(record.states) - added <= MOST_MISSING
    assert record.missing_steps > MOST_MISSING - 50_000
    arrays = {id(array) for array in (*record.states, *record.inputs)}
    assert len(arrays) <= 4 * added
    tracemalloc.start()
    assert record.summary()["cost"] == [0.0, 0.0]  # no state has one before it
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 50e6
    # What follows without a gap still has its place.
    record.add_state(len(record.states), s, w)
    with pytest.raises(ValueError, match=f"must be later than step {len(record.states) - 1}"):
        record.add_state(50, s, w)


def test_distances_are_from_edge_to_edge(two_player: Scenario) -> None:
    content = two_player.model_dump()
    for name, radius in (("robot", 0.2), ("human_1", 0.35)):
        content["players"][name]["radius"] = radius
    s = two_player.initial_vehicle_state.copy()
    s[[4, 5]] = s[[0, 1]] + np.array([0.3, -0.4])
    found = [RunRecord(of.vehicles, [s]) for of in (two_player, Scenario.model_validate(content))]
    assert [r.smallest_distance for r in found] == [pytest.approx(0.5), pytest.approx(-0.05)]
    assert found[1].summary()["smallest_distance"] == pytest.approx(-0.05)
