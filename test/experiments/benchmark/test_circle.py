"""Games of any number of players on a circle."""

from __future__ import annotations

import numpy as np
import pytest

from gameinfer_ros.experiments.benchmark.circle import circle
from gameinfer_ros.experiments.benchmark.warm_start import seeds_of
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import GameSolver


@pytest.mark.parametrize("name", ["two_player", "three_player", "five_player"])
def test_scenarios_of_the_package_are_circles(name: str) -> None:
    scenario = Scenario.load(name)
    made = circle(scenario, len(scenario.players))
    assert list(made.players) == list(scenario.players)
    np.testing.assert_allclose(
        made.initial_vehicle_state, scenario.initial_vehicle_state, atol=1e-9
    )
    rng = np.random.default_rng(0)
    x = rng.normal(size=(made.horizon + 1, made.game.players.n_states))
    u = rng.normal(size=(made.horizon, made.game.players.n_inputs))
    np.testing.assert_allclose(made.game.costs(x, u), scenario.game.costs(x, u), rtol=1e-6)


def test_unicycles_have_the_goals_of_five(five_player: Scenario) -> None:
    five = Scenario.load("five_player_unicycle")
    made = circle(Scenario.load("three_player"), 5)
    np.testing.assert_allclose(made.initial_state, five.initial_state, atol=1e-9)
    for name, goal in goals(five).items():
        np.testing.assert_allclose(goals(made)[name], goal, atol=1e-9)


@pytest.mark.parametrize("base", ["three_player", "five_player"])
@pytest.mark.parametrize("players", range(2, 9))
def test_any_number_of_players(base: str, players: int) -> None:
    scenario = circle(Scenario.load(base), players)
    assert len(scenario.players) == len(scenario.game.players) == players
    positions = scenario.vehicles.positions(scenario.initial_vehicle_state)
    np.testing.assert_allclose(np.hypot(*positions.T), 3.0)
    i, j = np.triu_indices(players, 1)
    assert np.linalg.norm(positions[i] - positions[j], axis=1).min() > 1.9
    assert np.linalg.norm(positions[i] + positions[j], axis=1).min() > 0.5  # none is opposite

    solver = GameSolver(scenario.game, scenario.solver)
    solution = solver.solve(scenario.initial_state, seeds_of(scenario, 2), None, 3)
    assert (solution.iterations == 3).all()
    for array in solution.strategy.arrays:
        assert np.isfinite(array).all()


def test_goals_count_from_as_late_on_in_any_horizon(three_player: Scenario) -> None:
    longer = circle(three_player, 3, 150)
    assert longer.game.horizon == 150
    ends = [scenario.horizon * scenario.dt for scenario in (three_player, longer)]
    starts = [goal_term(scenario).active_from for scenario in (three_player, longer)]
    assert ends[0] - starts[0] == pytest.approx(ends[1] - starts[1])


def goal_term(scenario: Scenario):
    return next(cost for cost in scenario.costs if cost.kind == "goal")


def goals(scenario: Scenario) -> dict[str, tuple[float, ...]]:
    return goal_term(scenario).goals
