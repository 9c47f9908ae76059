"""A soft bound on one state or input of the player."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator
from typing_extensions import Self, override

from gameinfer_ros.games.angles import short_way
from gameinfer_ros.games.costs.cost_term import BoundTerm, CostTerm
from gameinfer_ros.games.kernels import kernel
from gameinfer_ros.games.players import Players
from gameinfer_ros.games.registry import NonNegative, Real
from gameinfer_ros.lanes.array import Array

# index: `_STATE`, `_INPUT` or `_ANGLE`, and the row. params: low, high, weight. Those of an angle
# end with the middle between the bounds, from which low and high count.
_STATE, _INPUT, _ANGLE = range(3)


@kernel
def _excess(x: Array, u: Array, index: Array, params: Array) -> Array:
    if index[0] == _INPUT:
        value = u[index[1]]
    else:
        value = x[index[1]]
        if index[0] == _ANGLE:
            value = short_way(value - params[3])
    return np.minimum(value - params[0], 0.0) + np.maximum(value - params[1], 0.0)


@kernel
def _cost(t: float, x: Array, u: Array, index: Array, params: Array) -> Array:
    excess = _excess(x, u, index, params)
    return params[2] * excess * excess


@kernel
def _quadraticise(
    t: float, x: Array, u: Array, index: Array, params: Array,
    Q: Array, q: Array, R: Array, r: Array,
) -> None:  # fmt: skip
    row, weight = index[1], params[2]
    excess = _excess(x, u, index, params)
    gradient = 2.0 * weight * excess
    curvature = np.where(excess != 0.0, 2.0 * weight, 0.0 * excess)
    if index[0] == _INPUT:
        r[row] += gradient
        R[row, row] += curvature
    else:
        q[row] += gradient
        Q[row, row] += curvature


class SoftBound(CostTerm):
    """The cost w e^2, where e is the amount by which a value is below `low` or above `high`.

    The value is one state or input of the player. An angle modulo a turn, such as a heading, is
    within the bounds if it is for some number of whole turns. If not, it counts from the nearer
    bound.
    """

    kind: Literal["soft_bound"] = "soft_bound"
    of: str = Field(description="name of the state or input, such as `v`")
    low: Real = Field(description="lower bound, in the unit of the state or input")
    high: Real = Field(description="upper bound, in the unit of the state or input")
    weight: NonNegative = Field(
        description="weight w, in the inverse square of the unit of the state or input"
    )
    cost_kernel: ClassVar[Any] = _cost
    quadraticise_kernel: ClassVar[Any] = _quadraticise

    @model_validator(mode="after")
    def _check_order(self) -> Self:
        if self.low > self.high:
            raise ValueError(f"low ({self.low}) must not be above high ({self.high})")
        return self

    @override
    def bind(self, players: Players, i: int) -> list[BoundTerm]:
        dynamics = players.dynamics[i]
        params = (self.low, self.high, self.weight)
        if self.of in dynamics.input_names:
            return [BoundTerm(self, (_INPUT, dynamics.input_names.index(self.of)), params)]
        if self.of in dynamics.state_names:
            row = players.states(i).start + dynamics.state_names.index(self.of)
            if not players.is_angle[row]:
                return [BoundTerm(self, (_STATE, row), params)]
            half, middle = 0.5 * (self.high - self.low), 0.5 * (self.low + self.high)
            return [BoundTerm(self, (_ANGLE, row), (-half, half, self.weight, middle))]
        raise ValueError(
            f"of: '{self.of}' is not allowed: the states and inputs of {players.names[i]} are "
            f"{', '.join(dynamics.state_names + dynamics.input_names)}"
        )
