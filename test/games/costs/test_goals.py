"""Where players want to be, in the map."""

from __future__ import annotations

import numpy as np

from gameinfer_ros.games import (
    CostTerm,
    DoubleIntegrator,
    FlatUnicycle,
    Game,
    Goal,
    QuadraticInput,
    Unicycle,
    goal_positions,
)

ALL = (1.0, 1.0, 1.0, 1.0)


def goal(weights: tuple[float, ...], **goals: tuple[float, ...]) -> Goal:
    return Goal(weights=weights, goals=goals, active_from=1.0, players=tuple(goals))


def positions(*costs: CostTerm) -> list[list[list[float]]]:
    dynamics = {"robot": Unicycle(), "ana": DoubleIntegrator(), "ben": FlatUnicycle()}
    found = goal_positions(Game(dynamics, [QuadraticInput(weights=(1, 1)), *costs], 0.1, 5))
    assert all(goals.shape == (len(goals), 2) for goals in found)
    return [goals.tolist() for goals in found]


def test_goals_are_found_for_any_dynamics_and_players_may_have_none() -> None:
    state = (1.0, 2.0, 3.0, 4.0)
    assert positions(goal(ALL, robot=state)) == [[[1, 2]], [], []]
    assert positions(goal(ALL, ana=state, ben=state)) == [[], [[1, 3]], [[1, 3]]]
    assert positions() == [[], [], []]


def test_a_player_may_have_several_goals_and_one_that_is_no_position() -> None:
    first, second, heading = (1.0, 2.0, 0.0, 0.0), (5.0, 6.0, 0.0, 0.0), (7.0, 8.0, 0.5, 0.0)
    terms = [goal(ALL, robot=first), goal(ALL, robot=second), goal(ALL, robot=first)]
    found, *_ = positions(*terms, goal((0.0, 0.0, 1.0, 0.0), robot=heading))
    assert found == [[1, 2], [5, 6]]
    np.testing.assert_array_equal(positions(goal((1.0, 0.0, 0.0, 0.0), robot=first))[0], [])
