"""The transition model: the next state that each particle predicts."""

from __future__ import annotations

import numpy as np

from gameinfer_ros.games import ROBOT, Game
from gameinfer_ros.solver import Strategy


def predict(
    game: Game, strategy: Strategy, step: int, x: np.ndarray, u_robot: np.ndarray | None = None
) -> np.ndarray:
    """Predict the state one step after `x` for each particle.

    Args:
        game: the game.
        strategy: strategies of K particles; their horizon must contain `step`.
        step: step of `x`.
        x: joint state (nx,).
        u_robot: input (m_0,) that the robot applied at `step`. By default, the robot follows its
            part of each particle's strategy.

    Returns:
        Predicted joint states (nx, K).
    """
    u = strategy.near(step, x, game.players.is_angle).inputs(step, x)
    if u_robot is not None:
        u[game.players.inputs(ROBOT)] = u_robot[:, None]
    return game.step(np.repeat(x[:, None], len(strategy), axis=1), u)
