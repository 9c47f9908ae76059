"""A plan: the next few inputs of one player."""

from __future__ import annotations

import numpy as np

from gameinfer_ros.games import Players
from gameinfer_ros.solver import Strategy


def plan(
    strategy: Strategy, players: Players, player: int, step: int, x: np.ndarray, length: int
) -> np.ndarray:
    """The inputs of one player from `step` on.

    The first is the strategy's reaction to the state `x`; the others are what it expects to do
    later, should no newer state arrive.

    Args:
        strategy: strategies of one particle, of all players or of this one alone.
        players: the players of the game.
        player: index of the player.
        step: the step that `x` belongs to; it must be in the horizon of `strategy`.
        x: joint state (nx,).
        length: number of inputs wanted.

    Returns:
        Inputs (S, m), with S = `length` or fewer where the horizon ends before.

    Raises:
        IndexError: the horizon does not contain `step`.
    """
    own = players.inputs(player)
    inputs = strategy.inputs(step, x)[:, 0]
    k = step - strategy.first_step
    later = strategy.u_ref[k + 1 : k + length, :, 0]
    sequence = np.vstack([inputs, later])
    return sequence if sequence.shape[1] == own.stop - own.start else sequence[:, own]
