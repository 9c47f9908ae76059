"""The robot's step: observe, choose, act, update, and in this order."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gameinfer_ros.games import ROBOT
from gameinfer_ros.inference import Belief
from gameinfer_ros.planning import OFF, Deliberation, Execution, SafetyFilter, make_planner, plan
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import GameSolver, Strategy


class Log:
    """A belief that writes down what it is asked for."""

    def __init__(self, belief: Belief) -> None:
        self._belief, self.calls = belief, list[tuple[Any, ...]]()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._belief, name)

    def __len__(self) -> int:
        return len(self._belief)

    def weigh(self, step: int, x: np.ndarray, x_next: np.ndarray, u: np.ndarray) -> None:
        self.calls.append(("weigh", step, x.tolist(), x_next.tolist(), u.tolist()))
        self._belief.weigh(step, x, x_next, u)

    def combine_duplicates(self) -> None:
        self.calls.append(("combine",))
        self._belief.combine_duplicates()

    def solve(self, step: int, x: np.ndarray, deadline: float = np.inf) -> None:
        self.calls.append(("solve", step))
        self.solved_from = x
        self._belief.solve(step, x, deadline)


def log_of(scenario: Scenario) -> Log:
    solver = GameSolver(scenario.game, scenario.solver)
    settings = scenario.inference.model_copy(update={"particles": 3})
    return Log(Belief(solver, scenario.seeds, settings, np.random.default_rng(0)))


def mind_of(scenario: Scenario, log: Log) -> Deliberation:
    solver = GameSolver(scenario.game, scenario.solver)
    planner = make_planner("map", solver, scenario.seeds, np.random.default_rng(1))
    return Deliberation(scenario.vehicles, log, planner)  # type: ignore[arg-type]


@pytest.fixture
def log(two_player: Scenario) -> Log:
    return log_of(two_player)


@pytest.fixture
def mind(two_player: Scenario, log: Log) -> Deliberation:
    return mind_of(two_player, log)


@pytest.fixture
def s(two_player: Scenario) -> np.ndarray:
    return two_player.initial_vehicle_state


@pytest.fixture
def w(two_player: Scenario) -> np.ndarray:
    """Inputs of vehicles that do nothing."""
    return np.zeros(two_player.vehicles.n_inputs)


def test_the_first_state_is_solved_at_once_and_later_ones_after_the_choice(
    s: np.ndarray, w: np.ndarray, mind: Deliberation, log: Log
) -> None:
    mind.observe(0, s, w)
    assert log.calls == [("solve", 0)]
    first = mind.choose()
    assert mind.update() == 3
    assert log.calls == [("solve", 0)], "the game has been solved from this state"
    log.calls.clear()
    mind.observe(1, s, w)
    second = mind.choose()
    assert [call[:2] for call in log.calls] == [("weigh", 0), ("combine",)]
    assert (first.first_step, second.first_step) == (0, 0), "what is known is chosen from"
    assert mind.update() == len(log)
    assert log.calls[-1] == ("solve", 1)


@pytest.mark.parametrize("name", ["two_player", "flat_three_player"])
def test_what_the_game_sees_of_the_vehicles_is_weighed_and_solved(
    name: str, request: pytest.FixtureRequest
) -> None:
    scenario: Scenario = request.getfixturevalue(name)
    log, vehicles = log_of(scenario), scenario.vehicles
    mind, s = mind_of(scenario, log), scenario.initial_vehicle_state
    w = np.linspace(-0.5, 0.5, vehicles.n_inputs)
    s_next = vehicles.step(s, w)
    mind.observe(0, s, w)
    np.testing.assert_array_equal(log.solved_from, vehicles.game_state(s))
    log.calls.clear()
    mind.observe(1, s_next, w)
    u = vehicles.game_input(s, w)[scenario.game.players.inputs(ROBOT)]
    x, x_next = vehicles.game_state(s), vehicles.game_state(s_next)
    assert log.calls == [("weigh", 0, x.tolist(), x_next.tolist(), u.tolist()), ("combine",)]
    mind.update()
    np.testing.assert_array_equal(log.solved_from, x_next)


def test_the_strategy_is_the_robots_own_part(
    two_player: Scenario, s: np.ndarray, w: np.ndarray, mind: Deliberation
) -> None:
    mind.observe(0, s, w)
    chosen = mind.choose()
    whole = mind.belief.equilibrium.strategy
    own = two_player.game.players.inputs(ROBOT)
    np.testing.assert_array_equal(chosen.u_ref, whole.u_ref[:, own])


def test_missing_states_are_counted_and_not_weighed(
    s: np.ndarray, w: np.ndarray, mind: Deliberation, log: Log
) -> None:
    mind.observe(0, s, w)
    assert mind.missing == 0
    log.calls.clear()
    mind.observe(4, s, w)
    assert mind.missing == 3 and log.calls == []
    mind.update()
    mind.observe(5, s, w)
    assert mind.missing == 0
    assert [call[0] for call in log.calls] == ["solve", "weigh", "combine"]


def test_a_step_past_the_horizon_is_solved_before_the_choice(
    two_player: Scenario, s: np.ndarray, w: np.ndarray, mind: Deliberation, log: Log
) -> None:
    mind.observe(0, s, w)
    log.calls.clear()
    last = two_player.horizon - 1
    mind.observe(last, s, w)
    assert log.calls == [], "the horizon contains the step"
    mind.observe(two_player.horizon + 5, s, w)
    assert log.calls == [("solve", two_player.horizon + 5)]
    assert mind.choose().first_step == two_player.horizon + 5


def test_no_solve_begins_after_the_deadline(
    s: np.ndarray, w: np.ndarray, mind: Deliberation, log: Log
) -> None:
    mind.observe(0, s, w)
    mind.observe(1, s, w)
    log.calls.clear()
    assert mind.update(deadline=0.0) == 0
    assert log.calls == []


def test_without_a_state_or_a_planner_there_is_no_strategy(
    two_player: Scenario, s: np.ndarray, w: np.ndarray, mind: Deliberation, log: Log
) -> None:
    with pytest.raises(RuntimeError, match="an observed state and a planner"):
        mind.choose()
    assert mind.update() == 0
    watching = Deliberation(two_player.vehicles, log, None)  # type: ignore[arg-type]
    watching.observe(0, s, w)
    with pytest.raises(RuntimeError, match="an observed state and a planner"):
        watching.choose()


@pytest.mark.parametrize("safe", [False, True])
@pytest.mark.parametrize("name", ["two_player", "flat_three_player"])
def test_an_act_is_the_plan_of_the_strategy_as_the_safety_layer_lets_it_pass(
    name: str, safe: bool, request: pytest.FixtureRequest
) -> None:
    scenario: Scenario = request.getfixturevalue(name)
    vehicles, s = scenario.vehicles, scenario.initial_vehicle_state
    rng, T, nx = np.random.default_rng(0), 5, scenario.game.players.n_states
    strategy = Strategy(
        3,
        rng.normal(size=(T + 1, nx, 1)),
        rng.uniform(-0.1, 0.1, (T, 2, 1)),
        rng.uniform(-0.1, 0.1, (T, 2, nx, 1)),
    )
    guard = SafetyFilter(vehicles, scenario.safety) if safe else None
    acted = Execution(vehicles, ROBOT, guard).act(strategy, 4, s, length=3)
    inputs = plan(strategy, 4, vehicles.game_state(s), 3)
    states, w = vehicles.follow(ROBOT, s, inputs)
    if guard is None:
        assert acted.action == OFF
        np.testing.assert_array_equal(acted.inputs, w)
        np.testing.assert_array_equal(acted.states, states)
    else:
        expected = guard.check(s, w)
        assert acted.action == expected.action
        np.testing.assert_array_equal(acted.inputs, expected.inputs)


@pytest.mark.parametrize("turns", [-1, 2])
def test_a_strategy_applies_to_headings_that_count_other_turns(
    turns: int, two_player: Scenario, s: np.ndarray, w: np.ndarray, mind: Deliberation
) -> None:
    """As in a node that was restarted, and counts the turns of a heading from the start."""
    mind.observe(0, s, w)
    strategy, vehicles = mind.choose(), two_player.vehicles
    assert np.abs(strategy.P).max() > 0.1
    by = 2 * np.pi * turns * vehicles.is_angle
    s = s + 0.01
    plain = Execution(vehicles).act(strategy, 0, s)
    other = Execution(vehicles).act(strategy, 0, s + by)
    np.testing.assert_allclose(other.inputs, plain.inputs, rtol=0, atol=1e-9)


@pytest.mark.parametrize("turns", [-1, 2])
def test_beliefs_and_choices_do_not_depend_on_the_turns_that_states_count(
    turns: int, two_player: Scenario, s: np.ndarray, w: np.ndarray
) -> None:
    minds = [mind_of(two_player, log_of(two_player)) for _ in range(2)]
    vehicles = two_player.vehicles
    by = 2 * np.pi * turns * vehicles.is_angle
    for step in range(4):
        for mind, jump in zip(minds, (0.0 * by, by * (step % 2)), strict=True):
            mind.observe(step, s + jump, w)
            mind.update()
        plain, other = (mind.belief for mind in minds)
        np.testing.assert_array_equal(other.ids, plain.ids)
        np.testing.assert_allclose(other.weights, plain.weights, rtol=1e-6)
        chosen = [mind.choose() for mind in minds]
        inputs = [c.inputs(step, mind.newest.x) for c, mind in zip(chosen, minds, strict=True)]
        np.testing.assert_allclose(inputs[1], inputs[0], rtol=0, atol=1e-5)
        s = vehicles.step(s, w + 0.1)
