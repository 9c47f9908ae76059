"""Fixtures of the solver's tests."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from followed import Followed
from scripted import Scripted
from solving import GameFactory, HeadOn, Start

from gameinfer_ros.games import (
    CostTerm,
    Dynamics,
    Game,
    Goal,
    Proximity,
    QuadraticInput,
    Unicycle,
)
from gameinfer_ros.lanes.blocks import from_blocks, in_blocks
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import GameSolver, Solution, SolverSettings, Strategy
from gameinfer_ros.solver.kernels import Workspace
from gameinfer_ros.solver.kernels import lq_pass as compiled_lq_pass

LqPass = Callable[..., tuple[np.ndarray, np.ndarray]]


@pytest.fixture(scope="session")
def lq_pass() -> LqPass:
    """The compiled LQ pass on any number of particles: P (T, nu, nx, K), alpha (T, nu, K)."""

    def run(
        game: Game, settings: SolverSettings, x: np.ndarray, u: np.ndarray, first_step: int
    ) -> tuple[np.ndarray, np.ndarray]:
        x_blocks, u_blocks = in_blocks(x), in_blocks(u)
        count, T, nu, width = u_blocks.shape
        kernels = game.kernels(width)
        workspace = Workspace.of(kernels)
        for name, memory in workspace._asdict().items():
            memory[:] = 0.0 if name == "no_input" else np.nan
        P = np.full((count, T, nu, x.shape[1], width), np.nan)
        alpha = np.full((count, T, nu, width), np.nan)
        for b in range(count):
            compiled_lq_pass(
                kernels, kernels.quadraticise, x_blocks[b], u_blocks[b], first_step,
                settings.state_regularisation, settings.input_regularisation,
                P[b], alpha[b], workspace,
            )  # fmt: skip
        return from_blocks(P, x.shape[2]), from_blocks(alpha, x.shape[2])

    return run


@pytest.fixture(scope="session")
def solution_of() -> Callable[..., Solution]:
    """The solution that `count` seeds lead to from the start of a scenario."""
    found: dict[int, Solution] = {}

    def solve(scenario: Scenario, count: int = 256) -> Solution:
        if id(scenario) not in found:
            rng, x0 = np.random.default_rng(0), scenario.initial_state
            u = scenario.seeds.sample(rng, scenario.game.players, scenario.horizon, count)
            initial = Strategy.from_inputs(0, x0, u)
            found[id(scenario)] = GameSolver(scenario.game, scenario.solver).solve(x0, initial)
        return found[id(scenario)]

    return solve


@pytest.fixture
def game(make_game: GameFactory) -> Game:
    return make_game("ud")


@pytest.fixture
def seeds(game: Game) -> np.ndarray:
    rng = np.random.default_rng(0)
    return np.ones((game.horizon, 1, 1)) * rng.uniform(-0.2, 0.2, (game.players.n_inputs, 3))


@pytest.fixture
def solver(game: Game) -> Scripted:
    return Scripted(game)


@pytest.fixture
def x0(game: Game, start: Start) -> np.ndarray:
    return start(game)


@pytest.fixture
def unsolved(solver: Scripted, seeds: np.ndarray) -> Followed:
    """A receding horizon."""
    return Followed(solver, seeds)


@pytest.fixture
def horizon(unsolved: Followed, x0: np.ndarray) -> Followed:
    """A receding horizon that has been solved at step 0."""
    unsolved.solve(0, x0)
    return unsolved


@pytest.fixture
def head_on() -> HeadOn:
    """Two unicycles that face each other and want to change places, and their initial state.

    `scale` multiplies all costs, `metre` is the length of a metre in the unit of the game, and
    `names` are the players in the order of the game.
    """

    def make(
        horizon: int = 20, scale: float = 1.0, metre: float = 1.0, names: str = "ab"
    ) -> tuple[Game, np.ndarray]:
        dynamics: dict[str, Dynamics] = {name: Unicycle() for name in names}
        per_square = scale / metre**2
        starts = {"a": (-1.5 * metre, 0.0, 0.0), "b": (1.5 * metre, 0.0, np.pi)}
        goals = {name: (-x, y, theta, 0.0) for name, (x, y, theta) in starts.items()}
        costs: list[CostTerm] = [
            QuadraticInput(weights=(scale, per_square)),
            Proximity(radius=1.0 * metre, weight=50.0 * per_square),
            Goal(
                weights=(20.0 * per_square, 20.0 * per_square, scale, 20.0 * per_square),
                goals=goals,
                active_from=0.0,
            ),
        ]
        x0 = np.array([(*starts[name], 0.5 * metre) for name in names]).ravel()
        return Game(dynamics, costs, 3.0 / horizon, horizon), x0

    return make
