"""The method `newton`: stationary, at minima, and the same in whatever units."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from solving import GameFactory, HeadOn, Start, random_inputs, solve

from gameinfer_ros.games import Game
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import (
    GameSolver,
    Solution,
    SolverSettings,
    Status,
    Strategy,
    best_response,
    newton_search,
)

NEWTON: dict[str, Any] = {"method": "newton"}


@pytest.fixture
def crossing(make_game: GameFactory, start: Start) -> tuple[Game, np.ndarray, np.ndarray]:
    game = make_game("udu", horizon=25)
    return game, start(game), random_inputs(game, 20)


def test_converged_players_are_at_minima_of_their_own_costs(
    crossing: tuple[Game, np.ndarray, np.ndarray],
) -> None:
    game, x0, u = crossing
    solution = solve(game, x0, u, **NEWTON)
    assert solution.converged.mean() >= 0.9
    found = np.flatnonzero(solution.converged)
    assert (solution.residual[found] <= 1e-4).all()
    assert (solution.pivot[:, found] > 0.0).all()
    for particle in found[:6]:
        strategy = solution.strategy.take(np.array([particle]))
        for i in range(len(game.players)):
            assert best_response(game, x0, strategy, i).relative_gap < 1e-5


@pytest.mark.parametrize("factor", [1e-3, 0.3, 1e3])
def test_the_size_of_the_costs_does_not_matter(head_on: HeadOn, factor: float) -> None:
    (game, x0), (scaled, _) = head_on(), head_on(scale=factor)
    u = random_inputs(game, 16, size=1.0)
    one, other = solve(game, x0, u, **NEWTON), solve(scaled, x0, u, **NEWTON)
    check_alike(one, other, one.strategy.x_ref, other.strategy.x_ref)


def test_the_unit_of_lengths_does_not_matter(head_on: HeadOn) -> None:
    (game, x0), (in_feet, x0_in_feet) = head_on(), head_on(metre=3.28)
    u = random_inputs(game, 16, size=1.0)
    longer = u * np.tile([1.0, 3.28], 2)[:, None]
    one, other = solve(game, x0, u, **NEWTON), solve(in_feet, x0_in_feet, longer, **NEWTON)
    in_metres = np.tile([3.28, 3.28, 1.0, 3.28], 2)[:, None]
    check_alike(one, other, one.strategy.x_ref, other.strategy.x_ref / in_metres)


def test_the_order_of_the_players_does_not_matter(head_on: HeadOn) -> None:
    (game, x0), (swapped, x0_swapped) = head_on(), head_on(names="ba")
    u = random_inputs(game, 16, size=1.0)
    one, other = (
        solve(game, x0, u, **NEWTON),
        solve(swapped, x0_swapped, u[:, [2, 3, 0, 1]], **NEWTON),
    )
    check_alike(one, other, one.strategy.x_ref, np.roll(other.strategy.x_ref, 4, axis=1))


def check_alike(one: Solution, other: Solution, x: np.ndarray, x_other: np.ndarray) -> None:
    """The same, but for a few particles that rounding carries elsewhere."""
    assert (one.status == other.status).mean() >= 0.9
    assert (np.abs(x - x_other).max(axis=(0, 1)) < 1e-3).mean() >= 0.9
    assert abs(np.mean(other.iterations) / np.mean(one.iterations) - 1.0) <= 0.1


def test_a_power_of_four_changes_nothing_at_all(head_on: HeadOn) -> None:
    (game, x0), (scaled, _) = head_on(), head_on(scale=2.0**-10)
    u = random_inputs(game, 9, size=1.0)
    check_same(solve(game, x0, u, **NEWTON), solve(scaled, x0, u, **NEWTON))


def test_the_start_of_the_clock_does_not_matter(
    crossing: tuple[Game, np.ndarray, np.ndarray],
) -> None:
    game, x0, u = crossing
    # The goals of this game are active at the end of the horizon, whatever follows.
    late = Game(
        dict(zip(game.players.names, game.players.dynamics, strict=True)),
        [t.model_copy(update={"active_from": t.active_from + 4.0}) if t.kind == "goal" else t
         for t in {id(b.term): b.term for terms in game.terms for b in terms}.values()],
        game.dt,
        game.horizon,
    )  # fmt: skip
    one, other = solve(game, x0, u, **NEWTON), solve(late, x0, u, first_step=40, **NEWTON)
    check_same(one, other)


def test_a_particle_does_not_depend_on_the_others_nor_on_threads(
    crossing: tuple[Game, np.ndarray, np.ndarray],
) -> None:
    game, x0, u = crossing
    together = solve(game, x0, u, **NEWTON)
    check_same(together, solve(game, x0, u, threads=3, **NEWTON))
    for particle in range(4):
        alone = solve(game, x0, u[..., [particle]], **NEWTON)
        one = together.strategy.take(np.array([particle]))
        for mine, theirs in zip(alone.strategy.arrays, one.arrays, strict=True):
            np.testing.assert_array_equal(mine, theirs)
        assert alone.iterations[0] == together.iterations[particle]


def check_same(one: Solution, other: Solution) -> None:
    np.testing.assert_array_equal(one.status, other.status)
    np.testing.assert_array_equal(one.iterations, other.iterations)
    for mine, theirs in zip(one.strategy.arrays, other.strategy.arrays, strict=True):
        np.testing.assert_array_equal(mine, theirs)


# --- Saddles -----------------------------------------------------------------------------------


def aside(solution: Solution) -> float:
    """Largest distance of the first player from the straight line to its goal."""
    return float(np.abs(solution.strategy.x_ref[:, 1, 0]).max())


def test_players_that_block_each_other_are_at_a_saddle_and_leave_it(
    head_on: HeadOn, monkeypatch: pytest.MonkeyPatch
) -> None:
    game, x0 = head_on()
    straight_on = np.zeros((game.horizon, 4, 1))
    left = solve(game, x0, straight_on, **NEWTON)
    assert left.converged[0] and aside(left) > 0.1
    monkeypatch.setattr(newton_search, "_ESCAPES", np.zeros(0))
    stayed = solve(game, x0, straight_on, **NEWTON)
    assert stayed.status[0] == Status.SADDLE and not stayed.converged[0]
    assert aside(stayed) < 1e-6
    assert (stayed.pivot[:, 0] <= 0.0).any()
    player = int(np.argmin(stayed.pivot[:, 0] > 0.0))
    assert stayed.reason(0).startswith("saddle: ")
    assert f"player {player} is not at a minimum: at step " in stayed.reason(0)
    gaps = [best_response(game, x0, stayed.strategy, i).relative_gap for i in range(2)]
    assert max(gaps) > 0.01


# --- Bounds ------------------------------------------------------------------------------------


def test_an_iteration_limit_is_reported_with_the_residual(
    crossing: tuple[Game, np.ndarray, np.ndarray],
) -> None:
    game, x0, u = crossing
    solution = solve(game, x0, u, max_iterations=3, **NEWTON)
    assert (solution.iterations <= 3).all()
    stopped = np.flatnonzero(solution.status == Status.ITERATION_LIMIT)
    assert len(stopped)
    reason = solution.reason(int(stopped[0]))
    assert reason == (
        f"iteration limit: after iteration 3, the residual is {solution.residual[stopped[0]]:.3g}"
    )


def test_a_deadline_that_has_passed_leaves_every_particle_unreached(
    crossing: tuple[Game, np.ndarray, np.ndarray],
) -> None:
    game, x0, u = crossing
    solver = GameSolver(game, SolverSettings(**NEWTON))
    solution = solver.solve(x0, Strategy.from_inputs(0, x0, u), deadline=0.0)
    assert (solution.status == Status.NOT_REACHED).all()


def test_a_warm_start_at_an_equilibrium_needs_few_iterations(
    crossing: tuple[Game, np.ndarray, np.ndarray],
) -> None:
    game, x0, u = crossing
    solver = GameSolver(game, SolverSettings(**NEWTON))
    first = solver.solve(x0, Strategy.from_inputs(0, x0, u))
    found = np.flatnonzero(first.converged)
    again = solver.solve(x0, first.strategy.take(found))
    assert again.converged.all()
    assert np.median(again.iterations) < 0.5 * np.median(first.iterations[found])


def test_seeds_that_are_not_numbers_are_reported(
    crossing: tuple[Game, np.ndarray, np.ndarray],
) -> None:
    game, x0, u = crossing
    u = u.copy()
    u[3, 0, 5] = np.nan
    solution = solve(game, x0, u, **NEWTON)
    assert solution.status[5] == Status.NOT_FINITE
    check = np.delete(np.arange(20), 5)
    rest = solve(game, x0, u[..., check], **NEWTON)
    np.testing.assert_array_equal(rest.status, solution.status[check])


@pytest.mark.parametrize("name", ["two_player", "three_player"])
def test_every_seed_of_the_shipped_scenarios_converges(
    name: str, request: pytest.FixtureRequest
) -> None:
    scenario: Scenario = request.getfixturevalue(name)
    u = scenario.seeds.sample(np.random.default_rng(0), scenario.game.players, scenario.horizon, 32)
    solution = solve(scenario.game, scenario.initial_state, u, **NEWTON)
    assert solution.converged.all()
