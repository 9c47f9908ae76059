"""The published scenarios have the equilibria that they are known to have."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.cluster.hierarchy import fcluster, linkage

from gameinfer_ros.games import Players
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import GameSolver, Solution, Status

SEEDS = 256
SolutionOf = Callable[..., Solution]


@pytest.fixture(params=["two_player", "three_player", "flat_three_player"])
def case(request: pytest.FixtureRequest, solution_of: SolutionOf) -> tuple[Scenario, Solution]:
    scenario = request.getfixturevalue(request.param)
    return scenario, solution_of(scenario)


def usable(scenario: Scenario, solution: Solution) -> np.ndarray:
    """Indices of the particles that converged to a trajectory without a collision."""
    radius = next(term.radius for term in scenario.costs if term.kind == "proximity")
    x = np.moveaxis(solution.strategy.x_ref, 2, 0)
    distance = scenario.game.players.distances(x).min(axis=(1, 2))
    return np.flatnonzero(solution.converged & (distance >= radius / 2))


def clusters(players: Players, x: np.ndarray) -> np.ndarray:
    """Cluster (K,) of each of the trajectories (K, T + 1, nx)."""
    positions = players.positions(x).reshape(len(x), -1)
    # In units of the mean distance per step: 0.24 at most within the clusters of a correct
    # implementation, and 1.19 at least between them.
    heights = 0.6 * np.sqrt(x.shape[1])
    return fcluster(linkage(positions, "average"), heights, "distance")


def passing_sides(players: Players, x: np.ndarray) -> np.ndarray:
    """For each pair (i, j), whether i sees j pass to the left (1) or to the right (-1): (K, pairs).

    Each player ends opposite of its start, so the line from one player to another makes
    half a turn, in one of two senses. These are the topologically different ways to pass.
    """
    first, second = np.triu_indices(len(players), k=1)
    positions = players.positions(x)
    line = positions[..., second, :] - positions[..., first, :]
    angle = np.unwrap(np.arctan2(line[..., 1], line[..., 0]), axis=1)
    turn = angle[:, -1] - angle[:, 0]
    np.testing.assert_allclose(np.abs(turn), np.pi, atol=0.3)
    return np.sign(turn).astype(int)


def test_nearly_all_seeds_find_a_way_soon(case: tuple[Scenario, Solution]) -> None:
    scenario, solution = case
    assert solution.converged.mean() >= 0.98
    assert len(usable(scenario, solution)) >= 0.97 * SEEDS
    assert 15 <= solution.iterations.mean() <= 30


def test_there_is_one_cluster_for_each_way_to_pass(case: tuple[Scenario, Solution]) -> None:
    scenario, solution = case
    players = scenario.game.players
    x = np.moveaxis(solution.strategy.x_ref, 2, 0)[usable(scenario, solution)]
    found, sides = clusters(players, x), passing_sides(players, x)
    assert len(np.unique(found)) == {2: 2, 3: 8}[len(players)]
    ways = {label: np.unique(sides[found == label], axis=0).tolist() for label in np.unique(found)}
    assert all(len(way) == 1 for way in ways.values()), "a cluster must be one way to pass"
    assert len(np.unique([way[0] for way in ways.values()], axis=0)) == len(ways)


@pytest.mark.parametrize("name", ["three_player", "flat_three_player"])
def test_circular_equilibria_cost_all_players_least(
    name: str, request: pytest.FixtureRequest, solution_of: SolutionOf
) -> None:
    scenario = request.getfixturevalue(name)
    solution = solution_of(scenario)
    chosen, game = usable(scenario, solution), scenario.game
    strategy = solution.strategy.take(chosen)
    x = np.moveaxis(strategy.x_ref, 2, 0)
    found, sides = clusters(game.players, x), passing_sides(game.players, x)
    costs = game.costs(strategy.x_ref, strategy.u_ref).sum(axis=1)
    median = {label: np.median(costs[:, found == label], axis=1) for label in np.unique(found)}
    by_cost = sorted(median, key=lambda label: median[label].sum())
    for label in by_cost[:2]:
        assert (np.abs(sides[found == label].sum(axis=1)) == 3).all(), "all pass on one side"
        for other in by_cost[2:]:
            assert (median[label] < median[other]).all()
    # One circle is the mirror image of the other, and no player is special in it.
    np.testing.assert_allclose(median[by_cost[0]], median[by_cost[1]], rtol=0.02)
    np.testing.assert_allclose(median[by_cost[0]], median[by_cost[0]].mean(), rtol=0.02)


def test_flat_equilibria_cost_what_they_are_known_to(
    flat_three_player: Scenario, solution_of: SolutionOf
) -> None:
    solution, game = solution_of(flat_three_player), flat_three_player.game
    chosen = usable(flat_three_player, solution)
    strategy = solution.strategy.take(chosen)
    costs = game.costs(strategy.x_ref, strategy.u_ref).sum(axis=1)
    assert costs.min() > 830
    assert costs.max() < 1150
    x = np.moveaxis(strategy.x_ref, 2, 0)
    found = clusters(game.players, x)
    medians = [np.median(costs[:, found == label], axis=1) for label in np.unique(found)]
    by_cost = np.array(sorted(np.sort(median).tolist() for median in medians))
    np.testing.assert_allclose(by_cost[:2], 871, rtol=0.01)
    np.testing.assert_allclose(by_cost[2:], [[936, 1004, 1106]] * 6, rtol=0.015)


def test_nearly_all_seeds_of_five_flat_players_find_a_way(
    five_player: Scenario, solution_of: SolutionOf
) -> None:
    scenario, solution = five_player, solution_of(five_player, 96)
    assert solution.converged.mean() >= 0.95
    assert 30 <= solution.iterations.mean() <= 50
    assert len(usable(scenario, solution)) >= 0.9 * 96


def test_a_warm_start_on_the_solution_takes_few_iterations(case: tuple[Scenario, Solution]) -> None:
    scenario, solution = case
    solver = GameSolver(scenario.game, scenario.solver)
    players = scenario.game.players
    for k in usable(scenario, solution)[:12]:
        strategy = solution.strategy.take([k])
        for step in (1, 2, 30):
            # A few millimetres off, as after a real step.
            x = strategy.x_ref[step, :, 0] + 0.003 * np.sin(np.arange(players.n_states))
            again = solver.solve(x, strategy.advanced(step))
            assert again.status[0] == Status.CONVERGED
            assert 1 <= again.iterations[0] <= (3 if step < 30 else 6)
            both = np.stack([again.strategy.x_ref[: 101 - step, :, 0], strategy.x_ref[step:, :, 0]])
            assert np.abs(both[0] - both[1]).max() < 1.0, "it must stay the same equilibrium"
