"""Every kind of cost term is held against its formula and against finite differences.

A new kind joins the tests by an entry in EXAMPLES.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from numba import njit
from pydantic import ValidationError

from gameinfer_ros.games import (
    BoundTerm,
    CostTerm,
    DoubleIntegrator,
    Goal,
    Lane,
    Obstacle,
    Players,
    Proximity,
    QuadraticInput,
    QuadraticState,
    SoftBound,
    Unicycle,
)
from gameinfer_ros.games.addresses import call
from gameinfer_ros.games.blocks import block, from_blocks, in_blocks
from gameinfer_ros.games.kernels import Array, GameKernels, tabulate
from gameinfer_ros.games.numbers import part
from gameinfer_ros.games.proximity import NEAR

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
        ),
    ],
    "quadratic_state": [
        Example(
            QuadraticState(weights=(0.0, 2.0, 0.0, 3.0)),
            "ana",
            lambda t, x, u: 0.5 * (2.0 * x[5] ** 2 + 3.0 * x[7] ** 2),
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
    ],
    "proximity": [Example(Proximity(radius=2.0, weight=7.0), "ana", closeness)],
    "obstacle": [
        Example(
            Obstacle(center=(0.5, -0.2), radius=1.5, weight=7.0),
            "ana",
            lambda t, x, u: 7.0 * max(0.0, 1.5 - np.hypot(x[4] - 0.5, x[6] + 0.2)) ** 2,
        ),
    ],
    "lane": [
        Example(
            Lane(points=ZIGZAG, half_width=half_width, weight=7.0),
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
                0.5 * np.dot([300, 200, 100], (x[8:11] - [0.0, 1.0, 2.0]) ** 2) if t >= 1.0 else 0.0
            ),
        ),
    ],
}
ALL = [
    pytest.param(example, id=f"{kind}-{j}")
    for kind in sorted(CostTerm.family)
    for j, example in enumerate(EXAMPLES.get(kind, []))
]
TIMES = (0.0, 0.999, 1.0, 5.0)


def test_every_kind_has_an_example() -> None:
    missing = set(CostTerm.family) - set(EXAMPLES)
    assert not missing, f"give examples of {missing} in EXAMPLES"


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


def random_lanes(seed: int, L: int = 60) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.normal(0.0, 1.0, (PLAYERS.n_states, L)), rng.normal(0.0, 1.0, (2, L))


def differences(
    function: Callable[[np.ndarray], np.ndarray], at: np.ndarray, h: float = 1e-6
) -> np.ndarray:
    """Central differences of function(at) (..., L) by each row of `at` (n, L): (..., n, L)."""
    columns = []
    for row in range(len(at)):
        delta = np.zeros_like(at)
        delta[row] = h
        columns.append((function(at + delta) - function(at - delta)) / (2 * h))
    return np.stack(columns, axis=-2)


@pytest.mark.parametrize("t", TIMES)
@pytest.mark.parametrize("example", ALL)
def test_cost_is_that_of_the_formula(example: Example, t: float) -> None:
    x, u = random_lanes(0)
    expected = [example.value(t, x[:, lane], u[:, lane]) for lane in range(x.shape[1])]
    np.testing.assert_allclose(cost(example, t, x, u), expected, rtol=1e-12, atol=1e-14)
    if t >= 1.0:
        assert np.count_nonzero(expected) > 10, "the example must not be trivially zero"


@pytest.mark.parametrize("t", TIMES)
@pytest.mark.parametrize("example", ALL)
def test_first_derivatives_are_those_of_the_cost(example: Example, t: float) -> None:
    x, u = random_lanes(1)
    _, q, _, r = quadraticise(example, t, x, u)
    np.testing.assert_allclose(
        q, differences(lambda x: cost(example, t, x, u), x), rtol=1e-6, atol=1e-5
    )
    np.testing.assert_allclose(
        r, differences(lambda u: cost(example, t, x, u), u), rtol=1e-6, atol=1e-5
    )


@pytest.mark.parametrize("t", TIMES)
@pytest.mark.parametrize("example", ALL)
def test_second_derivatives_are_those_of_the_gradient(example: Example, t: float) -> None:
    x, u = random_lanes(2)
    Q, _, R, _ = quadraticise(example, t, x, u)
    np.testing.assert_array_equal(Q, Q.swapaxes(0, 1))
    np.testing.assert_array_equal(R, R.swapaxes(0, 1))
    np.testing.assert_allclose(
        Q, differences(lambda x: quadraticise(example, t, x, u)[1], x), rtol=1e-6, atol=1e-5
    )
    np.testing.assert_allclose(
        R, differences(lambda u: quadraticise(example, t, x, u)[3], u), rtol=1e-6, atol=1e-5
    )
    # The interface has no mixed derivatives, so a term may not have any.
    mixed = differences(lambda u: quadraticise(example, t, x, u)[1], u)
    np.testing.assert_allclose(mixed, 0.0, rtol=0, atol=1e-6)


@pytest.mark.parametrize("example", ALL)
def test_derivatives_are_added_to_what_is_there(example: Example) -> None:
    x, u = random_lanes(3)
    bound = example.term.bind(PLAYERS, PLAYERS.index(example.player))[0]
    kernels, given = type(bound.term), numbers(bound)
    shapes = (len(x), len(x)), (len(x),), (2, 2), (2,)
    zero, one = ([np.full((*s, x.shape[1]), value) for s in shapes] for value in (0.0, 1.0))
    kernels.quadraticise_kernel(2.0, x, u, *given, *zero)
    kernels.quadraticise_kernel(2.0, x, u, *given, *one)
    for alone, added in zip(zero, one, strict=True):
        np.testing.assert_allclose(added, alone + 1.0, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("example", ALL)
def test_lanes_do_not_influence_each_other(example: Example) -> None:
    x, u = random_lanes(4)
    whole = (cost(example, 2.0, x, u), *quadraticise(example, 2.0, x, u))
    spoilt_x, spoilt_u = x.copy(), u.copy()
    spoilt_x[:, 30], spoilt_u[:, 30] = np.nan, np.nan
    spoilt = cost(example, 2.0, spoilt_x, spoilt_u), *quadraticise(example, 2.0, spoilt_x, spoilt_u)
    others = np.arange(60) != 30
    for clean, other in zip(whole, spoilt, strict=True):
        np.testing.assert_array_equal(clean[..., others], other[..., others])
    for lanes in (1, 2, 7, 33):
        for first in range(0, 60, lanes):
            some = slice(first, min(first + lanes, 60))
            x_some, u_some = np.ascontiguousarray(x[:, some]), np.ascontiguousarray(u[:, some])
            alone = (
                cost(example, 2.0, x_some, u_some),
                *quadraticise(example, 2.0, x_some, u_some),
            )
            for of_some, of_all in zip(alone, whole, strict=True):
                np.testing.assert_array_equal(of_some, of_all[..., some])


@cache
def compiled_quadraticise(width: int) -> Array:
    @njit(error_model="numpy")
    def run(
        kernels: GameKernels, t: float, x: Array, u: Array, Q: Array, q: Array, R: Array, r: Array
    ) -> None:
        for j in range(len(kernels.quadraticise)):
            index = part(kernels.term_index, kernels.term_index_offset, j)
            params = part(kernels.term_params, kernels.term_params_offset, j)
            derivatives = block(Q, width), block(q, width), block(R, width), block(r, width)
            call(
                kernels.quadraticise[j],
                (t, block(x, width), block(u, width), index, params, *derivatives),
            )

    return run


@pytest.mark.parametrize("particles", [1, 60])
@pytest.mark.parametrize("example", ALL)
def test_compiled_lanes_do_as_numpy_does(example: Example, particles: int) -> None:
    x, u = random_lanes(5, particles)
    if particles > 1:
        x[:, 30], u[:, 30] = np.nan, np.nan
        x[:, 31] = 0.0
    x_blocks, u_blocks = in_blocks(x), in_blocks(u)
    count, nx, width = x_blocks.shape
    bound = example.term.bind(PLAYERS, PLAYERS.index(example.player))
    kernels = tabulate(0.1, PLAYERS.dynamics, [bound], width)
    out = [np.zeros((count, *shape, width)) for shape in ((nx, nx), (nx,), (2, 2), (2,))]
    for b in range(count):
        compiled_quadraticise(width)(kernels, 2.0, x_blocks[b], u_blocks[b], *(o[b] for o in out))
    for lanes, expected in zip(out, quadraticise(example, 2.0, x, u), strict=True):
        np.testing.assert_array_equal(from_blocks(lanes, particles), expected)


@pytest.mark.parametrize("distance", [0.0, 1e-300, 1e-12, NEAR * 2.0, 2.0, 2.5])
def test_proximity_is_finite_at_any_distance(distance: float) -> None:
    example = EXAMPLES["proximity"][0]
    x, u = np.zeros((PLAYERS.n_states, 1)), np.zeros((2, 1))
    x[8:10] = 50.0
    x[0] = distance
    assert cost(example, 0.0, x, u)[0] == pytest.approx(7.0 * max(0.0, 2.0 - distance) ** 2)
    derivatives = quadraticise(example, 0.0, x, u)
    assert all(np.isfinite(part).all() for part in derivatives)
    if distance >= 2.0:
        assert not any(part.any() for part in derivatives)


def test_proximity_pushes_players_apart() -> None:
    x, u = np.zeros((PLAYERS.n_states, 1)), np.zeros((2, 1))
    x[8:10], x[0] = 50.0, 1.0  # the robot is 1 m in front of ana
    _, q, _, _ = quadraticise(EXAMPLES["proximity"][0], 0.0, x, u)
    assert q[4, 0] > 0 > q[0, 0], "the cost falls as ana goes back, and as the robot goes on"


def at(term: CostTerm, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cost (L,), gradient (2, L) and Hessian (2, 2, L) of ana's term at her `positions` (2, L)."""
    example = Example(term, "ana", lambda t, x, u: np.nan)
    x, u = np.zeros((PLAYERS.n_states, positions.shape[1])), np.zeros((2, positions.shape[1]))
    x[[4, 6]] = positions
    Q, q, _, _ = quadraticise(example, 0.0, x, u)
    return cost(example, 0.0, x, u), q[[4, 6]], Q[np.ix_([4, 6], [4, 6])]


