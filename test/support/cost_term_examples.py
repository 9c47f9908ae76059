"""Examples of every kind of cost term, and what they come to.

A new kind joins the tests by an entry in EXAMPLES.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gameinfer_ros.games import (
    BoundTerm,
    CostTerm,
    DoubleIntegrator,
    Goal,
    Obstacle,
    Players,
    Proximity,
    QuadraticInput,
    QuadraticState,
    RoadLane,
    SoftBound,
    Unicycle,
)

PLAYERS = Players({"robot": Unicycle(), "ana": DoubleIntegrator(), "ben": Unicycle()})

#: value(t, x, u): cost of one lane, from the joint state (nx,) and the player's own input (m,).
Value = Callable[[float, np.ndarray, np.ndarray], float]


@dataclass(frozen=True)
class Example:
    """A term as one player has it, and its value in other words."""

    term: CostTerm
    player: str
    value: Value


def excess(value: float, low: float, high: float) -> float:
    return max(low - value, value - high, 0.0)


def short_way(difference: float) -> float:
    """A difference of two angles, from -pi to pi."""
    return float(np.angle(np.exp(1j * difference)))


def closeness(t: float, x: np.ndarray, u: np.ndarray) -> float:
    ana, robot, ben = x[[4, 6]], x[0:2], x[8:10]
    return sum(
        7.0 * (2.0 - np.hypot(*(ana - other))) ** 2
        for other in (robot, ben)
        if np.hypot(*(ana - other)) < 2.0
    )


def distance_to(points: np.ndarray, position: np.ndarray) -> float:
    """Distance of a position (2,) to the polyline through `points` (P, 2)."""
    distances = []
    for a, b in pairwise(points):
        share = np.clip(np.dot(position - a, b - a) / np.dot(b - a, b - a), 0.0, 1.0)
        distances.append(np.hypot(*(position - (a + share * (b - a)))))
    return min(distances)


ZIGZAG = ((-1.0, -0.5), (0.5, -0.5), (0.0, 0.5), (1.5, 1.0))

GOALS = {"robot": (3.0, 0.0, 0.5, 0.0), "ana": (1.0, -2.0, 0.0, 0.5), "ben": (0.0, 1.0, 2.0, 0.0)}

EXAMPLES: dict[str, list[Example]] = {
    "quadratic_input": [
        Example(
            QuadraticInput(weights=(2.0, 3.0)),
            "ben",
            lambda t, x, u: 0.5 * (2.0 * u[0] ** 2 + 3.0 * u[1] ** 2),
        )
    ],
    "quadratic_state": [
        Example(
            QuadraticState(weights=(0.0, 2.0, 0.0, 3.0)),
            "ana",
            lambda t, x, u: 0.5 * (2.0 * x[5] ** 2 + 3.0 * x[7] ** 2),
        ),
        Example(
            QuadraticState(weights=(1.0, 0.0, 4.0, 0.0)),
            "ben",
            lambda t, x, u: 0.5 * (x[8] ** 2 + 4.0 * short_way(x[10]) ** 2),
        ),
    ],
    "soft_bound": [
        Example(
            SoftBound(of="v", low=-0.5, high=0.25, weight=50.0, players=("robot", "ben")),
            "ben",
            lambda t, x, u: 50.0 * excess(x[11], -0.5, 0.25) ** 2,
        ),
        Example(
            SoftBound(of="ay", low=-0.5, high=0.25, weight=50.0, players=("ana",)),
            "ana",
            lambda t, x, u: 50.0 * excess(u[1], -0.5, 0.25) ** 2,
        ),
        Example(
            SoftBound(of="theta", low=2.5, high=3.5, weight=50.0, players=("robot", "ben")),
            "ben",
            lambda t, x, u: 50.0 * excess(short_way(x[10] - 3.0), -0.5, 0.5) ** 2,
        ),
    ],
    "proximity": [Example(Proximity(radius=2.0, weight=7.0), "ana", closeness)],
    "obstacle": [
        Example(
            Obstacle(center=(0.5, -0.2), radius=1.5, weight=7.0),
            "ana",
            lambda t, x, u: 7.0 * max(0.0, 1.5 - np.hypot(x[4] - 0.5, x[6] + 0.2)) ** 2,
        )
    ],
    "lane": [
        Example(
            RoadLane(points=ZIGZAG, half_width=half_width, weight=7.0),
            "ana",
            lambda t, x, u, half_width=half_width: (
                7.0 * max(0.0, distance_to(np.array(ZIGZAG), x[[4, 6]]) - half_width) ** 2
            ),
        )
        for half_width in (0.3, 0.0)
    ],
    "goal": [
        Example(
            Goal(weights=(300.0, 200.0, 100.0, 0.0), goals=GOALS, active_from=1.0),
            "ben",
            lambda t, x, u: (
                0.5
                * np.dot(
                    [300.0, 200.0, 100.0],
                    np.square([x[8], x[9] - 1.0, short_way(x[10] - 2.0)]),
                )
                if t >= 1.0
                else 0.0
            ),
        )
    ],
}


def numbers(bound: BoundTerm) -> tuple[np.ndarray, np.ndarray]:
    """Index and parameters as kernels get them."""
    return np.array(bound.index, dtype=np.int64), np.array(bound.params, dtype=float)


def cost(example: Example, t: float, x: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Cost (L,) at the joint states (nx, L) and own inputs (m, L)."""
    out = np.zeros(x.shape[1])
    for bound in example.term.bind(PLAYERS, PLAYERS.index(example.player)):
        out += type(bound.term).cost_kernel(t, x, u, *numbers(bound))
    return out


def quadraticise(
    example: Example, t: float, x: np.ndarray, u: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Q (nx, nx, L), q (nx, L), R (m, m, L), r (m, L)."""
    nx, m, L = len(x), len(u), x.shape[1]
    out = np.zeros((nx, nx, L)), np.zeros((nx, L)), np.zeros((m, m, L)), np.zeros((m, L))
    for bound in example.term.bind(PLAYERS, PLAYERS.index(example.player)):
        type(bound.term).quadraticise_kernel(t, x, u, *numbers(bound), *out)
    return out
