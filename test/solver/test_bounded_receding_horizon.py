"""Receding horizons with a deadline, an order, or a cap on the iterations."""

from __future__ import annotations

import numpy as np
import pytest
from followed import Followed
from scripted import Scripted
from solving import PAPER, paper
from strategies import assert_same, assert_same_particle

from gameinfer_ros.games import Game
from gameinfer_ros.solver import GameSolver, Strategy


@pytest.fixture
def moved(x0: np.ndarray) -> np.ndarray:
    """An unexpected state at step 1."""
    return x0 + 0.2 * np.cos(np.arange(8))


#: No iteration moves a state by as little as this: nothing ever converges.
NEVER = paper(max_iterations=6, converged_movement=1e-300)


def solved_once(solver: Scripted, seeds: np.ndarray, x0: np.ndarray) -> Followed:
    """A horizon that has been solved at step 0."""
    made = Followed(solver, seeds)
    made.solve(0, x0)
    return made


@pytest.fixture
def never(game: Game) -> Scripted:
    return Scripted(game, NEVER)


@pytest.fixture
def hopeless(never: Scripted, seeds: np.ndarray, x0: np.ndarray) -> Followed:
    return solved_once(never, seeds, x0)


def test_a_particle_that_is_not_reached_keeps_its_strategy(
    unsolved: Followed, solver: Scripted, x0: np.ndarray, moved: np.ndarray, game: Game
) -> None:
    horizon = unsolved
    solver.failures = [[1], [0]]
    first = horizon.solve(0, x0)
    assert horizon.updated.all() and list(horizon.converged) == [True, False, True]
    for step in (1, 2):
        strategy = horizon.solve(step, moved, deadline=-np.inf)
        assert_same(strategy, first.advanced(step))
        assert not horizon.updated.any() and not horizon.iterations.any()
        assert list(horizon.converged) == [True, False, True], "as its newest strategy"
    assert len(solver.calls) == 2 + 2, "no particle that was not reached is lost"
    # The next call continues as if there had been none in between.
    strategy = horizon.solve(3, moved)
    assert horizon.updated.all() and horizon.converged.all()
    assert_same(strategy, GameSolver(game, PAPER).solve(moved, first.advanced(3)).strategy)


@pytest.mark.parametrize("step", [20, 35])
def test_the_first_solve_and_one_past_the_horizon_are_not_bounded(
    step: int, unsolved: Followed, seeds: np.ndarray, x0: np.ndarray, game: Game
) -> None:
    for start in (0, step):
        strategy = unsolved.solve(start, x0, None, 1, -np.inf)
        assert unsolved.updated.all() and unsolved.converged.all()
        expected = GameSolver(game, PAPER).solve(x0, Strategy.from_inputs(start, x0, seeds))
        assert_same(strategy, expected.strategy)
        np.testing.assert_array_equal(unsolved.iterations, expected.iterations)


def test_the_order_and_the_deadline_are_those_of_the_solver(
    unsolved: Followed, solver: Scripted, x0: np.ndarray
) -> None:
    order = np.array([2, 0, 1])
    unsolved.solve(0, x0, order)
    np.testing.assert_array_equal(solver.bounds[-1][0], order)
    unsolved.solve(1, x0, order, 3, 1e300)
    np.testing.assert_array_equal(solver.bounds[-1][0], order)
    np.testing.assert_array_equal(solver.bounds[-1][1], [3, 3, 3])
    assert solver.bounds[-1][2] == 1e300


@pytest.mark.parametrize("cap", [1, 2, 3])
def test_capped_calls_come_to_the_same_as_one_that_is_not(
    cap: int, game: Game, seeds: np.ndarray, x0: np.ndarray, moved: np.ndarray
) -> None:
    capped, whole = (Followed(GameSolver(game, PAPER), seeds) for _ in range(2))
    first = whole.solve(0, x0)
    assert_same(capped.solve(0, x0), first)
    expected = whole.solve(1, moved)
    assert whole.iterations.max() > cap
    total, found = np.zeros(3, dtype=int), {}
    for _ in range(60):
        strategy = capped.solve(1, moved, max_iterations=cap)
        assert capped.updated.all() and (capped.iterations <= cap).all()
        for k in np.flatnonzero([k not in found for k in range(3)]).tolist():
            total[k] += capped.iterations[k]
            assert capped.converged[k] == (total[k] == whole.iterations[k])
            if capped.converged[k]:
                found[k] = strategy.take([k])
        if len(found) == 3:
            break
    for k in range(3):
        assert_same_particle(found[k], 0, expected, k)


def test_what_a_capped_call_leaves_is_where_the_next_one_begins(
    solver: Scripted, horizon: Followed, game: Game, moved: np.ndarray
) -> None:
    first = horizon.strategy
    strategy = horizon.solve(1, moved, max_iterations=1)
    assert not horizon.converged.any() and horizon.updated.all()
    expected = GameSolver(game, PAPER).solve(moved, first.advanced(1), max_iterations=1).strategy
    assert_same(strategy, expected)
    horizon.solve(2, moved, max_iterations=1)
    assert_same(solver.calls[-1], expected.advanced(2))
    assert len(solver.calls) == 3, "none was lost"


def test_more_is_not_granted_than_the_settings_allow(
    never: Scripted, hopeless: Followed, moved: np.ndarray
) -> None:
    hopeless.solve(1, moved, max_iterations=100)
    assert (hopeless.iterations == 6).all()
    assert all((np.asarray(bounds[1]) == 6).all() for bounds in never.bounds)


