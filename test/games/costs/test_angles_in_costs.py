"""Cost terms see angles modulo a turn, as the dynamics declare."""

from __future__ import annotations

import numpy as np
import pytest
from cost_term_examples import EXAMPLES, PLAYERS, Example, cost, quadraticise

from gameinfer_ros.games import (
    Car,
    CostTerm,
    Game,
    Goal,
    Players,
    QuadraticInput,
    QuadraticState,
    SoftBound,
    Unicycle,
)

ALL = [
    pytest.param(example, id=f"{kind}-{j}")
    for kind in sorted(CostTerm.family)
    for j, example in enumerate(EXAMPLES.get(kind, []))
]
TURN = 2 * np.pi


def cost_at(theta: float, *costs: CostTerm) -> float:
    game = Game({"robot": Unicycle()}, costs, 0.1, 1)
    return float(game.costs(np.array([[0.0, 0.0, theta, 0.0]]), np.zeros((1, 2)))[0, 0])


def goal(theta: float) -> Goal:
    return Goal(
        weights=(0, 0, 2.0, 0), goals={"robot": (0, 0, theta, 0)}, active_from=0.0
    )  # fmt: skip


@pytest.mark.parametrize("turns", [-3, -1, 1, 7])
@pytest.mark.parametrize("example", ALL)
def test_whole_turns_of_headings_change_neither_cost_nor_derivatives(
    example: Example, turns: int
) -> None:
    rng = np.random.default_rng(0)
    x, u = rng.normal(0.0, 1.5, (PLAYERS.n_states, 40)), rng.normal(0.0, 1.0, (2, 40))
    turned = x.copy()
    turned[PLAYERS.is_angle] += turns * TURN
    plain = (cost(example, 5.0, x, u), *quadraticise(example, 5.0, x, u))
    other = (cost(example, 5.0, turned, u), *quadraticise(example, 5.0, turned, u))
    for a, b in zip(plain, other, strict=True):
        np.testing.assert_allclose(b, a, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("theta", "wanted", "away"),
    [
        (3.1, -3.1, TURN - 6.2),
        (-3.1, 3.1, TURN - 6.2),
        (6.2832, 0.0, 6.2832 - TURN),
        (180.0, 0.0, 180.0 - 29 * TURN),
        (0.1, 4 * np.pi, 0.1),
        (np.pi, 0.0, np.pi),
        (-np.pi, 0.0, np.pi),
        (0.0, np.pi, np.pi),
        (4.0, 0.0, TURN - 4.0),
    ],
)
def test_the_goal_is_reached_by_the_short_way(theta: float, wanted: float, away: float) -> None:
    assert cost_at(theta, goal(wanted)) == pytest.approx(away**2, rel=1e-9)
    if wanted == 0.0:
        quadratic = QuadraticState(weights=(0, 0, 2.0, 0))
        assert cost_at(theta, quadratic) == cost_at(theta, goal(0.0))


def test_up_to_half_a_turn_costs_are_the_plain_ones_to_the_bit() -> None:
    for theta, wanted in np.random.default_rng(0).uniform(-1.57, 1.57, (200, 2)).tolist():
        difference = theta - wanted
        assert cost_at(theta, goal(wanted)) == 0.5 * 2.0 * difference * difference


@pytest.mark.parametrize(
    ("low", "high", "theta", "excess"),
    [
        (-0.5, 0.5, 0.3, 0.0),
        (-0.5, 0.5, 0.3 + TURN, 0.0),
        (-0.5, 0.5, 0.7 - 2 * TURN, 0.2),
        (-0.5, 0.5, -0.7 + TURN, 0.2),
        (3.0, 3.4, -3.0, 0.0),  # across the half turn
        (3.0, 3.4, -2.8, TURN - 2.8 - 3.4),
        (3.0, 3.4, 2.9, 0.1),
        (-0.5, 2.5, 1.0 + np.pi - 0.01, np.pi - 0.01 - 1.5),  # the farther from both, the nearer
        (-0.5, 2.5, 1.0 + np.pi + 0.01, np.pi - 0.01 - 1.5),
        (-4.0, 4.0, 3.9, 0.0),  # every heading is within a turn
        (-4.0, 4.0, 40.0, 0.0),
    ],
)
def test_a_bound_on_a_heading_is_an_arc(
    low: float, high: float, theta: float, excess: float
) -> None:
    bound = SoftBound(of="theta", low=low, high=high, weight=3.0)
    assert cost_at(theta, bound) == pytest.approx(3.0 * excess**2, abs=1e-12)


def test_a_steering_angle_is_not_modulo_a_turn() -> None:
    car = Car(wheelbase=1.0)
    assert Players({"car": car}).is_angle.tolist() == [False, False, True, False, False]
    terms = [
        QuadraticState(weights=(0, 0, 0, 0, 2.0)),
        SoftBound(of="steering", low=-0.5, high=0.5, weight=1.0),
        Goal(weights=(0, 0, 0, 0, 2.0), goals={"car": (0,) * 5}, active_from=0.0),
    ]
    for term, expected in zip(terms, (6.2**2, 5.7**2, 6.2**2), strict=True):
        game = Game({"car": car}, [QuadraticInput(weights=(1, 1)), term], 0.1, 1)
        costs = game.costs(np.array([[0.0, 0.0, 0.0, 0.0, 6.2]]), np.zeros((1, 2)))
        assert costs[0, 0] == pytest.approx(expected)
