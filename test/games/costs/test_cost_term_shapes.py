"""Where proximity, obstacles and lanes push and pull."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from cost_term_examples import EXAMPLES, PLAYERS, ZIGZAG, Example, cost, quadraticise

from gameinfer_ros.games import CostTerm, Obstacle, RoadLane
from gameinfer_ros.games.costs.proximity import NEAR


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
        term = RoadLane(points=ZIGZAG, half_width=half_width, weight=1.0)
        value, gradient, hessian = at(term, positions)
        np.testing.assert_allclose(
            np.sqrt(value), np.maximum(distance - half_width, 0.0), rtol=0, atol=2e-4
        )
        inside = distance < half_width - 2e-4
        assert inside.any() == (half_width > 0)
        assert not value[inside].any()
        assert not gradient[..., inside].any() and not hessian[..., inside].any()


def test_a_lane_pulls_straight_towards_a_segment_and_round_a_vertex() -> None:
    term = RoadLane(points=((0.0, 0.0), (2.0, 0.0)), half_width=0.5, weight=3.0)
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
    term = RoadLane(points=((-2.0, 0.0), (0.0, 0.0), (0.0, 2.0)), half_width=0.5, weight=1.0)
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
    term = RoadLane(points=points, half_width=half_width, weight=7.0)
    offsets = np.array([(sx * a, sy * b) for a in SMALL for b in SMALL
                        for sx in (-1, 1) for sy in (-1, 1)])  # fmt: skip
    for base in (*points, (0.5, 0.0)):
        _, gradient, hessian = at(term, (base + offsets).T)
        assert np.isfinite(gradient).all() and np.isfinite(hessian).all()
        # The cost bends upwards but inside corners, at most as much as a parabola.
        bend = np.linalg.eigvalsh(np.moveaxis(hessian, 2, 0))
        assert bend.min() >= -1e-12 and bend.max() <= 14.0 * (1 + 1e-12)


def test_a_lane_without_a_width_bends_on_its_polyline_too() -> None:
    term = RoadLane(points=((0.0, 0.0), (3.0, 4.0)), half_width=0.0, weight=2.0)
    value, gradient, hessian = at(term, np.array([[0.0, 0.75], [0.0, 1.0]]))
    np.testing.assert_allclose(value, 0.0, atol=1e-30)
    np.testing.assert_allclose(gradient, 0.0, atol=1e-14)
    n = np.array([-0.8, 0.6])
    for k in range(2):
        np.testing.assert_allclose(hessian[..., k], 4.0 * np.outer(n, n), atol=1e-15)


def test_a_lane_costs_more_the_farther_away_up_to_infinity() -> None:
    term = RoadLane(points=ZIGZAG, half_width=0.1, weight=1.0)
    value, _, _ = at(
        term, np.array([[1e3, 1e100, 1e170, np.nan, 0.0], [0.0, 0.0, 0.0, 0.0, np.nan]])
    )
    np.testing.assert_array_equal(np.isnan(value), [False, False, False, True, True])
    assert 0 < value[0] < value[1] < value[2] == np.inf
