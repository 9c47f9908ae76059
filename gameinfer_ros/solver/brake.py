"""What is played when no equilibrium is known."""

from __future__ import annotations

import numpy as np

from gameinfer_ros.games import Dynamics, Game
from gameinfer_ros.solver.strategy import Strategy


def brake(game: Game, step: int, x: np.ndarray) -> Strategy:
    """Strategy (of one particle) by which all players come to rest, whatever happens.

    Each player's braking input is linear in its own state, or is taken to be so.

    Args:
        game: the game, which tells how its players brake.
        step: the first step of the horizon.
        x: joint state (nx,) at that step.
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
    """Input (m,) by which a player in the state `x` (n,) of the game comes to rest."""
    vehicle = model.vehicle
    s = model.vehicle_state(x, np.zeros(vehicle.n_states))
    return model.game_input(s, vehicle.braking_input(s, dt), dt)
