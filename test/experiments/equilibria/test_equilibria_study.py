"""The study of equilibria."""

from __future__ import annotations

import numpy as np
import pytest
from study_rows import rows_of

from gameinfer_ros.experiments.equilibria.equilibria_study import EquilibriaStudy
from gameinfer_ros.experiments.study import Rows
from gameinfer_ros.planning import EquilibriumPlayer
from gameinfer_ros.runs.seeds import RunSeeds
from gameinfer_ros.scenario import Scenario


@pytest.fixture(scope="module")
def study(three_player: Scenario) -> EquilibriaStudy:
    return EquilibriaStudy(three_player)


@pytest.fixture(scope="module")
def rows(study: EquilibriaStudy) -> Rows:
    return rows_of(study, range(64))


def test_three_players_have_eight_clusters(study: EquilibriaStudy, rows: Rows) -> None:
    figures = study.figures(rows)
    clusters = figures["clusters"]
    assert len(clusters) == 8
    costs = [cluster["median_cost"] for cluster in clusters]
    assert [cost[0] for cost in costs] == sorted(cost[0] for cost in costs)
    # Two circular ones are the cheapest for all players.
    assert np.max(costs[:2]) < np.min(costs[2:])
    assert sum(c["size"] for c in clusters) + figures["collided"] == figures["samples"] == 64
    assert all(cluster["smallest_distance"] > 1.1 for cluster in clusters)
    seeds = [seed for cluster in clusters for seed in cluster["seeds"]]
    assert len(seeds) == len(set(seeds))


def test_k_means_with_eight_clusters_agrees(
    three_player: Scenario, study: EquilibriaStudy, rows: Rows
) -> None:
    found = {tuple(c["seeds"]) for c in study.figures(rows)["clusters"]}
    given = EquilibriaStudy(three_player, clusters=8).figures(rows)["clusters"]
    assert {tuple(c["seeds"]) for c in given} == found


def test_a_run_is_what_the_humans_of_the_closed_loop_agree_on(
    study: EquilibriaStudy, rows: Rows
) -> None:
    scenario = study.scenario
    rng = np.random.default_rng(RunSeeds.of_run(5).humans)
    player = EquilibriumPlayer(study._solver, scenario.seeds, rng)
    strategy = player.solve(0, scenario.initial_state)
    positions = scenario.game.players.positions(strategy.x_ref[::5, :, 0])
    np.testing.assert_allclose(study.trajectories([rows[5]])[0], positions, atol=1e-3)
    assert int(rows[5]["iterations"]) == player.iterations


def test_collisions_and_failures_are_left_out(study: EquilibriaStudy, rows: Rows) -> None:
    before = study.figures(rows)
    changed = [dict(row) for row in rows]
    victims = [cluster["seeds"][0] for cluster in before["clusters"][:2]]
    changed[victims[0]]["smallest_distance"] = "0.7499"
    changed[victims[1]]["status"] = "iteration_limit"
    after = study.figures(changed)
    assert study.collision_distance == 0.75
    assert after["collided"] == before["collided"] + 1
    assert after["not_converged"] == before["not_converged"] + 1
    left = [seed for cluster in after["clusters"] for seed in cluster["seeds"]]
    assert not set(victims) & set(left)


def test_where_all_runs_fail_there_are_no_clusters(study: EquilibriaStudy, rows: Rows) -> None:
    failed = [{**row, "status": "not_finite"} for row in rows]
    figures = study.figures(failed)
    assert figures["clusters"] == []
    assert figures["not_converged"] == 64
    assert figures["median_iterations"] is None
    study.draw(failed, figures)
    study.tables(figures)


def test_positions_begin_where_the_players_do(study: EquilibriaStudy, rows: Rows) -> None:
    start = study.scenario.vehicles.positions(study.scenario.initial_vehicle_state)
    trajectories = study.trajectories(rows)
    assert trajectories.shape == (64, 21, 3, 2)
    np.testing.assert_allclose(trajectories[:, 0], np.broadcast_to(start, (64, 3, 2)), atol=1e-3)
    initial = study.initial_trajectories([0, 1])
    assert initial.shape == (2, 21, 3, 2)
    np.testing.assert_allclose(initial[0, 0], start, atol=1e-9)
    # A seed goes forward and stops at the end of the horizon, a metre or two further.
    moved = np.linalg.norm(initial[:, -1] - initial[:, 0], axis=-1)
    assert ((moved > 0.5) & (moved < 3.5)).all()


def test_deeper_colours_cost_more(study: EquilibriaStudy, rows: Rows) -> None:
    figure = study.draw(rows, study.figures(rows))
    panels = {axes.get_title().split(":")[0]: axes for axes in figure.axes}
    assert set(panels) == {*"12345678", "rollout of the initial strategies"}

    def depth(cluster: str) -> float:
        """How far from white the robot's trajectories are, which are drawn first."""
        lines = [line for line in panels[cluster].lines if len(line.get_xdata()) == 21]
        return float(np.mean([1 - np.mean(line.get_color()) for line in lines[: len(lines) // 3]]))

    depths = [depth(cluster) for cluster in "12345678"]
    assert np.max(depths[:2]) < np.min(depths[2:6]) < np.max(depths[2:6]) < np.min(depths[6:])
