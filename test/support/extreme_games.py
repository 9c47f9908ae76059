"""Random games, ordinary and extreme ones."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gameinfer_ros.games import (
    Car,
    CostTerm,
    DoubleIntegrator,
    Dynamics,
    FlatUnicycle,
    Game,
    Goal,
    Obstacle,
    Proximity,
    QuadraticInput,
    QuadraticState,
    RoadLane,
    SoftBound,
    Unicycle,
)
from gameinfer_ros.solver import SolverSettings, Strategy

#: Classes of games, and what is extreme in each; docs/robustness.md shows this table.
CLASSES = {
    "ordinary": "nothing",
    "tiny weights": "all weights are 1e-6",
    "huge weights": "all weights are 1e6",
    "mixed weights": "weights from 1e-6 to 1e6",
    "zero weights": "all weights are 0",
    "no costs": "there is no cost term",
    "one place": "all players start at one place, in the middle of an obstacle",
    "one goal": "all players have one goal, and want to be at rest there at each step",
    "huge speeds": "speeds from 1e2 to 1e6 m/s",
    "far away": "positions up to 1e6 m from all goals",
    "overflow": "positions and speeds up to 1e300",
    "horizon of 1": "there is one step",
    "no regularisation": "the solver adds nothing to the Hessians",
    "tiny steps": "time steps of 1 ms",
    "long steps": "time steps of 10 s",
    "garbage": "warm starts are strategies of random numbers up to 1e6",
    "not finite": "some numbers of warm starts are nan or infinite",
}


class Case(NamedTuple):
    """A game to solve.

    Attributes:
        game: the game.
        settings: settings of the solver.
        x0: initial state (nx,).
        initial: initial strategies of all particles.
    """

    game: Game
    settings: SolverSettings
    x0: np.ndarray
    initial: Strategy


def draw(kind: str, rng: np.random.Generator, particles: int) -> Case:
    """Draw a game of one to five players, with all kinds of dynamics and cost terms.

    Args:
        kind: name of one of the `CLASSES`.
        rng: random generator.
        particles: number of initial strategies.
    """
    dynamics = _players(rng)
    horizon = 1 if kind == "horizon of 1" else int(rng.integers(2, 13))
    dt = {"tiny steps": 1e-3, "long steps": 10.0}.get(kind, 0.1)
    costs = [] if kind == "no costs" else _costs(kind, rng, dynamics, dt * horizon)
    game = Game(dynamics, costs, dt, horizon)
    x0 = np.concatenate([_start(kind, rng, model) for model in dynamics.values()])
    settings = SolverSettings(
        max_iterations=int(rng.integers(1, 41)),
        first_step_size=float(rng.choice([0.1, 0.5, 1.0])),
        max_movement=float(rng.choice([0.1, 1.5, 100.0])),
    )
    if kind == "no regularisation":
        nothing = {"state_regularisation": 0.0, "input_regularisation": 0.0}
        settings = settings.model_copy(update=nothing)
    return Case(game, settings, x0, _initial(kind, rng, game, x0, particles))


def _players(rng: np.random.Generator) -> dict[str, Dynamics]:
    players: dict[str, Dynamics] = {}
    for i in range(int(rng.integers(1, 6))):
        car = Car(wheelbase=float(10 ** rng.uniform(-2, 1)))
        kinds = (Unicycle(), DoubleIntegrator(), FlatUnicycle(), car)
        players[f"player_{i}"] = kinds[rng.integers(len(kinds))]
    return players


def _costs(
    kind: str, rng: np.random.Generator, dynamics: dict[str, Dynamics], duration: float
) -> list[CostTerm]:
    """Draw terms of all kinds, each with a probability of 2/3."""

    def weight() -> float:
        fixed = {"tiny weights": 1e-6, "huge weights": 1e6, "zero weights": 0.0}
        spread = (-6.0, 6.0) if kind == "mixed weights" else (0.0, 2.5)
        return fixed.get(kind, float(10 ** rng.uniform(*spread)))

    def point(size: float = 3.0) -> tuple[float, float]:
        return float(rng.uniform(-size, size)), float(rng.uniform(-size, size))

    centre = (0.0, 0.0) if kind == "one place" else point()
    terms: list[CostTerm] = [
        QuadraticInput(weights=(weight(), weight())),
        Proximity(radius=float(10 ** rng.uniform(-1, 1)), weight=weight()),
        Obstacle(center=centre, radius=1.0, weight=weight()),
        RoadLane(points=(point(), point(), point()), half_width=0.3, weight=weight()),
    ]
    for name, model in dynamics.items():
        n, own, bound = model.n_states, (name,), float(rng.uniform(0, 2))
        goal, since = rng.uniform(-3, 3, n), float(rng.uniform(0, duration))
        if kind == "one goal":
            goal, since = np.zeros(n), 0.0
        of = str(rng.choice([*model.state_names, *model.input_names]))
        by_state = [tuple(weight() for _ in range(n)) for _ in range(2)]
        goals = {name: tuple(goal.tolist())}
        terms += [
            QuadraticState(weights=by_state[0], players=own),
            Goal(weights=by_state[1], goals=goals, active_from=since, players=own),
            SoftBound(of=of, low=-bound, high=bound, weight=weight(), players=own),
        ]
    return [term for term in terms if rng.random() < 2 / 3]


def _start(kind: str, rng: np.random.Generator, model: Dynamics) -> np.ndarray:
    """Draw the initial state (n,) of a player in the game."""
    x = rng.uniform(-1, 1, model.n_states)
    position = list(model.position)
    moving = [j for j, name in enumerate(model.state_names) if name.startswith("v")]
    x[position] *= 3.0
    if kind == "one place":
        x[position] = 0.0
    if kind == "far away":
        x[position] *= 10 ** rng.uniform(2, 6)
    if kind == "huge speeds":
        x[moving] *= 10 ** rng.uniform(2, 6)
    if kind == "overflow":
        x[position + moving] *= 10 ** rng.uniform(6, 300)
    return x


def _initial(
    kind: str, rng: np.random.Generator, game: Game, x0: np.ndarray, particles: int
) -> Strategy:
    T, nu = game.horizon, game.players.n_inputs
    size = 10 ** rng.uniform(-2, 1, particles)
    strategy = Strategy.from_inputs(0, x0, size * rng.normal(size=(T, nu, particles)))
    if kind in ("garbage", "not finite"):
        size = 10 ** rng.uniform(-3, 6, particles)
        for array in strategy.arrays:
            array[:] = size * rng.normal(size=array.shape)
    if kind == "not finite":
        for k in range(particles):
            array = strategy.arrays[rng.integers(3)][..., k]
            bad = rng.integers(array.size, size=int(rng.integers(0, 3)))
            array.reshape(-1)[bad] = rng.choice([np.nan, np.inf, -np.inf])
    return strategy
