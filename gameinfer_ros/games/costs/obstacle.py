"""An obstacle: a circle that stands still, and that players do not want to be in."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import Field
from typing_extensions import override

from gameinfer_ros.games.costs.cost_term import BoundTerm, CostTerm
from gameinfer_ros.games.costs.proximity import deficit_cost, deficit_derivatives
from gameinfer_ros.games.kernels import kernel
from gameinfer_ros.games.players import Players
from gameinfer_ros.games.registry import NonNegative, Positive, Real
from gameinfer_ros.lanes.lanes import Array

# The index holds the rows of the player's position; the parameters are the centre, the radius and
# the weight.


@kernel
def _cost(t: float, x: Array, u: Array, index: Array, params: Array) -> Array:
    dx, dy = x[index[0]] - params[0], x[index[1]] - params[1]
    return deficit_cost(dx, dy, params[2], params[3])


@kernel
def _quadraticise(
    t: float, x: Array, u: Array, index: Array, params: Array,
    Q: Array, q: Array, R: Array, r: Array,
) -> None:  # fmt: skip
    row_x, row_y = index[0], index[1]
    dx, dy = x[row_x] - params[0], x[row_y] - params[1]
    gx, gy, hxx, hyy, hxy = deficit_derivatives(dx, dy, params[2], params[3])
    q[row_x] += gx
    q[row_y] += gy
    Q[row_x, row_x] += hxx
    Q[row_y, row_y] += hyy
    Q[row_x, row_y] += hxy
    Q[row_y, row_x] += hxy


class Obstacle(CostTerm):
    """w max(0, radius - d)^2, with d the distance of the player's position to `center`.

    The cost acts only within `radius`, and is soft: players cut into the circle where that pays.
    The radius is therefore that of the thing itself, plus half a player, plus a margin. Closer to
    the centre than `proximity.NEAR` times the radius, derivatives are faded as for `Proximity`.
    """

    kind: Literal["obstacle"] = "obstacle"
    center: tuple[Real, Real] = Field(description="(x, y), in m")
    radius: Positive = Field(description="where the cost begins, in m from the centre")
    weight: NonNegative = Field(description="w, in 1/m^2")
    cost_kernel: ClassVar[Any] = _cost
    quadraticise_kernel: ClassVar[Any] = _quadraticise

    @override
    def bind(self, players: Players, i: int) -> list[BoundTerm]:
        params = (*self.center, self.radius, self.weight)
        return [BoundTerm(self, players.position_rows(i), params)]