def test_a_particle_is_lost_after_as_many_iterations_in_a_row_as_the_settings_allow(
    never: Scripted, hopeless: Followed, game: Game, moved: np.ndarray
) -> None:
    assert len(never.calls) == 2, "the first call used up all that is allowed"
    # 6 iterations are 2, 2 and 2; a call that reaches no particle does not count.
    for deadline, calls in ((np.inf, 3), (np.inf, 4), (-np.inf, 5)):
        last = hopeless.strategy
        strategy = hopeless.solve(1, moved, None, 2, deadline)
        assert len(never.calls) == calls
        if deadline > 0:
            expected = GameSolver(game, NEVER).solve(moved, last.advanced(1), None, 2)
            assert_same(strategy, expected.strategy)
    hopeless.solve(1, moved, max_iterations=2)
    assert len(never.calls) == 7, "now all are lost"
    assert not never.calls[-1].u_ref.any() and len(never.calls[-1]) == 1
    assert not hopeless.converged.any() and hopeless.updated.all()


def test_a_lost_particle_goes_on_from_the_zero_seed_as_far_as_the_cap_allows(
    never: Scripted, hopeless: Followed, game: Game, moved: np.ndarray
) -> None:
    for _ in range(3):
        strategy = hopeless.solve(1, moved, max_iterations=2)
    zero = Strategy.from_inputs(1, moved, np.zeros((20, 4, 1)))
    begun = GameSolver(game, NEVER).solve(moved, zero, max_iterations=2).strategy
    for k in range(3):
        assert_same_particle(strategy, k, begun, 0)
    # It goes on where it began, and counts from the start again: 2, 4, and at 6 it is lost.
    never.calls.clear()
    for calls in (1, 2, 4):
        hopeless.solve(1, moved, max_iterations=2)
        assert len(never.calls) == calls
    assert_same_particle(never.calls[0], 0, begun.advanced(1), 0)


def test_a_lost_particle_that_the_zero_seed_solves_is_converged_and_restarts(
    solver: Scripted, horizon: Followed, game: Game, moved: np.ndarray
) -> None:
    solver.failures = [[1]]
    strategy = horizon.solve(1, moved, max_iterations=100)
    zero = Strategy.from_inputs(1, moved, np.zeros((20, 4, 1)))
    assert_same_particle(strategy, 1, GameSolver(game, PAPER).solve(moved, zero).strategy, 0)
    assert horizon.converged.all() and horizon.updated.all()


def test_a_lost_particle_whose_zero_seed_fails_keeps_its_strategy_under_a_cap_too(
    solver: Scripted, horizon: Followed, game: Game, moved: np.ndarray
) -> None:
    first = horizon.strategy
    solver.failures = [[1], [0]]
    strategy = horizon.solve(1, moved, max_iterations=2)
    kept = solver.play_out(moved, first.advanced(1))
    assert_same_particle(strategy, 1, kept, 1)
    assert not horizon.converged[1] and horizon.updated[1]
    warm = GameSolver(game, PAPER).solve(moved, first.advanced(1), max_iterations=2).strategy
    assert_same(strategy.take([0, 2]), warm.take([0, 2]))


def test_convergence_ends_the_row(
    game: Game, seeds: np.ndarray, x0: np.ndarray, moved: np.ndarray
) -> None:
    solver = Scripted(game, paper(max_iterations=20))
    horizon = solved_once(solver, seeds, x0)
    # The players are pushed to and fro, and found again each time: that takes far more iterations
    # than 20 in all, but never in a row.
    total = 0
    for x in (moved, x0) * 6:
        for _ in range(10):
            horizon.solve(0, x, max_iterations=2)
            total += int(horizon.iterations[0])
        assert horizon.converged.all()
    assert total > 3 * 20
    assert all(len(call) == 3 for call in solver.calls), "none was lost"


def test_particles_that_are_kept_keep_their_count(
    never: Scripted, hopeless: Followed, moved: np.ndarray
) -> None:
    for _ in range(2):
        hopeless.solve(1, moved, max_iterations=2)
    hopeless.take([2, 0])
    assert len(hopeless.updated) == len(hopeless.iterations) == len(hopeless.converged) == 2
    calls = len(never.calls)
    hopeless.solve(1, moved, max_iterations=2)
    assert len(never.calls) == calls + 2, "both are lost after 4 + 2 iterations"


def test_patience_is_for_light_particles_and_not_for_those_who_are_granted_more(
    game: Game, seeds: np.ndarray, x0: np.ndarray, moved: np.ndarray
) -> None:
    never = paper(max_iterations=20, converged_movement=1e-300)
    solver = Scripted(game, never)
    horizon = Followed(solver, seeds, patience=4)
    horizon.solve(0, x0)
    solver.calls.clear()
    granted = np.array([2, 10, 2])
    # One is lost after its 10 iterations at once, the others after 2 + 2.
    for calls in (2, 4):
        horizon.solve(1, moved, None, granted)
        assert len(solver.calls) == calls
    assert list(horizon.iterations) == [2, 10, 2]


def test_the_zero_seed_has_the_same_deadline(
    solver: Scripted, horizon: Followed, moved: np.ndarray
) -> None:
    solver.failures = [[1]]
    horizon.solve(1, moved, None, None, 1e300)
    assert [bounds[2] for bounds in solver.bounds[-2:]] == [1e300, 1e300]
