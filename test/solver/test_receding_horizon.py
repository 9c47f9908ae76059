from __future__ import annotations

import numpy as np
import pytest
from followed import Followed
from scripted import Scripted
from solving import PAPER, paper
from strategies import assert_same, assert_same_particle

from gameinfer_ros.games import Game
from gameinfer_ros.solver import GameSolver, Strategy


def test_nothing_is_known_before_the_first_solve(unsolved: Followed) -> None:
    assert len(unsolved) == 3
    assert unsolved.strategy is None and not unsolved.iterations.any()
    assert not unsolved.converged.any()


def test_the_first_solve_starts_from_the_seeds(
    unsolved: Followed, seeds: np.ndarray, x0: np.ndarray, game: Game
) -> None:
    strategy = unsolved.solve(7, x0)
    assert strategy is unsolved.strategy
    assert unsolved.converged.all()
    assert_same(
        strategy, GameSolver(game, PAPER).solve(x0, Strategy.from_inputs(7, x0, seeds)).strategy
    )


def test_later_solves_start_from_the_last_strategies(horizon: Followed, solver: Scripted) -> None:
    first = horizon.strategy
    for step in (1, 1, 4):
        last = horizon.strategy
        horizon.solve(step, first.x_ref[step, :, 0])
        assert_same(solver.calls[-1], last.advanced(step))
        assert horizon.strategy.first_step == step
        assert horizon.converged.all()
    assert len(solver.calls) == 4, "none had to be solved again"


def test_warm_starts_stay_in_the_equilibrium_and_take_fewer_iterations(horizon: Followed) -> None:
    first, cold = horizon.strategy, horizon.iterations.mean()
    second = horizon.solve(1, first.x_ref[1, :, 0])
    assert horizon.iterations[0] < cold
    assert np.abs(second.x_ref[:15, :, 0] - first.x_ref[1:16, :, 0]).max() < 0.5


def test_a_particle_that_does_not_converge_is_solved_from_the_zero_seed(
    horizon: Followed, solver: Scripted, game: Game
) -> None:
    first = horizon.strategy
    x = first.x_ref[1, :, 0]
    solver.failures = [[1]]
    strategy = horizon.solve(1, x)
    assert horizon.converged.all()
    zero = (
        GameSolver(game, PAPER).solve(x, Strategy.from_inputs(1, x, np.zeros((20, 4, 1)))).strategy
    )
    warm = GameSolver(game, PAPER).solve(x, first.advanced(1)).strategy
    assert_same_particle(strategy, 1, zero, 0)
    assert_same(strategy.take([0, 2]), warm.take([0, 2]))
    assert not solver.calls[-1].u_ref.any() and not solver.calls[-1].P.any()


def test_a_particle_that_fails_twice_keeps_its_strategy_and_is_marked(
    horizon: Followed, solver: Scripted, game: Game
) -> None:
    first = horizon.strategy
    x = first.x_ref[1, :, 0]
    solver.failures = [[0, 2], [0]]
    strategy = horizon.solve(1, x)
    assert list(horizon.converged) == [False, True, False]
    warm = GameSolver(game, PAPER).solve(x, first.advanced(1)).strategy
    assert_same_particle(strategy, 1, warm, 1)
    kept = solver.play_out(x, first.advanced(1))
    assert_same(strategy.take([0, 2]), kept.take([0, 2]))
    # Nothing is lost: the next solve starts from what was kept, and may converge again.
    horizon.solve(2, x)
    assert_same_particle(solver.calls[-1], 0, kept.advanced(2), 0)
    assert horizon.converged.all()


def test_a_first_solve_that_fails_twice_keeps_the_seed(
    unsolved: Followed, solver: Scripted, seeds: np.ndarray, x0: np.ndarray
) -> None:
    solver.failures = [[2], [0]]
    strategy = unsolved.solve(0, x0)
    assert list(unsolved.converged) == [True, True, False]
    np.testing.assert_array_equal(strategy.u_ref[..., 2], seeds[..., 2])


def test_real_failures_are_marked_too(game: Game, seeds: np.ndarray, x0: np.ndarray) -> None:
    solver = GameSolver(game, paper(max_iterations=1, converged_movement=1e-9))
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


def test_going_back_in_time_is_refused(unsolved: Followed, x0: np.ndarray) -> None:
    unsolved.solve(5, x0)
    with pytest.raises(ValueError, match=r"step: 4 .* at least 5"):
        unsolved.solve(4, x0)
    assert unsolved.strategy.first_step == 5


@pytest.mark.parametrize(("step", "warm"), [(19, True), (20, False), (300, False)])
def test_past_the_horizon_the_seeds_are_used_again(
    step: int, warm: bool, horizon: Followed, solver: Scripted, seeds: np.ndarray, x0: np.ndarray
) -> None:
    first = horizon.strategy
    solver.calls.clear()
    horizon.solve(step, x0)
    expected = first.advanced(step) if warm else Strategy.from_inputs(step, x0, seeds)
    assert_same(solver.calls[0], expected)


def test_only_some_particles_may_be_kept(
    unsolved: Followed, solver: Scripted, seeds: np.ndarray, x0: np.ndarray
) -> None:
    solver.failures = [[2], [0]]
    first = unsolved.solve(0, x0)
    unsolved.take([0, 2])
    assert len(unsolved) == len(unsolved.strategy) == 2
    assert list(unsolved.converged) == [True, False]
    assert_same_particle(unsolved.strategy, 1, first, 2)
    unsolved.solve(500, x0)
    np.testing.assert_array_equal(solver.calls[-1].u_ref, seeds[..., [0, 2]])


def test_particles_may_be_dropped_before_the_first_solve(
    unsolved: Followed, solver: Scripted, seeds: np.ndarray, x0: np.ndarray
) -> None:
    unsolved.take(np.array([1]))
    unsolved.solve(0, x0)
    np.testing.assert_array_equal(solver.calls[0].u_ref, seeds[..., [1]])


def test_a_state_that_is_not_finite_changes_nothing(horizon: Followed, x0: np.ndarray) -> None:
    first = horizon.strategy
    with pytest.raises(ValueError, match="it must be finite"):
        horizon.solve(1, np.full_like(x0, np.nan))
    assert horizon.strategy is first and horizon.converged.all()
