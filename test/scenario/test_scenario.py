from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest
from pydantic import ValidationError
from scenario_content import GOOD, LANE, OBSTACLE, Content, edited, with_cost

from gameinfer_ros.games import Game, Obstacle, RoadLane
from gameinfer_ros.scenario import Scenario, available, suite


def published_cost(x: np.ndarray, u: np.ndarray, t: float, i: int, goals: np.ndarray) -> float:
    """Cost of player i at one step, as the numbers of the paper's running example have it."""

    def excess(value: float, low: float, high: float) -> float:
        return max(low - value, value - high, 0.0)

    (px, py, _, v), (omega, a) = x[i], u[i]
    value = 0.5 * 10 * (omega**2 + a**2) + 0.5 * 30 * v**2
    value += 50 * excess(omega, -np.deg2rad(10), np.deg2rad(10)) ** 2
    value += 50 * excess(a, -9.81, 9.81) ** 2
    value += 50 * excess(v, -0.05, 2.0) ** 2
    for j in range(len(x)):
        if j != i:
            value += 50 * max(0.0, 1.5 - np.hypot(px - x[j, 0], py - x[j, 1])) ** 2
    if t >= 10 - 1.5 * 0.1:
        dpx, dpy, dtheta = x[i, :3] - goals[i, :3]
        turned = np.angle(np.exp(1j * dtheta))  # headings count modulo a turn
        value += 0.5 * 300 * (dpx**2 + dpy**2 + turned**2)
    return value


def published_flat_cost(x: np.ndarray, u: np.ndarray, t: float, i: int, goals: np.ndarray) -> float:
    """The same for the flat game; `goals` are positions."""
    px, vx, py, vy = x[i]
    value = 0.5 * 10 * (u[i] @ u[i]) + 0.5 * 40 * (vx**2 + vy**2)
    value += 50 * (max(0.0, abs(vx) - 2.0) ** 2 + max(0.0, abs(vy) - 2.0) ** 2)
    for j in range(len(x)):
        if j != i:
            value += 50 * max(0.0, 2.0 - np.hypot(px - x[j, 0], py - x[j, 2])) ** 2
    if t >= 10 - 1.5 * 0.1:
        value += 0.5 * 500 * np.sum((np.array([px, py]) - goals[i]) ** 2)
    return value


def assert_costs(
    game: Game, published: Callable[..., float], goals: np.ndarray, rng: np.random.Generator
) -> None:
    n = len(goals)
    x, u = rng.normal(0, 1.5, (110, n, 4)), rng.normal(0, 5, (110, n, 2))
    expected = [[published(x[k], u[k], 0.1 * k, i, goals) for k in range(110)] for i in range(n)]
    costs = game.costs(x.reshape(110, -1), u.reshape(110, -1))
    np.testing.assert_allclose(costs, expected, rtol=1e-8)


@pytest.mark.parametrize(
    ("name", "count", "turn", "particles", "threads"),
    [
        ("two_player", 2, 90, 50, 1),
        ("three_player", 3, 120, 50, 1),
        ("five_player_unicycle", 5, 72, 150, 2),
    ],
)
def test_shipped_scenarios_have_the_published_numbers(
    name: str, count: int, turn: float, particles: int, threads: int
) -> None:
    loaded = Scenario.load(name)
    game = loaded.game
    assert (loaded.dt, loaded.horizon, loaded.steps, len(game.players)) == (0.1, 100, 101, count)
    angles = np.deg2rad(turn) * np.arange(count)
    start = [[-3 * np.cos(phi), -3 * np.sin(phi), phi, 0.0] for phi in angles]
    goals = np.array([[3 * np.cos(phi), 3 * np.sin(phi), phi, 0.0] for phi in angles])
    np.testing.assert_allclose(loaded.initial_state, np.ravel(start), atol=1e-9)

    rng = np.random.default_rng(0)
    assert_costs(game, published_cost, goals, rng)
    assert loaded.inference.particles == particles
    assert loaded.inference.observation_noise == 0.1
    assert loaded.inference.duplicate_tolerance == 0.1
    assert loaded.solver.model_dump() == {
        "method": "iterative_lq",
        "tolerance": 1e-4,
        "warm_tolerance": 0.05,
        "state_regularisation": 5.0,
        "input_regularisation": 5.0,
        "first_step_size": 0.5,
        "max_halvings": 20,
        "max_movement": 1.5,
        "converged_movement": 0.05,
        "max_iterations": 200,
        "threads": threads,
    }
    seeds = loaded.seeds.sample(rng, game.players, 100, 500)
    omega, a = seeds[0, ::2], seeds[0, 1::2]
    assert np.abs(omega).max() == pytest.approx(np.deg2rad(15), rel=0.02)
    assert (a.min(), a.max()) == pytest.approx((0.075, 0.125), rel=0.02)
    shape = np.cos(np.pi * np.arange(100) / 100)
    np.testing.assert_allclose(seeds, shape[:, None, None] * seeds[0], atol=1e-12)