@pytest.mark.parametrize("distance", [0.0, 1e-300, 1e-12, NEAR * 2.0, 2.0, 2.5])
def test_an_obstacle_pushes_away_from_its_centre_at_any_distance(distance: float) -> None:
    term = Obstacle(center=(3.0, 0.0), radius=2.0, weight=7.0)
    value, gradient, hessian = at(term, np.array([[3.0], [distance]]))
    assert value[0] == pytest.approx(7.0 * max(0.0, 2.0 - distance) ** 2)
    assert np.isfinite(hessian).all()
    if distance >= 2.0:
        assert not gradient.any() and not hessian.any()
    else:
        faded = min(1.0, distance / (NEAR * 2.0))
        size = 14.0 * (2.0 - max(distance, NEAR * 2.0)) * faded
        np.testing.assert_allclose(gradient[:, 0], [0.0, -size], rtol=1e-12)


def test_a_lane_measures_the_distance_to_the_nearest_point_of_its_polyline() -> None:
    share = np.linspace(0.0, 1.0, 5001)[:, None]
    sampled = np.concatenate([(1 - share) * a + share * b for a, b in pairwise(np.array(ZIGZAG))])
    positions = np.random.default_rng(6).uniform(-3.0, 3.0, (2, 300))
    distance = np.linalg.norm(sampled[:, :, None] - positions, axis=1).min(axis=0)
    for half_width in (0.0, 0.4):
        term = Lane(points=ZIGZAG, half_width=half_width, weight=1.0)
        value, gradient, hessian = at(term, positions)
        np.testing.assert_allclose(
            np.sqrt(value), np.maximum(distance - half_width, 0.0), rtol=0, atol=2e-4
        )
        inside = distance < half_width - 2e-4
        assert inside.any() == (half_width > 0)
        assert not value[inside].any()
        assert not gradient[..., inside].any() and not hessian[..., inside].any()


