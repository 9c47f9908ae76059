"""Whatever the game and the warm start: a status for all particles, and finite numbers."""

from __future__ import annotations

import numpy as np
import pytest
from extreme_games import CLASSES, Case, draw
from followed import Followed
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import assert_same_particle

from examples import examples
from gameinfer_ros.solver import GameSolver, Solution, Status, Strategy

K = 12

#: A class of games, and the seed of all else.
GAMES = st.tuples(st.sampled_from(list(CLASSES)), st.integers(0, 2**32 - 1))


METHODS = pytest.mark.parametrize("method", ["newton", "iterative_lq"])


def case_of(drawn: tuple[str, int], method: str, particles: int = K) -> Case:
    kind, number = drawn
    case = draw(kind, np.random.default_rng(number), particles)
    return case._replace(settings=case.settings.model_copy(update={"method": method}))


def solve(case: Case, initial: Strategy) -> Solution:
    return GameSolver(case.game, case.settings).solve(case.x0, initial)


@METHODS
@settings(max_examples=examples(300))
@given(GAMES)
def test_every_particle_ends_with_a_status_and_finite_numbers(
    method: str, drawn: tuple[str, int]
) -> None:
    case = case_of(drawn, method)
    solution = solve(case, case.initial)
    status, iterations = solution.status, solution.iterations
    assert set(status.tolist()) <= set(Status) - {Status.NOT_REACHED}
    failed = status == Status.NOT_FINITE
    assert solution.strategy.finite[~failed].all()
    assert ((iterations >= 1) | failed).all()
    assert (iterations <= case.settings.max_iterations).all()
    assert (iterations[status == Status.ITERATION_LIMIT] == case.settings.max_iterations).all()
    converged = solution.converged
    if method == "newton":
        assert (solution.residual[converged] <= case.settings.tolerance).all()
        assert (solution.pivot[:, converged] > 0.0).all()
    else:
        assert (solution.movement[converged] <= case.settings.movement_limit).all()
    assert all(solution.reason(k) for k in range(K))
    for k in np.flatnonzero(~failed).tolist():
        np.testing.assert_array_equal(solution.strategy.x_ref[0, :, k], case.x0)
    # What could not be solved is what it was to begin with, from where it is now.
    played = GameSolver(case.game, case.settings).play_out(case.x0, case.initial)
    for k in np.flatnonzero(failed).tolist():
        assert_same_particle(solution.strategy, k, played, k)


@METHODS
@settings(max_examples=examples(120))
@given(GAMES)
def test_no_particle_changes_its_neighbours(method: str, drawn: tuple[str, int]) -> None:
    case = case_of(drawn, method)
    solution = solve(case, case.initial)
    broken = case.initial.take(np.arange(K))
    for k in range(0, K, 2):
        broken.arrays[k % 3][..., k] = (np.nan, np.inf, 1e300)[k // 2 % 3]
    beside = solve(case, broken)
    alone = solve(case, case.initial.take([5]))
    for found, its, k in [*((beside, k, k) for k in range(1, K, 2)), (alone, 0, 5)]:
        assert found.status[its] == solution.status[k]
        assert found.iterations[its] == solution.iterations[k]
        assert found.movement[its] == pytest.approx(solution.movement[k], rel=0, abs=0, nan_ok=True)
        assert_same_particle(found.strategy, its, solution.strategy, k)


@METHODS
@settings(max_examples=examples(80))
@given(GAMES, st.lists(st.integers(0, 15), min_size=1, max_size=3), st.integers(1, 4))
def test_receding_horizons_go_on_from_anything(
    method: str, drawn: tuple[str, int], hops: list[int], granted: int
) -> None:
    case = case_of(drawn, method, particles=4)
    rng = np.random.default_rng(drawn[1])
    solver = GameSolver(case.game, case.settings)
    equilibria = Followed(solver, case.initial.u_ref, patience=3)
    x, step = case.x0, 0
    strategy = equilibria.solve(step, x)
    for hop in hops:
        for array, garbage in zip(strategy.arrays, case.initial.arrays, strict=True):
            array[..., 1] = garbage[..., 1]
        x, step = x + 0.1 * rng.normal(size=len(x)), step + hop
        strategy = equilibria.solve(step, x, max_iterations=granted)
        assert strategy.first_step == step
        assert strategy.finite[equilibria.converged].all()
        assert (equilibria.iterations <= case.settings.max_iterations).all()
