"""A quadratic cost of the player's own input."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import Field
from typing_extensions import override

from gameinfer_ros.games.costs.cost_term import BoundTerm, CostTerm, check_length
from gameinfer_ros.games.kernels import kernel
from gameinfer_ros.games.players import Players
from gameinfer_ros.games.registry import NonNegative
from gameinfer_ros.lanes.array import Array


@kernel
def _cost(t: float, x: Array, u: Array, index: Array, params: Array) -> Array:
    total = 0.0 * u[0]
    for j in range(len(u)):
        total = total + 0.5 * params[j] * u[j] * u[j]
    return total


@kernel
def _quadraticise(
    t: float, x: Array, u: Array, index: Array, params: Array,
    Q: Array, q: Array, R: Array, r: Array,
) -> None:  # fmt: skip
    for j in range(len(u)):
        R[j, j] += params[j]
        r[j] += params[j] * u[j]


class QuadraticInput(CostTerm):
    """The cost 1/2 sum_j w_j u_j^2 of the player's own inputs."""

    kind: Literal["quadratic_input"] = "quadratic_input"
    weights: tuple[NonNegative, ...] = Field(
        description="weights w, one for each input of the player"
    )
    cost_kernel: ClassVar[Any] = _cost
    quadraticise_kernel: ClassVar[Any] = _quadraticise

    @override
    def bind(self, players: Players, i: int) -> list[BoundTerm]:
        check_length("weights", self.weights, players.dynamics[i].input_names)
        return [BoundTerm(self, (), self.weights)]