def test_a_lane_pulls_straight_towards_a_segment_and_round_a_vertex() -> None:
    term = Lane(points=((0.0, 0.0), (2.0, 0.0)), half_width=0.5, weight=3.0)
    value, gradient, hessian = at(term, np.array([[1.0, 2.0 + 1.5], [-1.5, 2.0]]))
    np.testing.assert_allclose(value, [3.0, 3.0 * 2.0**2])
    np.testing.assert_allclose(gradient.T, [[0.0, -6.0], [12.0 * 0.6, 12.0 * 0.8]])
    np.testing.assert_array_equal(hessian[..., 0], [[0.0, 0.0], [0.0, 6.0]])
    # Around a circle of radius 1/2 at distance 5/2: 1 outwards and 2 / (5/2) along it.
    n, along = np.array([0.6, 0.8]), np.array([-0.8, 0.6])
    np.testing.assert_allclose(
        hessian[..., 1], 6.0 * (np.outer(n, n) + 0.8 * np.outer(along, along))
    )


def test_a_lane_is_smooth_around_the_outside_of_its_corners() -> None:
    term = Lane(points=((-2.0, 0.0), (0.0, 0.0), (0.0, 2.0)), half_width=0.5, weight=1.0)
    angle = np.linspace(np.pi, 2.5 * np.pi, 3001)
    # Below the first segment, around the corner, and up on the right of the second.
    path = 1.5 * np.stack([np.cos(angle), np.sin(angle)])
    value, gradient, _ = at(term, path)
    step = 1.5 * (angle[1] - angle[0])
    assert np.abs(np.diff(value)).max() <= 2.0 * 1.0 * step * (1 + 1e-9)
    assert np.linalg.norm(np.diff(gradient), axis=0).max() <= 2.0 * step * (1 + 1e-9)
    # Inside the corner the cost is continuous too, though its gradient is not.
    across = np.array([[-1.5], [1.5]]) + np.linspace(-0.5, 0.5, 1001)
    value, gradient, _ = at(term, across)
    assert np.abs(np.diff(value)).max() <= 2.0 * 1.5 * 1e-3 * np.sqrt(2.0)


