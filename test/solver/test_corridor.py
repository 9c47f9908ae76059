"""In a corridor with a corner and something in the way."""

from __future__ import annotations

import numpy as np
from solving import check_against_reference, random_inputs, solve

from gameinfer_ros.games import (
    CostTerm,
    DoubleIntegrator,
    Game,
    Goal,
    Obstacle,
    Proximity,
    QuadraticInput,
    RoadLane,
    Unicycle,
)

LANE = RoadLane(
    points=((-2.0, 0.0), (1.5, 0.0), (1.5, 3.0)), half_width=0.5, weight=1000.0, players=("robot",)
)
OBSTACLE = Obstacle(center=(-0.2, 0.1), radius=0.4, weight=1000.0, players=("robot",))


def corridor(*terms: CostTerm) -> tuple[Game, np.ndarray]:
    """A game in which the robot goes from (-2, 0) to (1.5, 2), past a walker, and its start."""
    goals = {"robot": (1.5, 2.0, 0.0, 0.0), "walker": (-1.0, 0.0, -1.5, 0.0)}
    game = Game(
        {"robot": Unicycle(), "walker": DoubleIntegrator()},
        [
            QuadraticInput(weights=(1.0, 1.0)),
            Proximity(radius=0.8, weight=50.0),
            *(
                Goal(weights=weights, goals={name: goals[name]}, active_from=4.85, players=(name,))
                for name, weights in (
                    ("robot", (300.0, 300.0, 0.0, 0.0)),
                    ("walker", (300.0, 0.0, 300.0, 0.0)),
                )
            ),
            *terms,
        ],
        dt=0.1,
        horizon=50,
    )
    return game, np.array([-2.0, 0.0, 0.0, 0.0, 2.0, 0.0, -1.5, 0.0])


def farthest_off_lane_and_nearest_to_obstacle(*terms: CostTerm) -> tuple[np.ndarray, np.ndarray]:
    """Distances (K,) of the robot from the polyline and from the obstacle's centre."""
    game, x0 = corridor(*terms)
    solution = solve(game, x0, random_inputs(game, 9))
    assert solution.converged.all()
    px, py = solution.strategy.x_ref[:, 0], solution.strategy.x_ref[:, 1]
    np.testing.assert_allclose([px[-1], py[-1]], [[1.5] * 9, [2.0] * 9], atol=0.2)
    along_x = np.hypot(px - np.clip(px, -2.0, 1.5), py)
    along_y = np.hypot(px - 1.5, py - np.clip(py, 0.0, 3.0))
    off_lane = np.minimum(along_x, along_y).max(axis=0)
    return off_lane, np.hypot(px - OBSTACLE.center[0], py - OBSTACLE.center[1]).min(axis=0)


def test_a_robot_keeps_to_its_lane_and_out_of_an_obstacle() -> None:
    off_lane, to_obstacle = farthest_off_lane_and_nearest_to_obstacle(LANE, OBSTACLE)
    assert (off_lane <= 0.5 + 0.2).all() and (to_obstacle >= 0.4 - 0.1).all()
    # It would do neither of its own accord.
    off_lane, _ = farthest_off_lane_and_nearest_to_obstacle(OBSTACLE)
    assert (off_lane >= 1.0).all()
    _, to_obstacle = farthest_off_lane_and_nearest_to_obstacle(LANE)
    assert (to_obstacle <= 0.25).all()


def test_lanes_and_obstacles_agree_with_the_reference() -> None:
    game, x0 = corridor(LANE, OBSTACLE)
    assert check_against_reference(game, x0, random_inputs(game, 2), max_iterations=4) == 2
