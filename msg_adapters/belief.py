"""The belief over equilibria: a labelled std_msgs/Float64MultiArray.

A row is a particle and holds its number, its weight, whether it is settled (1 or 0), and its cost
to each player along the horizon. Before the table stand the stamp and the number of the MAP
particle, -1 if there is none that anybody knows of.
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
    """What a belief message says.

    Attributes:
        stamp: time of the step whose state was weighed last, in ns.
        map: number of the MAP particle; it may be one that is not among the particles any more.
        ids: number of each particle (K,).
        weights: probability of each particle (K,).
        settled: whether each particle's equilibrium was found anew in the last update (K,).
        costs: cost of each particle's trajectory to each player (K, N); may be infinite where
            a particle is not settled.
    """

    stamp: int
    map: int
    ids: np.ndarray
    weights: np.ndarray
    settled: np.ndarray
    costs: np.ndarray


def encode(belief: BeliefSummary) -> Float64MultiArray:
    """Message with a belief."""
    table = np.column_stack([belief.ids, belief.weights, belief.settled, belief.costs])
    return multi_array.encode(belief.stamp, [belief.map], table, _labels(belief.costs.shape[1]))


def decode(message: Float64MultiArray, players: int) -> BeliefSummary:
    """What a message says about the belief over a game of this many players.

    Raises:
        MessageError: the layout is another, there is no particle, a weight is not between 0 and
            1, or an id or a flag is not a whole number.
    """
    time, prefix, table = multi_array.decode(message, 1, _labels(players), 3 + players)
    ids, weights, settled = table[:, 0], table[:, 1], table[:, 2]
    check_whole("map", prefix, lowest=-1)
    check_whole("id", ids)
    if not ((weights >= 0) & (weights <= 1)).all():
        raise MessageError(f"weight: {weights.tolist()} is not allowed: each is from 0 to 1")
    if not np.isin(settled, (0.0, 1.0)).all():
        raise MessageError(f"settled: {settled.tolist()} is not allowed: each is 0 or 1")
    return BeliefSummary(
        time, int(prefix[0]), ids.astype(int), weights, settled == 1.0, table[:, 3:]
    )


def _labels(players: int) -> tuple[str, str]:
    return "particle", f"id weight settled cost[{players}]"
