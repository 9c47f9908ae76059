from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
import pytest
import yaml
from pydantic import ValidationError

from gameinfer_ros import scenario as scenario_module
from gameinfer_ros.games import CostTerm, Lane, Obstacle, Players
from gameinfer_ros.games.cost_term import BoundTerm
from gameinfer_ros.games.kernels import Array, kernel
from gameinfer_ros.scenario import Scenario, ScenarioError
from gameinfer_ros.solver import IterativeLQ, Strategy

Content = dict[str, Any]

GOOD: Content = {
    "dt": 0.1,
    "horizon": 20,
    "steps": 21,
    "players": {
        "robot": {"dynamics": {"kind": "unicycle"}, "initial": [-1.0, 0.0, 0.0, 0.0]},
        "ana": {"dynamics": {"kind": "double_integrator"}, "initial": [0.0, 0.0, -1.0, 0.0]},
    },
    "costs": [
        {"kind": "quadratic_input", "weights": [10, 10]},
        {
            "kind": "soft_bound",
            "of": "v",
            "low": 0.0,
            "high": 2,
            "weight": 50,
            "players": ["robot"],
        },
        {"kind": "proximity", "radius": 1.5, "weight": 50},
        {
            "kind": "goal",
            "weights": [300, 300, 300, 0],
            "active_from": 1.85,
            "goals": {"robot": [1.0, 0.0, 0.0, 0.0], "ana": [0.0, 0.0, 1.0, 0.0]},
        },
    ],
    "seeds": {"kind": "cosine", "low": [-0.2, 0.1], "high": [0.2, 0.1]},
    "inference": {"particles": 5, "observation_noise": 0.1, "duplicate_tolerance": 0.1},
    "solver": {"max_iterations": 30},
}


def edited(edit: Callable[[Content], Any]) -> Content:
    content = copy.deepcopy(GOOD)
    edit(content)
    return content


