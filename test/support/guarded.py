"""Robots with a safety layer, and a simple simulation of the seconds ahead."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gameinfer_ros.games import (
    Car,
    DoubleIntegrator,
    Dynamics,
    FlatUnicycle,
    Game,
    Unicycle,
    Vehicles,
)
from gameinfer_ros.planning import SafePlan, SafetyFilter, SafetySettings

DT, CLEARANCE, LOOK_AHEAD = 0.1, 0.5, 1.0
#: By so much must a plan be better than braking for the robot not to brake, in m.
MARGIN = 0.1
ROBOTS: dict[str, tuple[Dynamics, dict[str, tuple[float, float]]]] = {
    "unicycle": (Unicycle(), {"omega": (-2.0, 2.0), "a": (-3.0, 2.0)}),
    "flat": (FlatUnicycle(), {"omega": (-2.0, 2.0), "a": (-3.0, 2.0)}),
    "car": (Car(wheelbase=0.5), {"steering_rate": (-1.0, 1.0), "a": (-3.0, 2.0)}),
    "double integrator": (DoubleIntegrator(), {"ax": (-3.0, 3.0), "ay": (-3.0, 3.0)}),
    "unicycle without limits": (Unicycle(), {}),
}
#: A robot that drives along x with a speed: its state, and the input that speeds it up.
ALONG = {
    "unicycle": lambda x, v: [x, 0.0, 0.0, v],
    "flat": lambda x, v: [x, 0.0, 0.0, v],
    "unicycle without limits": lambda x, v: [x, 0.0, 0.0, v],
    "car": lambda x, v: [x, 0.0, 0.0, v, 0.0],
    "double integrator": lambda x, v: [x, v, 0.0, 0.0],
}


def push(kind: str, a: float) -> list[float]:
    return [a, 0.0] if kind == "double integrator" else [0.0, a]


def speed_of(kind: str, s: np.ndarray) -> float:
    return float(s[1] if kind == "double integrator" else s[3])


def make(kind: str, people: int = 1) -> tuple[Vehicles, SafetyFilter]:
    """A robot among people who are unicycles."""
    dynamics, limits = ROBOTS[kind]
    others = {f"human_{j}": Unicycle() for j in range(people)}
    vehicles = Vehicles(Game({"robot": dynamics, **others}, [], DT, 5), {"robot": limits})
    return vehicles, SafetyFilter(vehicles, SafetySettings())


def rooms(
    vehicles: Vehicles,
    walks: Sequence[tuple[np.ndarray, np.ndarray]],
    after: float = 0.0,
    until: float = np.inf,
) -> np.ndarray:
    """Smallest distances between two times if the robot does some inputs, and then brakes.

    A walk is the joint state (ns,) where it starts, and the inputs (S, 2). By default it ends one
    look-ahead after the last input began. Everything is stepped fifty times as often.
    """
    fine = 50
    players = dict(zip(vehicles.names, vehicles.dynamics, strict=True))
    small = Game(players, [], DT / fine, 5)
    robot, found = vehicles.states(0), np.full(len(walks), np.inf)
    s = np.stack([start for start, _ in walks], axis=-1)
    ends = [min((len(inputs) - 1) * DT + LOOK_AHEAD, until) for _, inputs in walks]
    steps = np.round(np.array(ends) / DT).astype(int)
    for k in range(steps.max()):
        w = np.zeros((vehicles.n_inputs, len(walks)))  # people keep their speed and heading
        for walk, (_, inputs) in enumerate(walks):
            brake = vehicles.dynamics[0].braking_input(s[robot, walk], DT)
            doing = inputs[k] if k < len(inputs) else brake
            w[vehicles.inputs(0), walk] = np.clip(doing, vehicles.low[:2], vehicles.high[:2])
        for part in range(fine):
            s = small.step(s, w)
            if (k + (part + 1) / fine) * DT > after + 1e-9:
                nearest = vehicles.distances(s.T)[:, : len(vehicles) - 1].min(axis=1)
                found = np.where(k < steps, np.minimum(found, nearest), found)
    return found


def room(
    vehicles: Vehicles, s: np.ndarray, inputs: np.ndarray, after: float = 0.0, until: float = np.inf
) -> float:
    """The smallest distance of a single walk."""
    return float(rooms(vehicles, [(s, inputs)], after, until)[0])


def assert_goes_on_rightly(
    found: SafePlan, inputs: np.ndarray, braking: float, whole: float, off: float = 0.01
) -> None:
    assert braking < CLEARANCE + off
    assert whole > braking + MARGIN - 2 * off
    np.testing.assert_array_equal(found.inputs, inputs[:1])
    assert "the plan leaves" in found.reason
