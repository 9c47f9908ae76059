"""Warnings about scenarios that are valid, but probably not what their authors mean."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from gameinfer_ros.games import (
    Car,
    CostTerm,
    Dynamics,
    Goal,
    Players,
    QuadraticInput,
    SoftBound,
    Vehicle,
    Vehicles,
)
from gameinfer_ros.games.angles import TURN

#: Largest angle, in rad, that does not look like degrees: a turn, however it is rounded. For the
#: steering of a car, it is a quarter turn.
LARGEST_ANGLE, LARGEST_STEERING = TURN + 0.01, TURN / 4 + 0.01

#: Package of the cost terms of which only `QuadraticInput` weighs all values of an input.
_OWN_TERMS = "gameinfer_ros.games.costs."


def warnings_about(vehicles: Vehicles, s: np.ndarray, costs: Sequence[CostTerm]) -> list[str]:
    """Return the warnings about a scenario. Each starts with the field, as in error messages.

    Args:
        vehicles: the vehicles of all players.
        s: initial joint state (ns,) of the vehicles.
        costs: cost terms.
    """
    found: list[str] = []
    for i, name in enumerate(vehicles.names):
        found += _large_angles(
            f"players.{name}.initial", vehicles.dynamics[i], s[vehicles.states(i)].tolist()
        )
    players = vehicles.game.players
    for j, term in enumerate(costs):
        if isinstance(term, Goal):
            for name, goal in term.goals.items():
                dynamics = players.dynamics[players.index(name)]
                found += _large_angles(f"costs[{j}].goals.{name}", dynamics, goal)
        elif isinstance(term, SoftBound):
            of_players = [players.dynamics[i] for i in term.players_in(players)]
            found += _bound_on_angle(f"costs[{j}]", term, of_players)
    for i in range(len(players)):
        found += _unweighed_inputs(players, i, costs)
    return found


def late_goals(costs: Sequence[CostTerm], steps: int, dt: float) -> list[str]:
    """Return warnings about goals that begin after the last state of a run."""
    end = steps * dt
    return [
        f"costs[{j}].active_from: the goal begins at {term.active_from:g} s, but the run ends at "
        f"{end:g} s, after {steps} steps: let the goal begin earlier, or play more steps"
        for j, term in enumerate(costs)
        if isinstance(term, Goal) and term.active_from > end + 1e-6 * dt  # the end may be rounded
    ]


def _unweighed_inputs(players: Players, i: int, costs: Sequence[CostTerm]) -> Iterator[str]:
    """Warn of inputs of player i that cost nothing, so that no input is the best one."""
    names = players.dynamics[i].input_names
    weights = np.zeros(len(names))
    for term in costs:
        if i not in term.players_in(players):
            continue
        if isinstance(term, QuadraticInput):
            weights += term.weights
        elif not type(term).__module__.startswith(_OWN_TERMS):
            return  # a term of the user may weigh any input
    free = [name for name, weight in zip(names, weights, strict=True) if weight == 0]
    if free:
        yield (
            f"players.{players.names[i]}: no cost weighs the input {' and '.join(free)}, so the "
            "game has no unique solution; the method iterative_lq uses input_regularisation as the "
            "weight, and newton may not converge: add a cost of kind quadratic_input"
        )


def _angle_names(dynamics: Dynamics) -> list[str]:
    """Names of the states that are angles, modulo a turn or not."""
    joint_angles = dynamics.joint_angles if isinstance(dynamics, Vehicle) else ()
    return [dynamics.state_names[i] for i in (*dynamics.angles, *joint_angles)]


def _large_angles(field: str, dynamics: Dynamics, state: Sequence[float]) -> Iterator[str]:
    """Warn of the angles of a state (n,) that look like degrees."""
    for name in _angle_names(dynamics):
        yield from _large_angle(field, name, state[dynamics.state_names.index(name)], [dynamics])


def _large_angle(
    field: str, name: str, value: float, of_players: Sequence[Dynamics]
) -> Iterator[str]:
    steers = name == "steering" and any(isinstance(d, Car) for d in of_players)
    most, words = (LARGEST_STEERING, "a quarter turn") if steers else (LARGEST_ANGLE, "a turn")
    if abs(value) > most:
        yield (
            f"{field}: {name} is {value:g} rad, more than {words}: are these degrees? Write angles "
            f"in rad: {value:g} degrees are {np.deg2rad(value):.6g} rad"
        )


def _bound_on_angle(field: str, term: SoftBound, of_players: list[Dynamics]) -> Iterator[str]:
    if not any(term.of in _angle_names(d) for d in of_players):
        return
    large = [
        *_large_angle(f"{field}.low", term.of, term.low, of_players),
        *_large_angle(f"{field}.high", term.of, term.high, of_players),
    ]
    yield from large
    modulo_a_turn = any(term.of in [d.state_names[i] for i in d.angles] for d in of_players)
    if modulo_a_turn and not large and term.high - term.low >= TURN:
        yield (
            f"{field}: the bounds of {term.of} are {term.high - term.low:g} rad apart: they have "
            "no effect, because angles count modulo a turn"
        )
