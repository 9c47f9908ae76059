"""Scenarios that are refused, and with which words."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from scenario_content import LANE, OBSTACLE, Content, edited, with_cost

from gameinfer_ros.scenario import Scenario, ScenarioError

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
        ("the key 7 is not text", "write it in quotes"),
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
        ("", ("contains nothing", "mapping")),
        ("# nothing yet\n", ("contains nothing", "mapping")),
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


def test_a_scenario_error_is_a_value_error() -> None:
    assert issubclass(ScenarioError, ValueError)
