"""Warm starts of the method `newton`: which gains they have, and when they are good enough."""

from __future__ import annotations

import numpy as np
import pytest
from solving import HeadOn, random_inputs

from gameinfer_ros.solver import GameSolver, Solution, SolverSettings, Status, Strategy

T = 20


@pytest.fixture
def solver(head_on: HeadOn) -> GameSolver:
    return GameSolver(head_on(T)[0], SolverSettings(method="newton"))


@pytest.fixture
def solved(solver: GameSolver, head_on: HeadOn) -> Strategy:
    """Equilibria from some seeds."""
    x0 = head_on(T)[1]
    initial = Strategy.from_inputs(0, x0, random_inputs(solver.game, 8))
    solution = solver.solve(x0, initial)
    assert solution.converged.sum() >= 4
    return solution.strategy.take(np.flatnonzero(solution.converged))


def again(
    solver: GameSolver, solved: Strategy, step: int, size: float, for_one_step: bool
) -> Solution:
    """Solve from a state next to that of the first particle."""
    x = solved.x_ref[step, :, 0] + size * np.cos(np.arange(len(solved.x_ref[0])))
    return solver.solve(x, solved.take([0]), step=step, for_one_step=for_one_step)


def keeps_gains(solution: Solution, solved: Strategy, step: int) -> bool:
    """Whether the gains are the old ones, and zero where the horizon did not reach."""
    P = solution.strategy.P[..., 0]
    return np.array_equal(P[: T - step], solved.P[step:, ..., 0]) and not P[T - step :].any()


@pytest.mark.parametrize("step", [1, 2, 4])
def test_a_warm_start_keeps_its_gains_and_is_good_enough_for_one_step(
    step: int, solver: GameSolver, solved: Strategy
) -> None:
    solution = again(solver, solved, step, 0.02, for_one_step=True)
    assert solution.status[0] == Status.GOOD_ENOUGH
    assert solution.usable[0] and not solution.converged[0]
    assert 1e-4 < solution.residual[0] <= 0.05
    assert "good enough" in solution.reason(0)
    assert keeps_gains(solution, solved, step)


def test_a_warm_start_converges_unless_it_is_for_one_step(
    solver: GameSolver, solved: Strategy
) -> None:
    solution = again(solver, solved, 1, 0.02, for_one_step=False)
    assert solution.status[0] == Status.CONVERGED
    assert solution.residual[0] <= 1e-4
    assert (solution.pivot[:, 0] > 0.0).all()
    assert keeps_gains(solution, solved, 1)


@pytest.mark.parametrize(("without", "kept"), [(1, True), (5, True), (6, False), (9, False)])
def test_gains_are_renewed_when_more_than_a_quarter_of_the_horizon_has_none(
    without: int, kept: bool, solver: GameSolver, solved: Strategy
) -> None:
    solved.P[T - without :] = 0.0
    solution = again(solver, solved, 0, 0.0, for_one_step=True)
    assert solution.usable[0]
    assert keeps_gains(solution, solved, 0) == kept


def test_gains_far_from_an_equilibrium_are_renewed(solver: GameSolver, solved: Strategy) -> None:
    solution = again(solver, solved, 1, 0.6, for_one_step=True)
    assert solution.usable[0], solution.reason(0)
    assert not keeps_gains(solution, solved, 1)


def test_seeds_must_converge_also_for_one_step(solver: GameSolver, head_on: HeadOn) -> None:
    game, x0 = head_on(T)
    initial = Strategy.from_inputs(0, x0, random_inputs(game, 8))
    solution = solver.solve(x0, initial, for_one_step=True)
    assert not (solution.status == Status.GOOD_ENOUGH).any()
    assert (solution.residual[solution.converged] <= 1e-4).all()
