"""Updates of a belief that end early, and what is played then."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from beliefs import SEEDS, K, make_belief, set_weights, spread
from scipy.stats import norm
from scripted import Fickle, Scripted
from solving import PAPER, paper
from strategies import assert_same

from gameinfer_ros.games import Game
from gameinfer_ros.inference import Belief, BeliefSettings, predict
from gameinfer_ros.inference.belief import NO_PARTICLE, MapEquilibrium
from gameinfer_ros.solver import GameSolver, Status, brake


def belief_of(solver: GameSolver, particles: int = K, **more: Any) -> Belief:
    chosen = BeliefSettings(particles=particles, **more)
    return Belief(solver, SEEDS, chosen, np.random.default_rng(0))


def assert_equilibrium(found: MapEquilibrium, belief: Belief, k: int) -> None:
    assert found.particle == belief.ids[k]
    assert found.probability == belief.weights[k]
    assert_same(found.strategy, belief.strategy.take([k]))


@pytest.fixture
def moved(game: Game, x0: np.ndarray) -> np.ndarray:
    """An unexpected state at step 1."""
    return game.step(x0, 0.3 * np.ones(4)) + 0.05 * np.cos(np.arange(8))


def test_the_equilibrium_is_that_of_the_map(belief: Belief) -> None:
    assert_equilibrium(belief.equilibrium, belief, 5)
    belief.converged[[5, 4]] = False
    assert_equilibrium(belief.equilibrium, belief, 3)


def test_the_heaviest_come_first(game: Game, x0: np.ndarray, moved: np.ndarray) -> None:
    solver = Fickle(game)
    belief = belief_of(solver)
    belief.solve(0, x0)
    np.testing.assert_array_equal(solver.orders[0], np.arange(K))
    set_weights(belief, np.array([0.1, 0.3, 0.1, 0.05, 0.3, 0.15]))
    belief.solve(1, moved)
    np.testing.assert_array_equal(solver.orders[-1], [1, 4, 5, 0, 2, 3])


def test_a_deadline_that_is_over_changes_no_more_than_the_step(
    belief: Belief, moved: np.ndarray
) -> None:
    first, log_weights, map_before = belief.strategy, belief.log_weights.copy(), belief.map_index
    for step in (1, 2, 3):
        belief.solve(step, moved, deadline=-np.inf)
        assert not belief.updated.any() and not belief.settled.any()
        assert belief.map_index is None
        assert not belief.iterations.any()
        assert_same(belief.strategy, first.advanced(step))
        np.testing.assert_array_equal(belief.log_weights, log_weights)
        np.testing.assert_array_equal(belief.ids, np.arange(K))
        found = belief.equilibrium
        assert found.particle == map_before
        assert found.probability == belief.weights[map_before]
        assert_same(found.strategy, first.take([map_before]).advanced(step))
        assert np.isfinite(belief.costs).all()


def test_what_was_not_reached_can_still_be_weighed_and_is_solved_later(
    game: Game, x0: np.ndarray, moved: np.ndarray
) -> None:
    belief = make_belief(game)
    belief.solve(0, x0)
    first = belief.strategy
    belief.solve(1, moved, deadline=-np.inf)
    x = game.step(moved, 0.1 * np.ones(4))
    x_hat = predict(game, first, 1, moved, 0.1 * np.ones(2))
    likelihood = norm.pdf(x[4:, None], x_hat[4:], 0.1).prod(axis=0)
    belief.weigh(1, moved, x, 0.1 * np.ones(2))
    np.testing.assert_allclose(belief.weights, likelihood / likelihood.sum(), rtol=1e-9)
    # The probability of the equilibrium goes with the weights.
    assert belief.equilibrium.probability == belief.weights[belief.equilibrium.particle]
    belief.solve(2, x)
    assert belief.settled.all()
    expected = GameSolver(game, PAPER).solve(x, first.advanced(2))
    assert_same(belief.strategy, expected.strategy)
    assert belief.map_index == np.argmax(belief.weights)


def test_heavy_particles_are_granted_all_iterations_and_light_ones_the_cap(
    game: Game, x0: np.ndarray, moved: np.ndarray
) -> None:
    belief, whole = make_belief(game, max_iterations=1, heavy=0.25), make_belief(game)
    weights = np.array([0.25, 0.1, 0.4, 0.2, 0.04, 0.01])
    for one in (belief, whole):
        one.solve(0, x0)
        set_weights(one, weights)
        one.solve(1, moved)
    assert (whole.iterations > 1).all()
    heavy = weights >= 0.25
    np.testing.assert_array_equal(belief.iterations, np.where(heavy, whole.iterations, 1))
    np.testing.assert_array_equal(belief.settled, heavy)


def test_the_patience_of_the_settings_ends_that_of_light_particles(
    game: Game, x0: np.ndarray, moved: np.ndarray
) -> None:
    never = paper(max_iterations=20, converged_movement=1e-300)
    solver = Scripted(game, never)
    belief = belief_of(solver, max_iterations=2, patience=4, heavy=1.0)
    belief.solve(0, x0)
    solver.calls.clear()
    for batches in ([K], [K, K, 1], [K, K, 1, K]):  # the zero seed after 2 + 2 iterations
        belief.solve(1, moved)
        assert [len(call) for call in solver.calls] == batches


def test_a_heavy_particle_that_is_not_settled_never_becomes_the_map(
    game: Game, x0: np.ndarray, moved: np.ndarray
) -> None:
    solver = Fickle(game)
    belief = belief_of(solver, max_iterations=50)
    belief.solve(0, x0)
    set_weights(belief, np.array([0.02, 0.02, 0.01, 0.9, 0.03, 0.02]))
    assert belief.map_index == 3
    last = belief.equilibrium.strategy
    for status in (Status.ITERATION_LIMIT, Status.NOT_REACHED):
        solver.failures = {3: status}
        belief.solve(1, moved)
        assert list(belief.settled) == [True, True, True, False, True, True]
        assert belief.map_index == 4
        # What was known of its equilibrium when it was settled is still the most probable.
        found = belief.equilibrium
        assert (found.particle, found.probability) == (3, pytest.approx(0.9))
        assert_same(found.strategy, last.advanced(1))
    set_weights(belief, np.array([0.02, 0.02, 0.01, 0.4, 0.53, 0.02]))
    assert_equilibrium(belief.equilibrium, belief, 4)
    set_weights(belief, np.array([0.02, 0.02, 0.01, 0.9, 0.03, 0.02]))
    solver.failures = {}
    belief.solve(1, moved)
    assert belief.map_index == 3


def test_if_nothing_is_settled_the_last_map_stays(
    game: Game, x0: np.ndarray, moved: np.ndarray
) -> None:
    solver = Fickle(game)
    belief = belief_of(solver)
    belief.solve(0, x0)
    set_weights(belief, np.array([0.1, 0.1, 0.1, 0.5, 0.1, 0.1]))
    expected = belief.equilibrium
    solver.fail(K)
    for step in (1, 2):
        belief.solve(step, moved)
        assert belief.updated.all() and not belief.settled.any()
        found = belief.equilibrium
        assert (found.particle, found.probability) == (3, pytest.approx(0.5))
        assert_same(found.strategy, expected.strategy.advanced(step))
    # It is a later one as soon as there is one, and then that one stays.
    solver.failures = {}
    belief.solve(3, moved)
    set_weights(belief, np.array([0.7, 0.1, 0.05, 0.05, 0.05, 0.05]))
    later = belief.equilibrium
    assert_equilibrium(later, belief, 0)
    belief.solve(4, moved, deadline=-np.inf)
    assert belief.equilibrium.particle == 0
    assert_same(belief.equilibrium.strategy, later.strategy.advanced(4))


def test_the_last_map_lives_on_in_the_particle_that_it_was_merged_with(
    belief: Belief, moved: np.ndarray
) -> None:
    spread(belief, np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0]))
    last = belief.equilibrium
    assert last.particle == 5
    belief.solve(1, moved, deadline=-np.inf)
    set_weights(belief, np.array([0.3, 0.2, 0.2, 0.1, 0.1, 0.1]))
    belief.strategy.x_ref[..., 5] = belief.strategy.x_ref[..., 0]
    belief.combine_duplicates()
    assert list(belief.ids) == [0, 1, 2, 3, 4]
    found = belief.equilibrium
    assert (found.particle, found.probability) == (0, pytest.approx(0.4))
    assert_same(found.strategy, last.strategy.advanced(1))
    assert belief.weights.sum() == pytest.approx(1.0)


def test_if_there_has_never_been_a_map_all_brake(
    game: Game, x0: np.ndarray, moved: np.ndarray
) -> None:
    solver = Fickle(game)
    belief = belief_of(solver)
    solver.fail(K)
    belief.solve(0, moved)
    assert belief.map_index is None
    found = belief.equilibrium
    assert (found.particle, found.probability) == (NO_PARTICLE, 0.0)
    assert NO_PARTICLE == -1
    assert_same(found.strategy, brake(game, 0, moved))
    # Whoever brakes from then on is at rest, also where the solver still finds nothing.
    x = moved
    for step in range(5):
        found = belief.equilibrium
        x = game.step(x, found.strategy.inputs(step, x)[:, 0])
        np.testing.assert_allclose(x[[3, 5, 7]], 0.0, rtol=0, atol=1e-9)
        belief.solve(step + 1, x)
        assert belief.equilibrium.particle == NO_PARTICLE
        assert np.isfinite(belief.equilibrium.strategy.u_ref).all()
    solver.failures = {}
    belief.solve(6, x)
    assert belief.settled.all()
    assert_equilibrium(belief.equilibrium, belief, belief.map_index)


@pytest.mark.parametrize("step", [10, 25])
def test_past_the_horizon_the_last_map_is_no_longer_known(
    step: int, game: Game, x0: np.ndarray, moved: np.ndarray
) -> None:
    solver = Fickle(game)
    belief = belief_of(solver)
    belief.solve(0, x0)
    solver.fail(K)
    belief.solve(step, moved)
    assert belief.equilibrium.particle == NO_PARTICLE
    assert_same(belief.equilibrium.strategy, brake(game, step, moved))


def test_the_deadline_does_not_hold_for_the_first_solve_nor_past_the_horizon(
    game: Game, x0: np.ndarray
) -> None:
    belief = make_belief(game, max_iterations=1)
    for step in (0, 10):
        belief.solve(step, x0, deadline=-np.inf)
        assert belief.settled.all()
        assert belief.iterations.max() > 1, "nor does the cap"


def test_a_state_that_cannot_be_solved_from_changes_nothing(belief: Belief, x0: np.ndarray) -> None:
    before, strategy = belief.equilibrium, belief.strategy
    with pytest.raises(ValueError, match="it must be finite"):
        belief.solve(1, np.full_like(x0, np.nan))
    assert belief.strategy is strategy
    assert_same(belief.equilibrium.strategy, before.strategy)
