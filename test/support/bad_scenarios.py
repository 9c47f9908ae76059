"""Scenarios that are bad in one place, and their outcome.

Places are read off the models, so that a field, or a kind, that is new is tried too.
"""

from __future__ import annotations

import copy
import itertools
import tracemalloc
import types
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import numpy as np
import yaml_text
from bad_values import TEXTS, VALUES, spoiled

from gameinfer_ros.games import CostTerm, Dynamics
from gameinfer_ros.inference import Belief, SeedDistribution
from gameinfer_ros.lanes.blocks import WIDE
from gameinfer_ros.scenario import Scenario, ScenarioError
from gameinfer_ros.scenario import files as scenario_files
from gameinfer_ros.solver import GameSolver, Status, Strategy

Content = dict[str, Any]
Place = tuple[Any, ...]

FAMILIES = {"costs": CostTerm, "dynamics": Dynamics, "seeds": SeedDistribution}

#: Fields of a scenario that kinds stand in.
WHERE_KINDS_ARE = ("players", "costs", "seeds")

#: Larger games, and strategies of more bytes, are loaded, but not solved.
SOLVED, BYTES = 2e5, 2**25

#: Memory that solving a game may need, in sizes of the strategies of its particles.
TIMES = 8


def example(annotation: Any, length: int, number: Iterator[int]) -> Any:
    """Some value of a type, as plain data, with lists of a length, and no number twice."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return example(arguments[0], length, number)
    if origin is Literal:
        return arguments[0]
    if origin in (Union, types.UnionType):
        return example(arguments[0], length, number)
    if origin is tuple:
        if arguments[-1] is Ellipsis:
            return [example(arguments[0], length, number) for _ in range(length)]
        return [example(argument, length, number) for argument in arguments]
    if origin is dict:
        return {"robot": example(arguments[1], length, number)}
    return {float: float(next(number)), int: 1, str: "v", bool: True}[annotation]


def bases() -> list[Content]:
    """Scenarios that are good: those of the package, and one for each kind and field there is."""
    shipped = [Scenario.load(name) for name in scenario_files.available()]
    contents = [yaml_text.load(s.model_dump_json()) for s in shipped]
    alone = copy.deepcopy(contents[-1])
    alone["players"] = {"robot": alone["players"]["robot"]}
    alone["costs"] = [{"kind": "quadratic_input", "weights": [10.0, 10.0]}]
    for family, members in FAMILIES.items():
        for model in members.family.values():
            if not model.__module__.startswith("gameinfer_ros"):
                continue
            contents.append(next(c for c in _with(family, model, alone) if _is_good(c)))
    return contents


def _with(family: str, model: Any, alone: Content) -> Iterator[Content]:
    """A game of one player with a kind in it, whose lists have one length or another."""
    for length in (2, 4, 5):
        content, number = copy.deepcopy(alone), itertools.count(1)
        made = {
            name: example(field.annotation, length, number)
            for name, field in model.model_fields.items()
            if name != "players"
        }
        if family == "costs":
            content["costs"].append(made | {"players": ["robot"]})
        elif family == "seeds":
            content["seeds"] = made
        else:
            content["players"]["robot"] = {"dynamics": made, "initial": [0.0] * length}
        yield content


def _is_good(content: Content) -> bool:
    try:
        Scenario.model_validate(content)
    except ValueError:
        return False
    return True


def places(content: Any, at: Place = ()) -> Iterator[Place]:
    """Where there is something in a scenario: every field, item and key."""
    items: Any = ()
    if isinstance(content, dict):
        items = content.items()
    elif isinstance(content, list):
        items = enumerate(content)
    for key, value in items:
        yield (*at, key)
        yield from places(value, (*at, key))


def replaced(content: Content, place: Place, value: Any) -> Content:
    content = copy.deepcopy(content)
    _parent(content, place)[place[-1]] = value
    return content


def removed(content: Content, place: Place) -> Content:
    content = copy.deepcopy(content)
    del _parent(content, place)[place[-1]]
    return content


def renamed(content: Content, place: Place, name: Any) -> Content:
    """The same scenario with another key, where there is one."""
    content = copy.deepcopy(content)
    parent = _parent(content, place)
    if isinstance(parent, dict):
        parent[name] = parent.pop(place[-1])
    return content


def _parent(content: Any, place: Place) -> Any:
    for key in place[:-1]:
        content = content[key]
    return content


def text(content: Content) -> bytes:
    return yaml_text.dump(content).encode("utf-8", "surrogatepass")


def some(rng: np.random.Generator, good: list[Content]) -> bytes:
    """A file that is bad somewhere, drawn at random."""
    how = rng.random()
    if how < 0.02:
        return TEXTS[int(rng.integers(len(TEXTS)))]
    content = good[int(rng.integers(len(good)))]
    if how < 0.2:
        return spoiled(text(content), rng)
    everywhere = list(places(content))
    for _ in range(int(rng.choice([1, 1, 1, 2, 5]))):
        place = everywhere[int(rng.integers(len(everywhere)))]
        value = VALUES[int(rng.integers(len(VALUES)))]
        try:
            if rng.random() < 0.1:
                content = removed(content, place)
            elif rng.random() < 0.1 and isinstance(value, str):
                content = renamed(content, place, value)
            else:
                content = replaced(content, place, value)
        except (LookupError, TypeError):
            pass  # it is not there any more
    return text(content)


def outcome(path: Path) -> str:
    """`accepted` or `rejected`: what became of a file.

    Raises:
        Exception: it was neither.
    """
    try:
        scenario = Scenario.load(path)
    except ScenarioError as error:
        check_message(str(error), path)
        return "rejected"
    game, x = scenario.game, scenario.initial_state
    assert np.isfinite(scenario.initial_vehicle_state).all()
    assert x.shape == (game.players.n_states,)
    nx, nu = game.players.n_states, game.players.n_inputs
    particles = max(scenario.inference.particles, WIDE)
    size = 8 * game.horizon * (nu * nx + nu + nx) * particles
    if game.horizon * nx**3 <= SOLVED and size <= BYTES:
        tracemalloc.start()
        solver = GameSolver(game, scenario.solver)
        belief = Belief(solver, scenario.seeds, scenario.inference, np.random.default_rng(0))
        with np.errstate(all="ignore"):
            initial = Strategy.from_inputs(0, x, belief.particles.seeds)
            solution = solver.solve(x, initial, deadline=perf_counter() + 0.02)
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert peak <= TIMES * size + 2**24, f"{path}: {peak} bytes"
        assert solution.strategy.finite[solution.status != Status.NOT_FINITE].all()
    return "accepted"


def check_message(message: str, path: Path) -> None:
    """Whether it tells the file, the field, and what is allowed, and can be read."""
    lines = message.splitlines()
    if "cannot be read as YAML" in message:
        assert message.startswith(f"{path}: ") and len(message) < 4000
        return
    assert 0 < len(lines) <= 21
    for line in lines:
        assert line.startswith(f"{path}: ") and line.isprintable() and len(line) < 1200
        said = line.removeprefix(f"{path}: ")
        assert ": " in said or said.startswith(("contains ", "and ")), said


def pair(steps: int) -> Content:
    content = yaml_text.load(Scenario.load("two_player").model_dump_json())
    content |= {"dt": 0.1, "horizon": 10, "steps": steps}
    content["inference"]["particles"] = 4
    return content