@pytest.fixture
def load(tmp_path: Path) -> Callable[[Content | str], Scenario]:
    """Loads a scenario from a file with this content, or with this text."""

    def from_file(content: Content | str) -> Scenario:
        path = tmp_path / "some.yaml"
        path.write_text(
            content if isinstance(content, str) else yaml.safe_dump(content, sort_keys=False)
        )
        return Scenario.load(path)

    return from_file


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
        value += 0.5 * 300 * np.sum((x[i, :3] - goals[i, :3]) ** 2)
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
    x, u = rng.normal(0, 1.5, (110, count, 4)), rng.normal(0, 5, (110, count, 2))
    expected = [
        [published_cost(x[k], u[k], 0.1 * k, i, goals) for k in range(110)] for i in range(count)
    ]
    costs = game.costs(x.reshape(110, -1), u.reshape(110, -1))
    np.testing.assert_allclose(costs, expected, rtol=1e-8)

    assert loaded.inference.particles == particles
    assert loaded.inference.observation_noise == 0.1
    assert loaded.inference.duplicate_tolerance == 0.1
    assert loaded.solver.model_dump() == {
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
    x, u = rng.normal(0, 1.5, (110, 5, 4)), rng.normal(0, 5, (110, 5, 2))
    expected = [
        [published_flat_cost(x[k], u[k], 0.1 * k, i, goals) for k in range(110)] for i in range(5)
    ]
    costs = game.costs(x.reshape(110, -1), u.reshape(110, -1))
    np.testing.assert_allclose(costs, expected, rtol=1e-8)

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
    names = scenario_module.available()
    assert {"two_player", "three_player", "five_player", "five_player_unicycle"} <= set(names)
    for name, path in names.items():
        assert Scenario.load(name) == Scenario.load(path) == Scenario.load(str(path))


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


OBSTACLE: Content = {"kind": "obstacle", "center": [0.5, 0], "radius": 1, "weight": 50}
LANE: Content = {"kind": "lane", "points": [[0, 0], [1, 0]], "half_width": 0, "weight": 50}


def with_cost(cost: Content, **fields: Any) -> Callable[[Content], Any]:
    """An edit that adds this term, with other `fields`, as costs[4]."""
    return lambda content: content["costs"].append({**cost, **fields})


def test_obstacles_and_lanes_are_loaded_as_they_are_written(load: Callable[..., Scenario]) -> None:
    content = edited(with_cost(OBSTACLE))
    obstacle, lane = load({**content, "costs": [*content["costs"], LANE]}).costs[4:]
    assert obstacle == Obstacle(center=(0.5, 0.0), radius=1.0, weight=50.0)
    assert lane == Lane(points=((0.0, 0.0), (1.0, 0.0)), half_width=0.0, weight=50.0)


BAD: dict[str, tuple[Callable[[Content], Any], tuple[str, ...]]] = {
    # Each edit, and what the message must contain: the field, the value, and what is allowed.
    "unknown key": (lambda c: c.update(colour="red"), ("colour:", "'red'", "dt, horizon, steps")),
    "unknown key of a player": (
        lambda c: c["players"]["ana"].update(colour="red"),
        ("players.ana.colour:", "'red'", "dynamics, initial"),
    ),
    "unknown key of dynamics": (
        lambda c: c["players"]["ana"]["dynamics"].update(colour="red"),
        ("players.ana.dynamics.colour:", "'red'", "kind"),
    ),
    "unknown key of a cost": (
        lambda c: c["costs"][2].update(colour="red"),
        ("costs[2].colour:", "'red'", "radius, weight"),
    ),
    "unknown key of seeds": (
        lambda c: c["seeds"].update(colour="red"),
        ("seeds.colour:", "'red'", "low, high"),
    ),
    "unknown key of inference": (
        lambda c: c["inference"].update(colour="red"),
        ("inference.colour:", "'red'", "particles, observation_noise"),
    ),
    "unknown key of solver": (
        lambda c: c["solver"].update(colour="red"),
        ("solver.colour:", "'red'", "state_regularisation"),
    ),
    "too few states": (
        lambda c: c["players"]["ana"].update(initial=[1.0, 2.5]),
        ("players.ana.initial:", "[1.0, 2.5]", "4", "px, vx, py, vy"),
    ),
    "limit of something else": (
        lambda c: c["players"]["robot"].update(limits={"a": [-1.0, 1.0], "v": [-1.0, 1.0]}),
        ("players.robot.limits.v:", "omega, a"),
    ),
    "limits that forbid to stand still": (
        lambda c: c["players"]["ana"].update(limits={"ax": [0.1, 1.0]}),
        ("players.ana.limits.ax:", "[0.1, 1.0]", "below 0", "above"),
    ),
    "limits that forbid to brake": (
        lambda c: c["players"]["ana"].update(limits={"ax": [-1, 0]}),
        ("players.ana.limits.ax:", "[-1.0, 0.0]", "below 0", "above"),
    ),
    "half a limit": (
        lambda c: c["players"]["ana"].update(limits={"ax": [-1]}),
        ("players.ana.limits.ax[1]:", "missing"),
    ),
    "limit without end": (
        lambda c: c["players"]["ana"].update(limits={"ax": [-1, float("inf")]}),
        ("players.ana.limits.ax[1]:", "inf", "finite"),
    ),
    "limits that are none": (
        lambda c: c["players"]["ana"].update(limits=3),
        ("players.ana.limits:", "3", "dictionary"),
    ),
    "too many weights": (
        lambda c: c["costs"][0].update(weights=[1, 2, 3]),
        ("costs[0].weights:", "[1.0, 2.0, 3.0]", "2", "omega, a"),
    ),
    "too short a goal": (
        lambda c: c["costs"][3]["goals"].update(ana=[1.0]),
        ("costs[3].goals.ana:", "[1.0]", "4", "px, vx, py, vy"),
    ),
    "seeds that do not fit the inputs": (
        lambda c: c["seeds"].update(low=[0.0], high=[1.0]),
        ("seeds.low:", "[0.0]", "2", "omega, a"),
    ),
    "seeds of two lengths": (
        lambda c: c["seeds"].update(low=[0.0]),
        ("seeds", "(0.0,)", "(0.2, 0.1)", "length"),
    ),
    "seeds with low above high": (
        lambda c: c["seeds"].update(low=[0.0, 0.3]),
        ("seeds", "(0.0, 0.3)", "(0.2, 0.1)", "above"),
    ),
    "obstacle without a place": (
        with_cost(OBSTACLE, center=[0.5]),
        ("costs[4].center[1]: is missing",),
    ),
    "obstacle in space": (
        with_cost(OBSTACLE, center=[0.5, 0, 2]),
        ("costs[4].center:", "[0.5, 0, 2]", "at most 2"),
    ),
    "obstacle at no number": (
        with_cost(OBSTACLE, center=[0.5, float("nan")]),
        ("costs[4].center[1]:", "nan", "finite"),
    ),
    "obstacle without a size": (
        with_cost(OBSTACLE, radius=0),
        ("costs[4].radius:", "0", "greater than 0"),
    ),
    "lane with one point": (
        with_cost(LANE, points=[[0, 0]]),
        ("costs[4].points:", "[[0, 0]]", "at least 2"),
    ),
    "lane that stands still": (
        with_cost(LANE, points=[[0, 0], [1, 2], [1, 2.0]]),
        ("costs[4].points:", "[[0, 0], [1, 2], [1, 2.0]]", "points[1] and [2]", "[1.0, 2.0]"),
    ),
    "truth value for a coordinate": (
        with_cost(LANE, points=[[0, 0], [True, 0]]),
        ("costs[4].points[1][0]:", "True", "number"),
    ),
    "negative width": (
        with_cost(LANE, half_width=-0.5),
        ("costs[4].half_width:", "-0.5", "greater than or equal to 0"),
    ),
    "negative weight": (
        lambda c: c["costs"][0].update(weights=[1, -2]),
        ("costs[0].weights[1]:", "-2", "greater than or equal to 0"),
    ),
    "radius of zero": (
        lambda c: c["costs"][2].update(radius=0),
        ("costs[2].radius:", "0", "greater than 0"),
    ),
    "low above high": (
        lambda c: c["costs"][1].update(low=3.0),
        ("costs[1]", "3.0", "2.0", "low", "high"),
    ),
    "no players": (lambda c: c.update(players={}), ("players:", "{}", "at least 1")),
    "players as a list": (lambda c: c.update(players=["robot"]), ("players:", "['robot']", "dict")),
    "costs as a mapping": (lambda c: c.update(costs={}), ("costs:", "{}", "list")),
    "player that is no mapping": (
        lambda c: c["players"].update(ana=7),
        ("players.ana:", "7", "PlayerSpec"),
    ),
    "goal of an unknown player": (
        lambda c: c["costs"][3]["goals"].update(eve=[0, 0, 0, 0]),
        ("costs[3].goals.eve:", "robot, ana"),
    ),
    "no goal for a player": (
        lambda c: c["costs"][3]["goals"].pop("ana"),
        ("costs[3].goals:", "ana"),
    ),
    "term of an unknown player": (
        lambda c: c["costs"][1].update(players=["eve"]),
        ("costs[1].players:", "'eve'", "robot, ana"),
    ),
    "bound on an unknown state": (
        lambda c: c["costs"][1].update(of="w"),
        ("costs[1].of:", "'w'", "omega, a"),
    ),
    "unknown kind of dynamics": (
        lambda c: c["players"]["ana"]["dynamics"].update(kind="rocket"),
        ("players.ana.dynamics.kind:", "'rocket'", "'unicycle'", "'double_integrator'"),
    ),
    "car without a wheelbase": (
        lambda c: c["players"]["ana"].update(dynamics={"kind": "car"}),
        ("players.ana.dynamics.wheelbase: is missing",),
    ),
    "car of no length": (
        lambda c: c["players"]["ana"].update(dynamics={"kind": "car", "wheelbase": 0}),
        ("players.ana.dynamics.wheelbase:", "0", "greater than 0"),
    ),
    "flat unicycle that starts without a heading": (
        lambda c: c["players"]["ana"].update(
            dynamics={"kind": "flat_unicycle"}, initial=[1.0, 0.0, 0.0]
        ),
        ("players.ana.initial:", "4", "px, py, theta, v"),
    ),
    "unknown kind of cost": (
        lambda c: c["costs"][0].update(kind="magic"),
        ("costs[0].kind:", "'magic'", "'goal'", "'proximity'"),
    ),
    "unknown kind of seeds": (
        lambda c: c["seeds"].update(kind="magic"),
        ("seeds.kind:", "'magic'", "'cosine'"),
    ),
    "kind of another family": (
        lambda c: c["costs"][0].update(kind="unicycle"),
        ("costs[0].kind:", "'unicycle'", "'goal'"),
    ),
    "no kind of dynamics": (
        lambda c: c["players"]["ana"].update(dynamics={}),
        ("players.ana.dynamics:", "{}", "kind"),
    ),
    "no kind of cost": (
        lambda c: c["costs"][2].pop("kind"),
        ("costs[2]:", "'radius': 1.5", "kind"),
    ),
    "kind instead of a mapping": (
        lambda c: c.update(seeds="cosine"),
        ("seeds:", "'cosine'", "mapping with a kind"),
    ),
    "kind that is a list": (lambda c: c["seeds"].update(kind=["cosine"]), ("seeds", "['cosine']")),
    "player with a space": (
        lambda c: c["players"].update({"a b": c["players"]["ana"]}),
        ("players.a b:", "letters, digits and single underscores"),
    ),
    "player with an accent": (
        lambda c: c["players"].update({"zoé": c["players"]["ana"]}),
        ("players.zoé:", "ASCII letters"),
    ),
    "player with two underscores": (
        lambda c: c["players"].update({"a__b": c["players"]["ana"]}),
        ("players.a__b:", "single underscores"),
    ),
    "player that ends with an underscore": (
        lambda c: c["players"].update({"a_": c["players"]["ana"]}),
        ("players.a_:", "underscore"),
    ),
    "truth value for a number": (lambda c: c.update(dt=True), ("dt:", "True", "number")),
    "truth value for a weight": (
        lambda c: c["costs"][2].update(weight=True),
        ("costs[2].weight:", "True", "number"),
    ),
    "truth value for a count": (lambda c: c.update(horizon=True), ("horizon:", "True", "integer")),
    "enormous horizon": (lambda c: c.update(horizon=10**11), ("horizon:", "10000")),
    "term of nobody": (
        lambda c: c["costs"][2].update(players=[]),
        ("costs[2].players:", "at least 1"),
    ),
    "term that a player has twice": (
        lambda c: c["costs"][2].update(players=["ana", "ana"]),
        ("costs[2].players:", "ana", "twice"),
    ),
    "player that starts with a digit": (
        lambda c: c["players"].update({"1st": c["players"]["ana"]}),
        ("players.1st:", "digit"),
    ),
    "player that is a number": (
        lambda c: c["players"].update({7: c["players"]["ana"]}),
        ("players[7]", "7", "valid string"),
    ),
    "player without a name": (
        lambda c: c["players"].update({"": c["players"]["ana"]}),
        ("players.:", "letters"),
    ),
    "missing field": (lambda c: c.pop("dt"), ("dt: is missing",)),
    "missing field of a player": (
        lambda c: c["players"]["ana"].pop("initial"),
        ("players.ana.initial: is missing",),
    ),
    "missing field of a cost": (
        lambda c: c["costs"][3].pop("active_from"),
        ("costs[3].active_from: is missing",),
    ),
    "time step that is not a number": (lambda c: c.update(dt=float("nan")), ("dt:", "nan")),
    "time step of zero": (lambda c: c.update(dt=0), ("dt:", "0", "greater than or equal to 0.001")),
    "infinite weight": (
        lambda c: c["costs"][2].update(weight=float("inf")),
        ("costs[2].weight:", "inf", "finite"),
    ),
    "initial state that is not a number": (
        lambda c: c["players"]["ana"].update(initial=[0, float("nan"), 0, 0]),
        ("players.ana.initial[1]:", "nan", "finite"),
    ),
    "text where a number belongs": (
        lambda c: c.update(dt="soon"),
        ("dt:", "'soon'", "valid number"),
    ),
    "half a step": (lambda c: c.update(horizon=2.5), ("horizon:", "2.5", "integer")),
    "no horizon": (lambda c: c.update(horizon=0), ("horizon:", "0", "greater than 0")),
    "no particles": (
        lambda c: c["inference"].update(particles=0),
        ("inference.particles:", "0", "greater than 0"),
    ),
    "no noise": (
        lambda c: c["inference"].update(observation_noise=0.0),
        ("inference.observation_noise:", "0.0", "greater than 0"),
    ),
    "step size above one": (
        lambda c: c["solver"].update(first_step_size=1.5),
        ("solver.first_step_size:", "1.5", "less than or equal to 1"),
    ),
    "negative regularisation": (
        lambda c: c["solver"].update(state_regularisation=-1),
        ("solver.state_regularisation:", "-1", "greater than or equal to 0"),
    ),
    "nothing where a mapping belongs": (lambda c: c.update(solver=None), ("solver:", "None")),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_scenario_is_refused_with_file_field_value_and_what_is_allowed(
    case: str, load: Callable[..., Scenario]
) -> None:
    edit, words = BAD[case]
    with pytest.raises(ScenarioError) as caught:
        load(edited(edit))
    message = str(caught.value)
    assert "some.yaml: " in message
    missing = [word for word in words if word not in message.split("some.yaml: ", 1)[1]]
    assert not missing, f"{missing} is not in: {message}"


def test_all_mistakes_are_told_at_once_each_with_the_file(
    load: Callable[..., Scenario],
) -> None:
    def spoil(content: Content) -> None:
        content["dt"], content["horizon"], content["costs"][0]["weights"] = -1, 0, [-3, 1]

    with pytest.raises(ScenarioError) as caught:
        load(edited(spoil))
    lines = str(caught.value).splitlines()
    assert len(lines) == 3
    assert all("some.yaml: " in line for line in lines)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("dt: [0.1", ("YAML",)),
        ("dt: 0.1\n\tsteps: 3", ("YAML",)),
        ("", ("None", "mapping")),
        ("# nothing yet\n", ("None", "mapping")),
        ("- dt: 0.1", ("[{'dt': 0.1}]", "mapping")),
        ("just text", ("'just text'", "mapping")),
        ("!!python/object/apply:os.getcwd []", ("YAML",)),
    ],
)
def test_a_file_that_holds_no_scenario_is_refused(
    text: str, words: tuple[str, ...], load: Callable[..., Scenario]
) -> None:
    with pytest.raises(ScenarioError) as caught:
        load(text)
    assert "some.yaml: " in str(caught.value)
    assert all(word in str(caught.value) for word in words), caught.value


