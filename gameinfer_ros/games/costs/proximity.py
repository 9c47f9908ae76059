"""Proximity: players keep a distance from each other."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field
from typing_extensions import override

from gameinfer_ros.games.costs.cost_term import BoundTerm, CostTerm
from gameinfer_ros.games.kernels import kernel
from gameinfer_ros.games.players import Players
from gameinfer_ros.games.registry import NonNegative, Positive
from gameinfer_ros.lanes.array import Array

# index: rows of the player's position and of the other's. params: distance of the positions below
# which the cost acts, weight.

#: Fraction of the radius below which derivatives are scaled down.
NEAR = 1e-3


@kernel
def deficit_cost(dx: Array, dy: Array, radius: float, weight: float) -> Array:
    """Return the cost w max(0, radius - d)^2 of a distance d = |(dx, dy)|."""
    deficit = np.maximum(radius - np.sqrt(dx * dx + dy * dy), 0.0)
    return weight * deficit * deficit


@kernel
def deficit_derivatives(
    dx: Array, dy: Array, radius: float, weight: float, tangential: float
) -> Any:
    """Return the derivatives gx, gy, hxx, hyy, hxy of `deficit_cost` by dx and dy.

    With n the unit vector along (dx, dy), the gradient is 2 w (d - radius) n, and the Hessian is
    2 w (n n' + s (I - n n')) with s = (d - radius) / d. `tangential`, 1 or 0, multiplies s, which
    is negative: without it, the second derivatives are those of Gauss and Newton.
    """
    d = np.sqrt(dx * dx + dy * dy)
    w = np.where(d < radius, 2.0 * weight, 0.0 * d)
    d = np.maximum(d, NEAR * radius)
    nx, ny = dx / d, dy / d
    s = tangential * ((d - radius) / d)
    gx, gy = w * (d - radius) * nx, w * (d - radius) * ny
    hxx = w * (nx * nx + s * (1.0 - nx * nx))
    hyy = w * (ny * ny + s * (1.0 - ny * ny))
    hxy = w * (1.0 - s) * nx * ny
    return gx, gy, hxx, hyy, hxy


@kernel
def _cost(t: float, x: Array, u: Array, index: Array, params: Array) -> Array:
    dx, dy = x[index[0]] - x[index[2]], x[index[1]] - x[index[3]]
    return deficit_cost(dx, dy, params[0], params[1])


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
    # The position of the other player has the opposite sign.
    x0, y0, x1, y1 = index[0], index[1], index[2], index[3]
    dx, dy = x[x0] - x[x1], x[y0] - x[y1]
    gx, gy, hxx, hyy, hxy = deficit_derivatives(dx, dy, params[0], params[1], tangential)
    q[x0] += gx
    q[y0] += gy
    q[x1] -= gx
    q[y1] -= gy
    Q[x0, x0] += hxx
    Q[x1, x1] += hxx
    Q[x0, x1] -= hxx
    Q[x1, x0] -= hxx
    Q[y0, y0] += hyy
    Q[y1, y1] += hyy
    Q[y0, y1] -= hyy
    Q[y1, y0] -= hyy
    Q[x0, y0] += hxy
    Q[y0, x0] += hxy
    Q[x1, y1] += hxy
    Q[y1, x1] += hxy
    Q[x0, y1] -= hxy
    Q[y1, x0] -= hxy
    Q[x1, y0] -= hxy
    Q[y0, x1] -= hxy


class Proximity(CostTerm):
    """The cost w max(0, radius - d)^2 for each other player, where d is the distance to it.

    The distance is measured from edge to edge if players have a radius, and negative if they
    overlap.

    At one position, the gradient has no direction. If the distance of the positions is below 0.001
    times that at which the cost begins, the unit vector between the players is therefore scaled
    down with it, which keeps all derivatives finite.
    """

    kind: Literal["proximity"] = "proximity"
    radius: Positive = Field(description="distance below which the cost acts, in m")
    weight: NonNegative = Field(description="weight w, in 1/m^2")
    cost_kernel: ClassVar[Any] = _cost
    quadraticise_kernel: ClassVar[Any] = _quadraticise
    gauss_newton_kernel: ClassVar[Any] = _gauss_newton

    @override
    def bind(self, players: Players, i: int) -> list[BoundTerm]:
        own, radii = players.position_rows(i), players.radii.tolist()
        return [
            BoundTerm(
                self,
                own + players.position_rows(j),
                (self.radius + (radii[i] + radii[j]), self.weight),
            )
            for j in range(len(players))
            if j != i
        ]
