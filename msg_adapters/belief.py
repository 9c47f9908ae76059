"""The belief over equilibria: a labelled std_msgs/Float64MultiArray.

Each row of the table is a particle: its number, its weight, whether it is settled (1 or 0), and the
cost of each player along the horizon. The stamp and the number of the MAP particle precede the
table; the number is -1 if no equilibrium is known.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from msg_adapters import multi_array
from msg_adapters.error import MessageError, check_whole

if TYPE_CHECKING:
    from std_msgs.msg import Float64MultiArray


@dataclass(frozen=True)
class BeliefSummary:
    """The contents of a belief message, for K particles and N players.

    Attributes:
        stamp: stamp of the last weighed state, in ns.
        map: number of the MAP particle, -1 if no equilibrium is known. It may be a particle that
            is no longer in the belief.
        ids: number of each particle (K,).
        weights: probability of each particle (K,).
        settled: whether the last update reached each particle and its solve converged (K,).
        costs: cost of each particle's trajectory for each player (K, N). It may be infinite if
            the particle is not settled.
    """

    stamp: int
    map: int
    ids: np.ndarray
    weights: np.ndarray
    settled: np.ndarray
    costs: np.ndarray

    @property
    def probabilities(self) -> dict[int, float]:
        """Probability of each particle, by its number."""
        return dict(zip(self.ids.tolist(), self.weights.tolist(), strict=True))


def encode(belief: BeliefSummary) -> Float64MultiArray:
    """Convert a belief to a message."""
    table = np.column_stack([belief.ids, belief.weights, belief.settled, belief.costs])
    return multi_array.encode(belief.stamp, [belief.map], table, _labels(belief.costs.shape[1]))


def decode(message: Float64MultiArray, players: int) -> BeliefSummary:
    """Convert a message about a game with this number of players to a belief.

    Raises:
        MessageError: the layout does not match, there are no particles, a weight is not from 0 to
            1, or a number or flag is invalid.
    """
    time, prefix, table = multi_array.decode(message, 1, _labels(players), 3 + players)
    ids, weights, settled = table[:, 0], table[:, 1], table[:, 2]
    check_whole("map", prefix, lowest=-1)
    check_whole("id", ids)
    if not ((weights >= 0) & (weights <= 1)).all():
        raise MessageError(f"weight: {weights.tolist()} is not allowed: each must be from 0 to 1")
    if not np.isin(settled, (0.0, 1.0)).all():
        raise MessageError(f"settled: {settled.tolist()} is not allowed: each must be 0 or 1")
    return BeliefSummary(
        time, int(prefix[0]), ids.astype(int), weights, settled == 1.0, table[:, 3:]
    )


def _labels(players: int) -> tuple[str, str]:
    return "particle", f"id weight settled cost[{players}]"