def test_a_file_that_is_not_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "some.yaml"
    path.write_bytes(b"\xff\xfe\x00dt: 0.1")
    with pytest.raises(ScenarioError, match=r"some\.yaml: cannot be read"):
        Scenario.load(path)


def test_a_file_that_is_not_there_is_refused_with_what_is(tmp_path: Path) -> None:
    for missing in (tmp_path / "nowhere.yaml", "nowhere", tmp_path):
        with pytest.raises(ScenarioError) as caught:
            Scenario.load(missing)
        assert str(missing) in str(caught.value)
        assert "two_player" in str(caught.value) and "three_player" in str(caught.value)


def test_a_key_that_stands_twice_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "twice.yaml"
    file.write_text("dt: 0.1\nhorizon: 3\ndt: 0.2\n")
    with pytest.raises(ScenarioError, match=r"(?s)twice.yaml.*'dt' stands there twice.*line 3"):
        Scenario.load(file)


def test_yaml_that_is_nested_too_deep_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "deep.yaml"
    file.write_text("dt: " + "[" * 5000)
    with pytest.raises(ScenarioError, match=r"deep\.yaml"):
        Scenario.load(file)


def test_a_scenario_error_is_a_value_error() -> None:
    assert issubclass(ScenarioError, ValueError)


# A cost term of the user's own: everything that a new kind needs.


