"""What `CONVERGED` means, whatever the settings."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from solving import GameFactory, Start, paper, random_inputs

from examples import examples
from gameinfer_ros.games import Game
from gameinfer_ros.solver import GameSolver, SolverSettings, Strategy

LOGARITHM = st.floats(0.0, 1.0)


def between(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers that are log-uniform between two bounds."""
    return LOGARITHM.map(lambda part: float(np.clip(low * (high / low) ** part, low, high)))


ANY = st.builds(
    SolverSettings,
    method=st.just("iterative_lq"),
    state_regularisation=st.just(0.0) | between(0.1, 1e3),
    input_regularisation=st.just(0.0) | between(0.1, 1e3),
    first_step_size=between(1e-3, 1.0),
    max_halvings=st.integers(0, 1000),
    max_movement=between(1e-30, 1e12),
    converged_movement=between(5e-3, 0.1),
    max_iterations=st.sampled_from([1, 10, 100, 1000]),
)


@pytest.fixture
def pair(make_game: GameFactory, start: Start) -> tuple[Game, np.ndarray]:
    game = make_game("ud", horizon=10)
    return game, start(game)


@settings(max_examples=examples(100), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(ANY)
@example(paper(max_movement=0.05))
@example(paper(first_step_size=0.01))
@example(paper(max_movement=1e-30, max_halvings=1000))
@example(paper(state_regularisation=1e3, input_regularisation=1e3))
@example(
    SolverSettings(
        method="iterative_lq", first_step_size=1e-3, input_regularisation=1e3, max_movement=1e-9
    )
)
def test_no_settings_report_convergence_far_from_a_solution(
    pair: tuple[Game, np.ndarray], some: SolverSettings
) -> None:
    game, x0 = pair
    solution = GameSolver(game, some).solve(x0, Strategy.from_inputs(0, x0, random_inputs(game, 8)))
    # The same iterations go on, without what can stop them early.
    unhindered = some.model_copy(
        update={
            "first_step_size": 0.5,
            "max_halvings": 20,
            "max_movement": 1.5,
            "converged_movement": 1e-4,
            "max_iterations": 4000,
        }
    )
    converged = solution.strategy.take(np.flatnonzero(solution.converged))
    expected = GameSolver(game, unhindered).solve(x0, converged)
    distance = np.abs(converged.x_ref - expected.strategy.x_ref).max(initial=0.0)
    assert distance <= 8 * some.converged_movement


def test_the_examples_converge_where_settings_allow_it(pair: tuple[Game, np.ndarray]) -> None:
    game, x0 = pair
    initial = Strategy.from_inputs(0, x0, random_inputs(game, 8))
    for some in (
        paper(max_movement=0.05),
        paper(first_step_size=0.01, max_iterations=10_000),
        paper(state_regularisation=100.0, max_iterations=10_000),
    ):
        solution = GameSolver(game, some).solve(x0, initial)
        assert solution.converged.all() and (solution.iterations > 1).all()
