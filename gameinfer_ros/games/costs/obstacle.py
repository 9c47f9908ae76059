"""An obstacle: a static circle that players avoid."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import Field
from typing_extensions import override

from gameinfer_ros.games.costs.cost_term import BoundTerm, CostTerm
from gameinfer_ros.games.costs.proximity import deficit_cost, deficit_derivatives
from gameinfer_ros.games.kernels import kernel
from gameinfer_ros.games.players import Players
from gameinfer_ros.games.registry import NonNegative, Positive, Real
from gameinfer_ros.lanes.array import Array

# index: rows of the player's position. params: centre (x, y), radius, weight.


@kernel
def _cost(t: float, x: Array, u: Array, index: Array, params: Array) -> Array:
    dx, dy = x[index[0]] - params[0], x[index[1]] - params[1]
    return deficit_cost(dx, dy, params[2], params[3])


@kernel
def _quadraticise(
    t: float, x: Array, u: Array, index: Array, params: Array,
    Q: Array, q: Array, R: Array, r: Array,
) -> None:  # fmt: skip
    _add(x, index, params, 1.0, Q, q)


@kernel
def _gauss_newton(
    t: float, x: Array, u: Array, index: Array, params: Array,
    Q: Array, q: Array, R: Array, r: Array,
) -> None:  # fmt: skip
    _add(x, index, params, 0.0, Q, q)


@kernel
def _add(x: Array, index: Array, params: Array, tangential: float, Q: Array, q: Array) -> None:
    row_x, row_y = index[0], index[1]
    dx, dy = x[row_x] - params[0], x[row_y] - params[1]
    gx, gy, hxx, hyy, hxy = deficit_derivatives(dx, dy, params[2], params[3], tangential)
    q[row_x] += gx
    q[row_y] += gy
    Q[row_x, row_x] += hxx
    Q[row_y, row_y] += hyy
    Q[row_x, row_y] += hxy
    Q[row_y, row_x] += hxy


class Obstacle(CostTerm):
    """The cost w max(0, radius - d)^2, where d is the distance of the player from `center`.

    The distance is measured from the edge of the player if it has a radius. The cost is soft: a
    player may cross the edge of the circle if that lowers its total cost. Choose a radius that
    includes the obstacle, a margin, and half the width of a player without a radius of its own.
    Near the centre, derivatives are scaled down as for `Proximity`.
    """

    kind: Literal["obstacle"] = "obstacle"
    center: tuple[Real, Real] = Field(description="centre (x, y) of the circle, in m")
    radius: Positive = Field(description="distance from the centre below which the cost acts, in m")
    weight: NonNegative = Field(description="weight w, in 1/m^2")
    cost_kernel: ClassVar[Any] = _cost
    quadraticise_kernel: ClassVar[Any] = _quadraticise
    gauss_newton_kernel: ClassVar[Any] = _gauss_newton

    @override
    def bind(self, players: Players, i: int) -> list[BoundTerm]:
        params = (*self.center, self.radius + float(players.radii[i]), self.weight)
        return [BoundTerm(self, players.position_rows(i), params)]
