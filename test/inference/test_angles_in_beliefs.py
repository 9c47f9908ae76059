"""Beliefs see headings modulo a turn: it does not matter how many an observation counts."""

from __future__ import annotations

import numpy as np
import pytest
from beliefs import K, make_belief, solved_belief

from gameinfer_ros.games import Game
from gameinfer_ros.inference import Belief, predict
from gameinfer_ros.inference.duplicates import first_duplicate

TURN = 2 * np.pi
HEADING = 2  # of the robot, the only heading of the game


def turned(x: np.ndarray, turns: float) -> np.ndarray:
    x = x.copy()
    x[HEADING] += turns * TURN
    return x


def identical(belief: Belief) -> None:
    belief.strategy.x_ref[:] = belief.strategy.x_ref[..., :1]


@pytest.mark.parametrize("turns", [-1, 1, 5])
def test_trajectories_whole_turns_of_a_heading_apart_are_duplicates(
    turns: int, belief: Belief
) -> None:
    identical(belief)
    belief.strategy.x_ref[4:, HEADING, 1] += turns * TURN + 0.05
    belief.strategy.x_ref[4:, HEADING, 2] += turns * TURN + 0.2  # beyond the tolerance
    belief.strategy.x_ref[4:, 0, 3] += turns * TURN  # not a heading
    belief.combine_duplicates()
    assert len(belief) == 3


def test_the_duplicate_test_takes_only_angles_modulo_a_turn() -> None:
    is_angle, first = np.array([False, True, False]), np.arange(12.0)
    for row in range(12):
        other = first.copy()
        other[row] -= 3 * TURN
        trajectories, candidates = np.stack([first, other]), np.array([0])
        found = first_duplicate(trajectories, candidates, 1, 1e-9, is_angle)
        assert found == (0 if is_angle[row % 3] else -1)
    first[4] = np.nan
    assert first_duplicate(np.stack([first, first]), np.array([0]), 1, 1e-9, is_angle) == -1


@pytest.mark.parametrize("turns", [-2, 1])
def test_a_jump_by_whole_turns_changes_neither_weights_nor_equilibria(
    turns: int, game: Game, x0: np.ndarray
) -> None:
    """As if a message counted the turns of a heading in another way than the one before."""
    plain, other = solved_belief(game, x0), solved_belief(game, x0)
    x1 = game.step(x0, np.full(4, 0.1))
    u = np.array([0.1, 0.1])
    plain.weigh(0, x0, x1, u)
    other.weigh(0, turned(x0, turns), turned(x1, -turns), u)
    np.testing.assert_allclose(other.weights, plain.weights, rtol=1e-9)
    plain.solve(1, x1)
    other.solve(1, turned(x1, turns))
    assert plain.converged.all() and other.converged.all()
    np.testing.assert_array_equal(other.iterations, plain.iterations)
    shift = np.zeros(game.players.n_states)
    shift[HEADING] = turns * TURN
    np.testing.assert_allclose(
        other.strategy.x_ref - shift[:, None], plain.strategy.x_ref, rtol=0, atol=1e-9
    )
    np.testing.assert_allclose(other.strategy.u_ref, plain.strategy.u_ref, rtol=0, atol=1e-8)
    np.testing.assert_allclose(other.costs, plain.costs, rtol=1e-8)
    assert len(other) == K


def test_predictions_do_not_depend_on_the_number_of_turns(belief: Belief, x0: np.ndarray) -> None:
    plain = predict(belief.game, belief.strategy, 0, x0 + 0.01)
    other = predict(belief.game, belief.strategy, 0, turned(x0 + 0.01, 4))
    plain[HEADING] += 4 * TURN
    np.testing.assert_allclose(other, plain, rtol=0, atol=1e-9)


def test_a_robot_that_only_watches_weighs_headings_by_the_short_way(
    game: Game, x0: np.ndarray
) -> None:
    weights = []
    for turns in (0, 1):
        belief = make_belief(game, robot_plays=False)
        belief.solve(0, x0)
        x1 = game.step(x0, np.full(4, 0.05))
        belief.weigh(0, x0, turned(x1, turns))
        weights.append(belief.weights)
    assert np.ptp(weights[0]) > 1e-6
    np.testing.assert_allclose(weights[1], weights[0], rtol=1e-9)
