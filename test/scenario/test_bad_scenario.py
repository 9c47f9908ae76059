"""Scenarios that are refused, and with which words."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from scenario_content import GOOD, LANE, OBSTACLE, Content, edited

from gameinfer_ros.scenario import Scenario, ScenarioError

NAN, INF = float("nan"), float("inf")
#: Takes the field away.
MISSING = object()
ANA = GOOD["players"]["ana"]
BAD: dict[str, tuple[Any, ...]] = {
    # Which field gets which value, and what the message must contain: the field and the value,
    # and these words. The first one may name a field within that one, or what it says of another.
    "unknown key": ("colour", "red", "dt, horizon, steps"),
    "unknown key of a player": ("players.ana.colour", "red", "dynamics, initial"),
    "unknown key of dynamics": ("players.ana.dynamics.colour", "red", "kind"),
    "unknown key of a cost": ("costs[2].colour", "red", "radius, weight"),
    "unknown key of seeds": ("seeds.colour", "red", "low, high"),
    "unknown key of inference": ("inference.colour", "red", "particles, observation_noise"),
    "unknown key of solver": ("solver.colour", "red", "state_regularisation"),
    "too few states": ("players.ana.initial", [1.0, 2.5], "4", "px, vx, py, vy"),
    "limit of something else": ("players.robot.limits", {"v": [-1.0, 1.0]}, ".v:", "omega, a"),
    "limits that forbid to stand still": ("players.ana.limits.ax", [0.1, 1.0], "below 0", "above"),
    "limits that forbid to brake": ("players.ana.limits.ax", [-1.0, 0.0], "below 0", "above"),
    "half a limit": ("players.ana.limits.ax", [-1], "[1]:", "missing"),
    "limit without end": ("players.ana.limits.ax", [-1, INF], "[1]:", "inf", "finite"),
    "limits that are none": ("players.ana.limits", 3, "dictionary"),
    "negative radius": ("players.ana.radius", -0.1, "greater than or equal to 0"),
    "endless radius": ("players.ana.radius", INF, "finite"),
    "truth value for a radius": ("players.ana.radius", True, "number"),
    "players that overlap at the start": (
        "players.ana.radius", 1.5, "robot, with a radius of 0.0", "overlap by 0.0858 m"
    ),
    "too many weights": ("costs[0].weights", [1.0, 2.0, 3.0], "2", "omega, a"),
    "too short a goal": ("costs[3].goals.ana", [1.0], "4", "px, vx, py, vy"),
    "seeds that do not fit the inputs": (
        "seeds", {"kind": "cosine", "low": [0.0], "high": [1.0]}, ".low:", "[0.0]", "2", "omega, a"
    ),
    "seeds of two lengths": ("seeds.low", [0.0], "seeds: ", "(0.0,)", "(0.2, 0.1)", "length"),
    "seeds with low above high": (
        "seeds.low", [0.0, 0.3], "seeds: ", "(0.0, 0.3)", "(0.2, 0.1)", "above"
    ),
    "obstacle without a place": ("costs[4].center", [0.5], "[1]: is missing"),
    "obstacle in space": ("costs[4].center", [0.5, 0, 2], "at most 2"),
    "obstacle at no number": ("costs[4].center", [0.5, NAN], "[1]:", "nan", "finite"),
    "obstacle without a size": ("costs[4].radius", 0, "greater than 0"),
    "lane with one point": ("costs[5].points", [[0, 0]], "at least 2"),
    "lane that stands still": (
        "costs[5].points", [[0, 0], [1, 2], [1, 2.0]], "points[1] and [2]", "[1.0, 2.0]"
    ),
    "truth value for a coordinate": ("costs[5].points[1][0]", True, "number"),
    "negative width": ("costs[5].half_width", -0.5, "greater than or equal to 0"),
    "negative weight": ("costs[0].weights[1]", -2, "greater than or equal to 0"),
    "radius of zero": ("costs[2].radius", 0, "greater than 0"),
    "low above high": ("costs[1].low", 3.0, "costs[1]: ", "3.0", "2.0", "high"),
    "no players": ("players", {}, "at least 1"),
    "players as a list": ("players", ["robot"], "dict"),
    "costs as a mapping": ("costs", {}, "list"),
    "player that is no mapping": ("players.ana", 7, "PlayerSpec"),
    "goal of an unknown player": ("costs[3].goals.eve", [0, 0, 0, 0], ":", "robot, ana"),
    "no goal for a player": ("costs[3].goals.ana", MISSING, "costs[3].goals: ", "ana"),
    "term of an unknown player": ("costs[1].players", ["eve"], ":", "'eve'", "robot, ana"),
    "bound on an unknown state": ("costs[1].of", "w", ":", "'w'", "omega, a"),
    "unknown kind of dynamics": (
        "players.ana.dynamics.kind", "rocket", "'unicycle'", "'double_integrator'"
    ),
    "car without a wheelbase": ("players.ana.dynamics", {"kind": "car"}, ".wheelbase: is missing"),
    "car of no length": (
        "players.ana.dynamics", {"kind": "car", "wheelbase": 0}, ".wheelbase:", "greater than 0"
    ),
    "steering in degrees": (
        "players.ana",
        {"dynamics": {"kind": "car", "wheelbase": 1.0}, "initial": [1.0, 3.0, 0.0, 0.0, 5.0]},
        ".initial[4]:", "5.0", "between -1.5708 and 1.5708 rad; 5 degrees are 0.0872665 rad",
    ),
    "steering of a quarter turn": (
        "players.ana",
        {"dynamics": {"kind": "car", "wheelbase": 1.0}, "initial": [1.0, 3.0, 0.0, 0.0, -1.571]},
        ".initial[4]:", "-1.571", "between -1.5708 and 1.5708 rad",
    ),
    "flat unicycle that starts without a heading": (
        "players.ana", {"dynamics": {"kind": "flat_unicycle"}, "initial": [1.0, 0.0, 0.0]},
        ".initial:", "4", "px, py, theta, v",
    ),
    "unknown kind of cost": ("costs[0].kind", "magic", "'goal'", "'proximity'"),
    "unknown kind of seeds": ("seeds.kind", "magic", "'cosine'"),
    "kind of another family": ("costs[0].kind", "unicycle", "'goal'"),
    "no kind of dynamics": ("players.ana.dynamics", {}, "kind"),
    "no kind of cost": ("costs[2].kind", MISSING, "costs[2]: ", "'radius': 1.5", "kind"),
    "kind instead of a mapping": ("seeds", "cosine", "mapping with a kind"),
    "kind that is a list": ("seeds.kind", ["cosine"], "'cosine'"),
    "player with a space": ("players.a b", ANA, ":", "letters, digits and single underscores"),
    "player with an accent": ("players.zoé", ANA, ":", "ASCII letters"),
    "player with two underscores": ("players.a__b", ANA, ":", "single underscores"),
    "player that ends with an underscore": ("players.a_", ANA, ":", "underscore"),
    "truth value for a number": ("dt", True, "number"),
    "truth value for a weight": ("costs[2].weight", True, "number"),
    "truth value for a count": ("horizon", True, "integer"),
    "enormous horizon": ("horizon", 10**11, "10000"),
    "term without players": ("costs[2].players", [], "at least 1"),
    "term that a player has twice": ("costs[2].players", ["ana", "ana"], ":", "ana", "twice"),
    "player that starts with a digit": ("players.1st", ANA, ":", "digit"),
    "player that is a number": (("players", 7), ANA, "the key 7 is not text", "write it in quotes"),
    "player without a name": (("players", ""), ANA, "players.:", "letters"),
    "missing field": ("dt", MISSING, ": is missing"),
    "missing field of a player": ("players.ana.initial", MISSING, ": is missing"),
    "missing field of a cost": ("costs[2].radius", MISSING, ": is missing"),
    "time step that is not a number": ("dt", NAN),
    "time step of zero": ("dt", 0, "greater than or equal to 0.001"),
    "infinite weight": ("costs[2].weight", INF, "finite"),
    "initial state that is not a number": ("players.ana.initial[1]", NAN, "finite"),
    "text where a number belongs": ("dt", "soon", "valid number"),
    "half a step": ("horizon", 2.5, "integer"),
    "no horizon": ("horizon", 0, "greater than 0"),
    "no particles": ("inference.particles", 0, "greater than 0"),
    "no noise": ("inference.observation_noise", 0.0, "greater than 0"),
    "step size above one": ("solver.first_step_size", 1.5, "less than or equal to 1"),
    "negative regularisation": ("solver.state_regularisation", -1, "greater than or equal to 0"),
    "nothing where a mapping belongs": ("solver", None),
}  # fmt: skip


def put(content: Any, path: str | tuple[Any, ...], value: Any) -> None:
    """Give a field a value, or take it away."""
    if isinstance(path, str):
        path = tuple(int(k) if k.isdigit() else k for k in re.findall(r"[^.[\]]+", path))
    *parents, last = path
    for key in parents:
        content = content.setdefault(key, {}) if isinstance(content, dict) else content[key]
    if value is MISSING:
        del content[last]
    else:
        content[last] = value


@pytest.mark.parametrize("case", BAD)
def test_a_bad_scenario_is_refused_with_file_field_value_and_what_is_allowed(
    case: str, load: Callable[..., Scenario]
) -> None:
    path, value, *words = BAD[case]
    content = edited(lambda c: c["costs"].extend(copy.deepcopy([OBSTACLE, LANE])))
    put(content, path, value)
    with pytest.raises(ScenarioError) as caught:
        load(content)
    message = str(caught.value)
    assert "some.yaml: " in message
    if words and words[0].startswith((".", "[", ":")):
        words[0] = f"{path}{words[0]}"
    elif isinstance(path, str) and not (words and words[0].startswith(path[:4])):
        words += [f"{path}:", repr(value)]
    missing = [word for word in words if word not in message.split("some.yaml: ", 1)[1]]
    assert not missing, f"{missing} is not in: {message}"


def test_all_mistakes_are_reported_at_once_each_with_the_file(
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
        ("", ("contains nothing", "mapping")),
        ("# nothing yet\n", ("contains nothing", "mapping")),
        ("- dt: 0.1", ("[{'dt': 0.1}]", "mapping")),
        ("just text", ("'just text'", "mapping")),
    ],
)
def test_a_file_that_holds_no_scenario_is_refused(
    text: str, words: tuple[str, ...], load: Callable[..., Scenario]
) -> None:
    with pytest.raises(ScenarioError) as caught:
        load(text)
    assert "some.yaml: " in str(caught.value)
    assert all(word in str(caught.value) for word in words), caught.value


def test_a_file_that_is_not_there_is_refused_with_what_is(tmp_path: Path) -> None:
    for missing in (tmp_path / "nowhere.yaml", "nowhere", tmp_path):
        with pytest.raises(ScenarioError) as caught:
            Scenario.load(missing)
        assert str(missing) in str(caught.value)
        assert "two_player" in str(caught.value) and "three_player" in str(caught.value)


def test_a_scenario_error_is_a_value_error() -> None:
    assert issubclass(ScenarioError, ValueError)
