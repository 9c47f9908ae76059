from __future__ import annotations

import numpy as np
import pytest
from solving import GameFactory

from gameinfer_ros.games import Game
from gameinfer_ros.inference import predict
from gameinfer_ros.solver import Strategy

STEP = 12


@pytest.fixture
def game(make_game: GameFactory) -> Game:
    return make_game("udu", horizon=6)


@pytest.fixture
def strategy() -> Strategy:
    rng = np.random.default_rng(0)
    shapes = (7, 12, 5), (6, 6, 5), (6, 6, 12, 5)
    return Strategy(10, *(rng.normal(size=shape) for shape in shapes))


@pytest.mark.parametrize("u_robot", [None, np.array([0.3, -2.0])])
def test_all_players_play_the_particle_except_the_robot(
    game: Game, strategy: Strategy, u_robot: np.ndarray | None
) -> None:
    x = np.random.default_rng(1).normal(size=12)
    x_hat = predict(game, strategy, STEP, x, u_robot)
    assert x_hat.shape == (12, 5)
    for k in range(5):
        dx = x - strategy.x_ref[2, :, k]
        u = strategy.u_ref[2, :, k] - strategy.P[2, :, :, k] @ dx
        if u_robot is not None:
            u[:2] = u_robot
        np.testing.assert_allclose(x_hat[:, k], game.step(x, u), rtol=1e-12, atol=1e-12)


def test_the_robots_own_strategy_does_not_matter_if_its_input_is_known(
    game: Game, strategy: Strategy
) -> None:
    x, u_robot = np.ones(12), np.array([0.1, 0.2])
    before = predict(game, strategy, STEP, x, u_robot)
    strategy.u_ref[:, :2] = np.nan
    np.testing.assert_array_equal(predict(game, strategy, STEP, x, u_robot), before)


def test_a_prediction_leaves_its_arguments_alone(game: Game, strategy: Strategy) -> None:
    x, u_robot = np.ones(12), np.array([0.1, 0.2])
    before = strategy.u_ref.copy()
    predict(game, strategy, STEP, x, u_robot)
    assert (x == 1.0).all() and list(u_robot) == [0.1, 0.2]
    np.testing.assert_array_equal(strategy.u_ref, before)


def test_a_step_outside_the_horizon_is_refused(game: Game, strategy: Strategy) -> None:
    with pytest.raises(IndexError, match="step: 16 is not allowed"):
        predict(game, strategy, 16, np.ones(12))