@kernel
def leash_cost(t: float, x: Array, u: Array, index: Array, params: Array) -> Array:
    dx, dy = x[index[0]] - x[index[2]], x[index[1]] - x[index[3]]
    return 0.5 * params[0] * (dx * dx + dy * dy)


@kernel
def leash_quadraticise(
    t: float, x: Array, u: Array, index: Array, params: Array,
    Q: Array, q: Array, R: Array, r: Array,
) -> None:  # fmt: skip
    for axis in range(2):
        own, other = index[axis], index[2 + axis]
        pull = params[0] * (x[own] - x[other])
        q[own] += pull
        q[other] -= pull
        Q[own, own] += params[0]
        Q[other, other] += params[0]
        Q[own, other] -= params[0]
        Q[other, own] -= params[0]


@pytest.fixture
def leash() -> Iterator[type[CostTerm]]:
    """1/2 w d^2 for the distance d to another player; forgotten after the test."""

    class Leash(CostTerm):
        kind: Literal["leash"] = "leash"
        to: str
        weight: float
        cost_kernel: ClassVar[Any] = leash_cost
        quadraticise_kernel: ClassVar[Any] = leash_quadraticise

        def bind(self, players: Players, i: int) -> list[BoundTerm]:
            rows = players.position_rows(i) + players.position_rows(players.index(self.to))
            return [BoundTerm(self, rows, (self.weight,))]

    yield Leash
    del CostTerm.family["leash"]
    Scenario.model_rebuild(force=True)