def test_the_flat_game_has_the_published_numbers() -> None:
    loaded = Scenario.load("five_player")
    game, same = loaded.game, Scenario.load("five_player_unicycle")
    assert (loaded.dt, loaded.horizon, loaded.steps, len(game.players)) == (0.1, 100, 101, 5)
    np.testing.assert_array_equal(loaded.initial_vehicle_state, same.initial_vehicle_state)
    angles = np.deg2rad(72) * np.arange(5)
    start = [[-3 * np.cos(phi), 0.0, -3 * np.sin(phi), 0.0] for phi in angles]
    goals = np.array([[3 * np.cos(phi), 3 * np.sin(phi)] for phi in angles])
    np.testing.assert_allclose(loaded.initial_state, np.ravel(start), atol=1e-9)

    rng = np.random.default_rng(0)
    assert_costs(game, published_flat_cost, goals, rng)
    assert loaded.inference == same.inference
    assert loaded.solver == same.solver
    seeds = loaded.seeds.sample(rng, game.players, 100, 500)
    assert (seeds.min(), seeds.max()) == pytest.approx((-0.1, 0.1), rel=0.02)
    np.testing.assert_array_equal(seeds, np.broadcast_to(seeds[0], seeds.shape))


def test_initial_states_are_those_of_the_vehicles(load: Callable[..., Scenario]) -> None:
    def flat(content: Content) -> None:
        content["players"]["robot"] = {
            "dynamics": {"kind": "flat_unicycle"},
            "initial": [1.0, 2.0, np.pi / 2, 0.5],
        }
        content["costs"][1]["of"] = "vx"

    loaded = load(edited(flat))
    assert loaded.initial_vehicle_state.tolist() == [1.0, 2.0, np.pi / 2, 0.5, 0.0, 0.0, -1.0, 0.0]
    expected = [1.0, 0.0, 2.0, 0.5, 0.0, 0.0, -1.0, 0.0]
    np.testing.assert_allclose(loaded.initial_state, expected, atol=1e-12)


def test_every_shipped_scenario_can_be_loaded() -> None:
    names = available()
    assert {"two_player", "three_player", "five_player", "five_player_unicycle"} <= set(names)
    for name, path in names.items():
        assert Scenario.load(name) == Scenario.load(path) == Scenario.load(str(path))


def test_every_game_of_the_suite_is_found_by_name() -> None:
    games = suite()
    assert len(games) >= 12 and not set(games) & set(available())
    counts = set()
    for name, path in games.items():
        loaded = Scenario.load(name)
        assert loaded == Scenario.load(path)
        assert 8.0 <= loaded.horizon * loaded.dt <= 10.0
        counts.add(len(loaded.players))
    assert min(counts) == 1 and max(counts) == 8


def test_every_field_of_the_suite_states_its_unit() -> None:
    for name, path in suite().items():
        text = path.read_text(encoding="utf-8")
        assert text.startswith("# "), name
        for field in ("dt", "horizon", "steps", "players", "seeds"):
            assert re.search(rf"^{field}: .*# \S", text, re.MULTILINE), f"{field} of {name}"


def test_a_scenario_is_loaded_as_it_is_written(load: Callable[..., Scenario]) -> None:
    loaded = load(GOOD)
    assert loaded.game.players.names == ("robot", "ana")
    assert [term.kind for term in loaded.costs] == [cost["kind"] for cost in GOOD["costs"]]
    np.testing.assert_array_equal(loaded.initial_state, [-1, 0, 0, 0, 0, 0, -1, 0])
    assert (loaded.inference.particles, loaded.solver.max_iterations) == (5, 30)
    assert loaded.game is loaded.game
    with pytest.raises(ValidationError, match="frozen"):
        loaded.dt = 0.2


def test_what_may_be_left_out_has_defaults(load: Callable[..., Scenario]) -> None:
    def leave_out(content: Content) -> None:
        del content["solver"], content["inference"]

    loaded = load(edited(leave_out))
    assert (loaded.solver.max_iterations, loaded.inference.particles) == (200, 50)


def test_limits_are_those_of_the_vehicle(load: Callable[..., Scenario]) -> None:
    def limit(content: Content) -> None:
        content["players"]["robot"]["dynamics"]["kind"] = "flat_unicycle"
        content["players"]["robot"]["limits"] = {"a": [-3, 2.5]}
        content["costs"][1]["of"] = "vx"

    vehicles = load(edited(limit)).vehicles
    np.testing.assert_array_equal(vehicles.low, [-np.inf, -3.0, -np.inf, -np.inf])
    np.testing.assert_array_equal(vehicles.high, [np.inf, 2.5, np.inf, np.inf])


def test_obstacles_and_lanes_are_loaded_as_they_are_written(load: Callable[..., Scenario]) -> None:
    content = edited(with_cost(OBSTACLE))
    obstacle, lane = load({**content, "costs": [*content["costs"], LANE]}).costs[4:]
    assert obstacle == Obstacle(center=(0.5, 0.0), radius=1.0, weight=50.0)
    assert lane == RoadLane(points=((0.0, 0.0), (1.0, 0.0)), half_width=0.0, weight=50.0)
