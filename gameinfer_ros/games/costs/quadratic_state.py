"""A quadratic cost of the player's own state, such as its speed."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field
from typing_extensions import override

from gameinfer_ros.games.angles import difference
from gameinfer_ros.games.costs.cost_term import BoundTerm, CostTerm, check_length
from gameinfer_ros.games.kernels import kernel
from gameinfer_ros.games.players import Players
from gameinfer_ros.games.registry import NonNegative
from gameinfer_ros.lanes.array import Array

# index: rows of the weighted states. params: the time from which the term is active, then, for each
# of these states, the weight, the reference, and 1 if it is an angle modulo a turn or 0 if not.


@kernel
def _cost(t: float, x: Array, u: Array, index: Array, params: Array) -> Array:
    total = 0.0 * x[0]
    if t >= params[0]:
        for j in range(len(index)):
            weight = params[1 + 3 * j]
            away = difference(x[index[j]], params[2 + 3 * j], params[3 + 3 * j])
            total = total + 0.5 * weight * away * away
    return total


@kernel
def _quadraticise(
    t: float, x: Array, u: Array, index: Array, params: Array,
    Q: Array, q: Array, R: Array, r: Array,
) -> None:  # fmt: skip
    if t >= params[0]:
        for j in range(len(index)):
            row, weight = index[j], params[1 + 3 * j]
            Q[row, row] += weight
            q[row] += weight * difference(x[row], params[2 + 3 * j], params[3 + 3 * j])


def bind_states(
    term: CostTerm, players: Players, i: int, weights: tuple[float, ...],
    reference: tuple[float, ...], active_from: float,
) -> BoundTerm:  # fmt: skip
    """Bind a term whose kernels are those of `QuadraticState` to player i.

    Its cost is 1/2 sum_j w_j (x_j - reference_j)^2 from the time `active_from`, in s, on.
    Differences of angles are taken by the short way.

    Raises:
        ValueError: there is not one weight for each state.
    """
    names = players.dynamics[i].state_names
    check_length("weights", weights, names)
    index, params = [], [active_from]
    rows = range(players.n_states)[players.states(i)]
    for row, weight, wanted in zip(rows, weights, reference, strict=True):
        if weight > 0:
            index.append(row)
            params += [weight, wanted, float(players.is_angle[row])]
    return BoundTerm(term, index, params)


class QuadraticState(CostTerm):
    """The cost 1/2 sum_j w_j x_j^2 of the player's own states, at every step.

    Angles modulo a turn, such as headings, count from -pi to pi.
    """

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
