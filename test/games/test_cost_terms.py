"""Every kind of cost term is held against its formula and against finite differences.

A new kind joins the tests by an entry in EXAMPLES.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from pydantic import ValidationError

from gameinfer_ros.games import (
    BoundTerm,
    CostTerm,
    DoubleIntegrator,
    Goal,
    Players,
    Proximity,
    QuadraticInput,
    QuadraticState,
    SoftBound,
    Unicycle,
)
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
            block = slice(first, min(first + lanes, 60))
            x_block, u_block = np.ascontiguousarray(x[:, block]), np.ascontiguousarray(u[:, block])
            parts = (
                cost(example, 2.0, x_block, u_block),
                *quadraticise(example, 2.0, x_block, u_block),
            )
            for part, all_lanes in zip(parts, whole, strict=True):
                np.testing.assert_array_equal(part, all_lanes[..., block])


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
        (Goal, {"weights": (1.0,), "goals": {"robot": (np.inf,)}, "active_from": 0.0}),
        (Goal, {"weights": (1.0,), "goals": {}, "active_from": 0.0, "colour": "red"}),
    ],
)
def test_numbers_that_make_no_cost_are_refused(
    kind: type[CostTerm], fields: dict[str, object]
) -> None:
    with pytest.raises(ValidationError):
        kind(**fields)
