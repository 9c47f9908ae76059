"""A quadratic cost of the player's own state, such as its speed."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field
from typing_extensions import override

from gameinfer_ros.games.costs.cost_term import BoundTerm, CostTerm, check_length
from gameinfer_ros.games.kernels import kernel
from gameinfer_ros.games.players import Players
from gameinfer_ros.games.registry import NonNegative
from gameinfer_ros.lanes.array import Array

# index: rows of the weighted states. params: the time from which the term is active, then the
# weight and the reference of each of these states.


@kernel
def _cost(t: float, x: Array, u: Array, index: Array, params: Array) -> Array:
    total = 0.0 * x[0]
    if t >= params[0]:
        for j in range(len(index)):
            weight, difference = params[1 + 2 * j], x[index[j]] - params[2 + 2 * j]
            total = total + 0.5 * weight * difference * difference
    return total


@kernel
def _quadraticise(
    t: float, x: Array, u: Array, index: Array, params: Array,
    Q: Array, q: Array, R: Array, r: Array,
) -> None:  # fmt: skip
    if t >= params[0]:
        for j in range(len(index)):
            row, weight, reference = index[j], params[1 + 2 * j], params[2 + 2 * j]
            Q[row, row] += weight
            q[row] += weight * (x[row] - reference)


def bind_states(
    term: CostTerm, players: Players, i: int, weights: tuple[float, ...],
    reference: tuple[float, ...], active_from: float,
) -> BoundTerm:  # fmt: skip
    """Bind a term whose kernels are those of `QuadraticState` to player i.

    Its cost is 1/2 sum_j w_j (x_j - reference_j)^2 from the time `active_from`, in s, on.

    Raises:
        ValueError: there is not one weight for each state.
    """
    names = players.dynamics[i].state_names
    check_length("weights", weights, names)
    rows = np.arange(players.n_states)[players.states(i)]
    used = [j for j, weight in enumerate(weights) if weight > 0]
    params = [active_from]
    for j in used:
        params += [weights[j], reference[j]]
    return BoundTerm(term, [int(rows[j]) for j in used], params)


class QuadraticState(CostTerm):
    """The cost 1/2 sum_j w_j x_j^2 of the player's own states, at every step."""

    kind: Literal["quadratic_state"] = "quadratic_state"
    weights: tuple[NonNegative, ...] = Field(
        description="weights w, one for each state of the player"
    )
    cost_kernel: ClassVar[Any] = _cost
    quadraticise_kernel: ClassVar[Any] = _quadraticise

    @override
    def bind(self, players: Players, i: int) -> list[BoundTerm]:
        zero = (0.0,) * len(self.weights)
        return [bind_states(self, players, i, self.weights, zero, -np.inf)]
