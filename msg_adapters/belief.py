"""The belief over equilibria: a labelled std_msgs/Float64MultiArray.

A row is a particle and holds its number, its weight, whether it converged (1 or 0), and its cost
to each player along the horizon.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from std_msgs.msg import Float64MultiArray

from msg_adapters import multi_array
from msg_adapters.error import MessageError, check_whole


@dataclass(frozen=True)
class BeliefSummary:
    """What a belief message says.

    Attributes:
        step: the step of the newest state that was weighed.
        ids: number of each particle (K,).
        weights: probability of each particle (K,).
        converged: whether each particle's strategy is a converged one (K,).
        costs: cost of each particle's trajectory to each player (K, N); may be infinite where
            a particle did not converge.
    """

    step: int
    ids: np.ndarray
    weights: np.ndarray
    converged: np.ndarray
    costs: np.ndarray

    @property
    def map(self) -> int:
        """Index of the heaviest of the converged particles (of all if none converged)."""
        candidates = self.converged if self.converged.any() else np.ones_like(self.converged)
        return int(np.argmax(np.where(candidates, self.weights, -1.0)))


def encode(belief: BeliefSummary, dt: float) -> Float64MultiArray:
    """Message with a belief."""
    table = np.column_stack([belief.ids, belief.weights, belief.converged, belief.costs])
    return multi_array.encode(belief.step, [], table, _labels(belief.costs.shape[1]), dt)


def decode(message: Float64MultiArray, players: int, dt: float) -> BeliefSummary:
    """What a message says about the belief over a game of this many players.

    Raises:
        MessageError: the layout is another, the stamp is between steps, there is no particle, a
            weight is not between 0 and 1, or an id or a flag is not a whole number.
    """
    step, _, table = multi_array.decode(message, 0, _labels(players), 3 + players, dt)
    ids, weights, converged = table[:, 0], table[:, 1], table[:, 2]
    check_whole("id", ids)
    if not ((weights >= 0) & (weights <= 1)).all():
        raise MessageError(f"weight: {weights.tolist()} is not allowed: each is from 0 to 1")
    if not np.isin(converged, (0.0, 1.0)).all():
        raise MessageError(f"converged: {converged.tolist()} is not allowed: each is 0 or 1")
    return BeliefSummary(step, ids.astype(int), weights, converged == 1.0, table[:, 3:])


def _labels(players: int) -> tuple[str, str]:
    return "particle", f"id weight converged cost[{players}]"