SMALL = (0.0, 1e-300, 1e-170, 1e-155, 1e-30, 1e-12, 0.25, 1e8, 1e170)


@pytest.mark.parametrize("half_width", [0.0, 1e-300, 0.25, 1e8])
def test_a_lane_has_finite_derivatives_everywhere(half_width: float) -> None:
    points = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0))
    term = Lane(points=points, half_width=half_width, weight=7.0)
    offsets = np.array([(sx * a, sy * b) for a in SMALL for b in SMALL
                        for sx in (-1, 1) for sy in (-1, 1)])  # fmt: skip
    for base in (*points, (0.5, 0.0)):
        _, gradient, hessian = at(term, (base + offsets).T)
        assert np.isfinite(gradient).all() and np.isfinite(hessian).all()
        # The cost bends upwards but inside corners, at most as much as a parabola.
        bend = np.linalg.eigvalsh(np.moveaxis(hessian, 2, 0))
        assert bend.min() >= -1e-12 and bend.max() <= 14.0 * (1 + 1e-12)


def test_a_lane_without_a_width_bends_on_its_polyline_too() -> None:
    term = Lane(points=((0.0, 0.0), (3.0, 4.0)), half_width=0.0, weight=2.0)
    value, gradient, hessian = at(term, np.array([[0.0, 0.75], [0.0, 1.0]]))
    np.testing.assert_allclose(value, 0.0, atol=1e-30)
    np.testing.assert_allclose(gradient, 0.0, atol=1e-14)
    n = np.array([-0.8, 0.6])
    for k in range(2):
        np.testing.assert_allclose(hessian[..., k], 4.0 * np.outer(n, n), atol=1e-15)


def test_a_lane_costs_more_the_farther_away_up_to_infinity() -> None:
    term = Lane(points=ZIGZAG, half_width=0.1, weight=1.0)
    value, _, _ = at(
        term, np.array([[1e3, 1e100, 1e170, np.nan, 0.0], [0.0, 0.0, 0.0, 0.0, np.nan]])
    )
    np.testing.assert_array_equal(np.isnan(value), [False, False, False, True, True])
    assert 0 < value[0] < value[1] < value[2] == np.inf


def test_a_term_belongs_to_the_players_it_names() -> None:
    everybody = QuadraticInput(weights=(1.0, 1.0))
    assert everybody.players_in(PLAYERS) == [0, 1, 2]
    some = QuadraticInput(weights=(1.0, 1.0), players=("ben", "robot"))
    assert sorted(some.players_in(PLAYERS)) == [0, 2]


