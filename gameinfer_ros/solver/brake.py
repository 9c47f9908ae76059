"""A braking strategy, for states in which no equilibrium is known."""

from __future__ import annotations

import numpy as np

from gameinfer_ros.games import Dynamics, Game
from gameinfer_ros.solver.strategy import Strategy


def brake(game: Game, step: int, x: np.ndarray) -> Strategy:
    """Return a strategy with which all players brake to a standstill.

    The input of each player depends only on its own state. It is linearised at `x`, which is exact
    for dynamics whose braking input is linear.

    Args:
        game: the game.
        step: the first step of the horizon.
        x: joint state (nx,) at that step.

    Returns:
        Strategies (of one particle) of all players.
    """
    players, T = game.players, game.horizon
    u, P = np.zeros(players.n_inputs), np.zeros((players.n_inputs, players.n_states))
    for i, model in enumerate(players.dynamics):
        own, inputs = players.states(i), players.inputs(i)
        u[inputs] = _braking_input(model, x[own], game.dt)
        for row in range(own.start, own.stop):
            h = np.zeros_like(x)
            h[row] = 1e-4
            ahead = _braking_input(model, (x + h)[own], game.dt)
            behind = _braking_input(model, (x - h)[own], game.dt)
            P[inputs, row] = -(ahead - behind) / 2e-4
    return Strategy(
        step,
        np.tile(x[:, None], (T + 1, 1, 1)),
        np.tile(u[:, None], (T, 1, 1)),
        np.tile(P[..., None], (T, 1, 1, 1)),
    )


def _braking_input(model: Dynamics, x: np.ndarray, dt: float) -> np.ndarray:
    """Return the input (m,) that brings a player from the state `x` (n,) to rest in one step."""
    vehicle = model.vehicle
    s = model.vehicle_state(x, np.zeros(vehicle.n_states))
    return model.game_input(s, vehicle.braking_input(s, dt), dt)
