"""The transition model: what each particle expects of the next time step."""

from __future__ import annotations

import numpy as np

from gameinfer_ros.games import ROBOT, Game
from gameinfer_ros.solver import Strategy


def predict(
    game: Game, strategy: Strategy, step: int, x: np.ndarray, u_robot: np.ndarray | None = None
) -> np.ndarray:
    """State that each particle expects one step after `x`.

    Args:
        game: the game that all play.
        strategy: strategies of K particles whose horizon contains `step`.
        step: the step that `x` belongs to.
        x: joint state (nx,).
        u_robot: the robot's real input (m_0,) at `step`; its part of each particle's strategy
            if not given.

    Returns:
        Predicted joint states (nx, K).
    """
    u = strategy.inputs(step, x)
    if u_robot is not None:
        u[game.players.inputs(ROBOT)] = u_robot[:, None]
    return game.step(np.repeat(x[:, None], len(strategy), axis=1), u)