@pytest.mark.parametrize(
    ("term", "player", "words"),
    [
        (QuadraticInput(weights=(1.0,)), "robot", ("weights", "1 number", "omega, a")),
        (QuadraticState(weights=(1.0,) * 3), "ana", ("weights", "3 number", "px, vx, py, vy")),
        (SoftBound(of="v", low=0, high=1, weight=1), "ana", ("of", "'v'", "ana", "px, vx")),
        (
            Goal(weights=(1.0,) * 4, goals=GOALS | {"ana": (1.0,)}, active_from=0),
            "ana",
            ("goals.ana", "1 number", "px, vx, py, vy"),
        ),
        (Goal(weights=(1.0,), goals=GOALS, active_from=0), "ana", ("weights", "px, vx, py, vy")),
    ],
)
def test_a_term_that_does_not_fit_says_why(
    term: CostTerm, player: str, words: tuple[str, ...]
) -> None:
    with pytest.raises(ValueError) as caught:
        term.bind(PLAYERS, PLAYERS.index(player))
    message = str(caught.value)
    assert message.startswith(words[0] + ":")
    assert all(word in message for word in words), message


@pytest.mark.parametrize(
    ("term", "words"),
    [
        (QuadraticInput(weights=(1, 1), players=("eve",)), ("players", "eve", "robot, ana, ben")),
        (
            Goal(weights=(1,) * 4, goals=GOALS | {"eve": (0.0,) * 4}, active_from=0),
            ("goals.eve", "robot, ana, ben"),
        ),
        (
            Goal(weights=(1,) * 4, goals={"ana": (0.0,) * 4}, active_from=0),
            ("goals", "robot"),
        ),
    ],
)
def test_a_term_for_players_that_are_not_there_says_so(
    term: CostTerm, words: tuple[str, ...]
) -> None:
    with pytest.raises(ValueError) as caught:
        term.players_in(PLAYERS)
    assert all(word in str(caught.value) for word in words), caught.value


@pytest.mark.parametrize(
    ("kind", "fields"),
    [
        (QuadraticInput, {"weights": (-1.0, 1.0)}),
        (QuadraticState, {"weights": (np.nan, 0.0, 0.0, 0.0)}),
        (SoftBound, {"of": "v", "low": 1.0, "high": 0.0, "weight": 1.0}),
        (SoftBound, {"of": "v", "low": 0.0, "high": np.inf, "weight": 1.0}),
        (SoftBound, {"of": "v", "low": 0.0, "high": 1.0, "weight": -1.0}),
        (Proximity, {"radius": 0.0, "weight": 1.0}),
        (Proximity, {"radius": 1.0, "weight": -1.0}),
        (Obstacle, {"center": (0.0, 0.0), "radius": 0.0, "weight": 1.0}),
        (Obstacle, {"center": (0.0, np.nan), "radius": 1.0, "weight": 1.0}),
        (Obstacle, {"center": (0.0, 0.0, 0.0), "radius": 1.0, "weight": 1.0}),
        (Obstacle, {"center": (0.0, 0.0), "radius": 1.0, "weight": -1.0}),
        (Lane, {"points": ((0.0, 0.0),), "half_width": 1.0, "weight": 1.0}),
        (Lane, {"points": ((0.0, 0.0), (0.0, -0.0)), "half_width": 1.0, "weight": 1.0}),
        (Lane, {"points": ((0.0, 0.0), (np.inf, 0.0)), "half_width": 1.0, "weight": 1.0}),
        (Lane, {"points": ((0.0, 0.0), (1.0, 0.0)), "half_width": -0.1, "weight": 1.0}),
        (Lane, {"points": ((0.0, 0.0), (1.0, 0.0)), "half_width": 1.0, "weight": -1.0}),
        (Goal, {"weights": (1.0,), "goals": {"robot": (np.inf,)}, "active_from": 0.0}),
        (Goal, {"weights": (1.0,), "goals": {}, "active_from": 0.0, "colour": "red"}),
    ],
)
def test_numbers_that_make_no_cost_are_refused(
    kind: type[CostTerm], fields: dict[str, object]
) -> None:
    with pytest.raises(ValidationError):
        kind(**fields)