def test_a_cost_term_of_the_users_own_is_known_by_its_kind(
    leash: type[CostTerm], load: Callable[..., Scenario]
) -> None:
    term = {"kind": "leash", "to": "robot", "weight": 20.0, "players": ["ana"]}
    loaded = load(edited(lambda c: c["costs"].append(term)))
    assert isinstance(loaded.costs[-1], leash)

    x, u = loaded.initial_state[None], np.zeros((1, 4))
    difference = loaded.game.costs(x, u) - load(GOOD).game.costs(x, u)
    np.testing.assert_allclose(difference, [[0.0], [0.5 * 20.0 * 2.0]])

    seeds = np.zeros((20, 4, 1))
    distances = []
    for scenario in (loaded, load(GOOD)):
        solution = IterativeLQ(scenario.game, scenario.solver).solve(
            scenario.initial_state, Strategy.from_inputs(0, scenario.initial_state, seeds)
        )
        assert solution.converged.all(), solution.reason(0)
        distances.append(scenario.game.players.distances(solution.strategy.x_ref[..., 0]).mean())
    assert distances[0] < distances[1], "the leash must keep them together"


def test_a_cost_term_of_the_users_own_is_validated(
    leash: type[CostTerm], load: Callable[..., Scenario]
) -> None:
    term = {"kind": "leash", "weight": 20.0}
    with pytest.raises(ScenarioError, match=r"costs\[4\]\.to: is missing"):
        load(edited(lambda c: c["costs"].append(term)))


def test_a_forgotten_kind_is_unknown_again(load: Callable[..., Scenario]) -> None:
    term = {"kind": "leash", "to": "robot", "weight": 20.0, "players": ["ana"]}
    with pytest.raises(ScenarioError, match=r"costs\[4\]\.kind: 'leash'"):
        load(edited(lambda c: c["costs"].append(term)))
