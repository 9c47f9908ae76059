from __future__ import annotations

import numpy as np
import pytest
from followed import Followed
from scripted import Scripted, check_same

from gameinfer_ros.games import Game
from gameinfer_ros.solver import (
    IterativeLQ,
    SolverSettings,
    Strategy,
)


def test_nothing_is_known_before_the_first_solve(solver: Scripted, seeds: np.ndarray) -> None:
    horizon = Followed(solver, seeds)
    assert len(horizon) == 3
    assert horizon.strategy is None and not horizon.iterations.any()
    assert not horizon.converged.any()


def test_the_first_solve_starts_from_the_seeds(
    solver: Scripted, seeds: np.ndarray, x0: np.ndarray, game: Game
) -> None:
    horizon = Followed(solver, seeds)
    strategy = horizon.solve(7, x0)
    assert strategy is horizon.strategy
    assert strategy.first_step == 7
    assert horizon.converged.all()
    expected = IterativeLQ(game).solve(x0, Strategy.from_inputs(7, x0, seeds)).strategy
    for k in range(3):
        check_same(strategy, expected, k, k)


def test_later_solves_start_from_the_last_strategies(
    solver: Scripted, seeds: np.ndarray, x0: np.ndarray
) -> None:
    horizon = Followed(solver, seeds)
    first = horizon.solve(0, x0)
    for step in (1, 1, 4):
        last = horizon.strategy
        horizon.solve(step, first.x_ref[step, :, 0])
        for k in range(3):
            check_same(solver.calls[-1], last.advanced(step), k, k)
        assert horizon.strategy.first_step == step
        assert horizon.converged.all()
    assert len(solver.calls) == 4, "none had to be solved again"


def test_warm_starts_stay_in_the_equilibrium_and_take_fewer_iterations(
    solver: Scripted, seeds: np.ndarray, x0: np.ndarray
) -> None:
    horizon = Followed(solver, seeds)
    first = horizon.solve(0, x0)
    cold = horizon.iterations.mean()
    second = horizon.solve(1, first.x_ref[1, :, 0])
    assert horizon.iterations[0] < cold
    assert np.abs(second.x_ref[:15, :, 0] - first.x_ref[1:16, :, 0]).max() < 0.5


def test_a_particle_that_does_not_converge_is_solved_from_the_zero_seed(
    solver: Scripted, seeds: np.ndarray, x0: np.ndarray, game: Game
) -> None:
    horizon = Followed(solver, seeds)
    first = horizon.solve(0, x0)
    x = first.x_ref[1, :, 0]
    solver.failures = [[1]]
    strategy = horizon.solve(1, x)
    assert horizon.converged.all()
    zero = IterativeLQ(game).solve(x, Strategy.from_inputs(1, x, np.zeros((20, 4, 1)))).strategy
    warm = IterativeLQ(game).solve(x, first.advanced(1)).strategy
    check_same(strategy, zero, 1, 0)
    for k in (0, 2):
        check_same(strategy, warm, k, k)
    assert not solver.calls[-1].u_ref.any() and not solver.calls[-1].P.any()


def test_a_particle_that_fails_twice_keeps_its_strategy_and_is_marked(
    solver: Scripted, seeds: np.ndarray, x0: np.ndarray, game: Game
) -> None:
    horizon = Followed(solver, seeds)
    first = horizon.solve(0, x0)
    x = first.x_ref[1, :, 0]
    solver.failures = [[0, 2], [0]]
    strategy = horizon.solve(1, x)
    assert list(horizon.converged) == [False, True, False]
    warm = IterativeLQ(game).solve(x, first.advanced(1)).strategy
    check_same(strategy, warm, 1, 1)
    kept = solver.play_out(x, first.advanced(1))
    for k in (0, 2):
        check_same(strategy, kept, k, k)
    # Nothing is lost: the next solve starts from what was kept, and may converge again.
    horizon.solve(2, x)
    check_same(solver.calls[-1], kept.advanced(2), 0, 0)
    assert horizon.converged.all()


def test_a_first_solve_that_fails_twice_keeps_the_seed(
    solver: Scripted, seeds: np.ndarray, x0: np.ndarray
) -> None:
    horizon = Followed(solver, seeds)
    solver.failures = [[2], [0]]
    strategy = horizon.solve(0, x0)
    assert list(horizon.converged) == [True, True, False]
    np.testing.assert_array_equal(strategy.u_ref[..., 2], seeds[..., 2])


def test_real_failures_are_marked_too(game: Game, seeds: np.ndarray, x0: np.ndarray) -> None:
    solver = IterativeLQ(game, SolverSettings(max_iterations=1, converged_movement=1e-9))
    horizon = Followed(solver, seeds)
    strategy = horizon.solve(0, x0)
    assert not horizon.converged.any()
    np.testing.assert_array_equal(strategy.u_ref, seeds)
    # Different inputs lead to different places: these are no duplicates.
    assert np.abs(strategy.x_ref[..., 0] - strategy.x_ref[..., 1]).max() > 0.01
    for k in range(len(strategy)):
        x = x0
        for step in range(game.horizon):
            np.testing.assert_array_equal(strategy.x_ref[step, :, k], x)
            x = game.step(x, seeds[step, :, k])


def test_going_back_in_time_is_refused(solver: Scripted, seeds: np.ndarray, x0: np.ndarray) -> None:
    horizon = Followed(solver, seeds)
    horizon.solve(5, x0)
    with pytest.raises(ValueError, match=r"step: 4 .* at least 5"):
        horizon.solve(4, x0)
    assert horizon.strategy.first_step == 5


@pytest.mark.parametrize(("step", "warm"), [(19, True), (20, False), (300, False)])
def test_past_the_horizon_the_seeds_are_used_again(
    step: int, warm: bool, solver: Scripted, seeds: np.ndarray, x0: np.ndarray
) -> None:
    horizon = Followed(solver, seeds)
    first = horizon.solve(0, x0)
    solver.calls.clear()
    horizon.solve(step, x0)
    expected = first.advanced(step) if warm else Strategy.from_inputs(step, x0, seeds)
    for k in range(3):
        check_same(solver.calls[0], expected, k, k)


def test_only_some_particles_may_be_kept(
    solver: Scripted, seeds: np.ndarray, x0: np.ndarray
) -> None:
    horizon = Followed(solver, seeds)
    solver.failures = [[2], [0]]
    first = horizon.solve(0, x0)
    horizon.take([0, 2])
    assert len(horizon) == len(horizon.strategy) == 2
    assert list(horizon.converged) == [True, False]
    check_same(horizon.strategy, first, 1, 2)
    horizon.solve(500, x0)
    np.testing.assert_array_equal(solver.calls[-1].u_ref, seeds[..., [0, 2]])


def test_particles_may_be_dropped_before_the_first_solve(
    solver: Scripted, seeds: np.ndarray, x0: np.ndarray
) -> None:
    horizon = Followed(solver, seeds)
    horizon.take(np.array([1]))
    horizon.solve(0, x0)
    np.testing.assert_array_equal(solver.calls[0].u_ref, seeds[..., [1]])


def test_a_state_that_is_not_finite_changes_nothing(
    solver: Scripted, seeds: np.ndarray, x0: np.ndarray
) -> None:
    horizon = Followed(solver, seeds)
    first = horizon.solve(0, x0)
    with pytest.raises(ValueError, match="it must be finite"):
        horizon.solve(1, np.full_like(x0, np.nan))
    assert horizon.strategy is first and horizon.converged.all()
