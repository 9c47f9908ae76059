"""A lane: a strip along a polyline, such as a corridor, in which players stay."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field, field_validator
from typing_extensions import override

from gameinfer_ros.games.costs.cost_term import BoundTerm, CostTerm
from gameinfer_ros.games.kernels import kernel
from gameinfer_ros.games.players import Players
from gameinfer_ros.games.registry import NonNegative, Real
from gameinfer_ros.lanes.array import Array

# index: rows of the player's position. params: half width and weight, then the start (x, y), the
# unit vector and the length of each segment.

#: Smallest denominator, in m, which avoids 0/0 in a lane without a width.
TINY = 1e-150


@kernel
def _nearest(px: Array, py: Array, params: Array) -> Any:
    """Find the nearest point of the polyline to (px, py).

    Returns `along`, `across`, `tx`, `ty`. (tx, ty) is the unit vector of the segment with the
    nearest point; `along` and `across` are the distances, in m, from that point along the segment
    and to its left. `along` is 0 except beyond the ends of the segment.
    """
    # nan if the position is: comparisons alone would hide it.
    none = 0.0 * (px + py)
    nearest, along, across, tx, ty = none + np.inf, none, none, none, none
    for j in range(2, len(params), 5):
        dx, dy, ex, ey = px - params[j], py - params[j + 1], params[j + 2], params[j + 3]
        position = dx * ex + dy * ey
        beyond = position - np.maximum(np.minimum(position, params[j + 4]), 0.0)
        left = dy * ex - dx * ey
        squared = beyond * beyond + left * left
        nearer = squared <= nearest  # <=, because both may be infinite
        nearest = np.where(nearer, squared, nearest)
        along = np.where(nearer, beyond, along)
        across = np.where(nearer, left, across)
        tx = np.where(nearer, ex, tx)
        ty = np.where(nearer, ey, ty)
    return along, across, tx, ty


@kernel
def _cost(t: float, x: Array, u: Array, index: Array, params: Array) -> Array:
    along, across, _, _ = _nearest(x[index[0]], x[index[1]], params)
    excess = np.maximum(np.sqrt(along * along + across * across) - params[0], 0.0)
    return params[1] * excess * excess


@kernel
def _quadraticise(
    t: float, x: Array, u: Array, index: Array, params: Array,
    Q: Array, q: Array, R: Array, r: Array,
) -> None:  # fmt: skip
    # With n the unit vector from the nearest point to the player, c = half_width / d and
    # s = 1 - c, the gradient is 2 w s d n. The Hessian is 2 w n n' beside a segment, and
    # 2 w (s I + c n n') around a vertex. In the frame of the segment, with n = (nt, nn), they
    # differ only in the element along the segment, and no direction is needed where d = 0.
    row_x, row_y, half_width = index[0], index[1], params[0]
    along, across, tx, ty = _nearest(x[row_x], x[row_y], params)
    d = np.sqrt(along * along + across * across)
    # >=, so that a lane without a width has a curvature on the polyline too.
    w = np.where(d >= half_width, 2.0 * params[1], 0.0 * d)
    d = np.maximum(d, max(half_width, TINY))
    nt, nn, c = along / d, across / d, half_width / d
    s = 1.0 - c
    htt = w * np.where(along == 0.0, 0.0, s + c * nt * nt)
    hnn = w * (s + c * nn * nn)
    htn = w * c * nt * nn
    hxy = (htt - hnn) * tx * ty + htn * (tx * tx - ty * ty)
    q[row_x] += w * s * (along * tx - across * ty)
    q[row_y] += w * s * (along * ty + across * tx)
    Q[row_x, row_x] += htt * tx * tx - 2.0 * htn * tx * ty + hnn * ty * ty
    Q[row_y, row_y] += htt * ty * ty + 2.0 * htn * tx * ty + hnn * tx * tx
    Q[row_x, row_y] += hxy
    Q[row_y, row_x] += hxy


class RoadLane(CostTerm):
    """The cost w max(0, d - half_width)^2, where d is the distance of the player from a polyline.

    A player with a radius is to stay in the lane as a whole: its distance is that of its farthest
    point. If the lane is too narrow for it, the cost acts from the polyline on, as with a
    `half_width` of 0.

    The polyline is open. Beyond its ends, d is the distance from the end point. If several points
    are equally near, as inside a corner, the derivatives are those for one of them. At
    d = half_width, the Hessian is that of the outside.
    """

    kind: Literal["lane"] = "lane"
    points: tuple[tuple[Real, Real], ...] = Field(
        min_length=2,
        description="points (x, y) of the polyline, in m; consecutive points must differ",
    )
    half_width: NonNegative = Field(
        description="distance from the polyline above which the cost acts, in m"
    )
    weight: NonNegative = Field(description="weight w, in 1/m^2")
    cost_kernel: ClassVar[Any] = _cost
    quadraticise_kernel: ClassVar[Any] = _quadraticise

    @field_validator("points")
    @classmethod
    def _check_distinct(
        cls, points: tuple[tuple[float, float], ...]
    ) -> tuple[tuple[float, float], ...]:
        for j, (one, other) in enumerate(pairwise(points)):
            if one == other:
                raise ValueError(
                    f"points[{j}] and [{j + 1}] are both {list(one)}; consecutive points must "
                    "differ"
                )
        return points

    @override
    def bind(self, players: Players, i: int) -> list[BoundTerm]:
        params = [max(0.0, self.half_width - float(players.radii[i])), self.weight]
        for (ax, ay), (bx, by) in pairwise(self.points):
            length = math.hypot(bx - ax, by - ay)
            params += [ax, ay, (bx - ax) / length, (by - ay) / length, length]
        return [BoundTerm(self, players.position_rows(i), params)]
