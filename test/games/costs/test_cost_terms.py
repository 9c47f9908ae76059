"""Every kind of cost term is held against its formula and against finite differences."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from cost_term_examples import EXAMPLES, GOALS, PLAYERS, Example, cost, numbers, quadraticise
from numba import njit
from pydantic import ValidationError

from gameinfer_ros.games import (
    CostTerm,
    Goal,
    Obstacle,
    Proximity,
    QuadraticInput,
    QuadraticState,
    RoadLane,
    SoftBound,
)
from gameinfer_ros.games.kernels import GameKernels
from gameinfer_ros.games.tables import tabulate
from gameinfer_ros.lanes.addresses import call
from gameinfer_ros.lanes.blocks import block, from_blocks, in_blocks
from gameinfer_ros.lanes.lanes import Array
from gameinfer_ros.lanes.numbers import part

ALL = [
    pytest.param(example, id=f"{kind}-{j}")
    for kind in sorted(CostTerm.family)
    for j, example in enumerate(EXAMPLES.get(kind, []))
]
TIMES = (0.0, 0.999, 1.0, 5.0)


def test_every_kind_has_an_example() -> None:
    missing = set(CostTerm.family) - set(EXAMPLES)
    assert not missing, f"give examples of {missing} in EXAMPLES"


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
def test_derivatives_are_those_of_the_cost_and_of_the_gradient(example: Example, t: float) -> None:
    x, u = random_lanes(1)
    Q, q, R, r = quadraticise(example, t, x, u)
    for found, expected in (
        (q, differences(lambda x: cost(example, t, x, u), x)),
        (r, differences(lambda u: cost(example, t, x, u), u)),
        (Q, differences(lambda x: quadraticise(example, t, x, u)[1], x)),
        (R, differences(lambda u: quadraticise(example, t, x, u)[3], u)),
    ):
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-5)
    np.testing.assert_array_equal(Q, Q.swapaxes(0, 1))
    np.testing.assert_array_equal(R, R.swapaxes(0, 1))
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


def test_a_term_belongs_to_the_players_it_names() -> None:
    everyone = QuadraticInput(weights=(1.0, 1.0))
    assert everyone.players_in(PLAYERS) == [0, 1, 2]
    some = QuadraticInput(weights=(1.0, 1.0), players=("ben", "robot"))
    assert sorted(some.players_in(PLAYERS)) == [0, 2]


@pytest.mark.parametrize(
    ("term", "player", "words"),
    [
        (
            QuadraticState(weights=(1.0,) * 3),
            "ana",
            ("weights", "[1.0, 1.0, 1.0]", "4 numbers", "px, vx, py, vy"),
        ),
        (SoftBound(of="v", low=0, high=1, weight=1), "ana", ("of", "'v'", "ana", "px, vx")),
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
    ("kind", "fields"),
    [
        (QuadraticState, {"weights": (np.nan, 0.0, 0.0, 0.0)}),
        (SoftBound, {"of": "v", "low": 0.0, "high": np.inf, "weight": 1.0}),
        (SoftBound, {"of": "v", "low": 0.0, "high": 1.0, "weight": -1.0}),
        (Proximity, {"radius": 1.0, "weight": -1.0}),
        (Obstacle, {"center": (0.0, 0.0), "radius": 1.0, "weight": -1.0}),
        (RoadLane, {"points": ((0.0, 0.0), (0.0, -0.0)), "half_width": 1.0, "weight": 1.0}),
        (RoadLane, {"points": ((0.0, 0.0), (np.inf, 0.0)), "half_width": 1.0, "weight": 1.0}),
        (RoadLane, {"points": ((0.0, 0.0), (1.0, 0.0)), "half_width": 1.0, "weight": -1.0}),
        (Goal, {"weights": (1.0,), "goals": {"robot": (np.inf,)}, "active_from": 0.0}),
    ],
)
def test_numbers_that_make_no_cost_are_refused(
    kind: type[CostTerm], fields: dict[str, object]
) -> None:
    with pytest.raises(ValidationError):
        kind(**fields)
