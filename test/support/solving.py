"""Solving games in tests."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from gameinfer_ros.games import Game
from gameinfer_ros.solver import GameSolver, Solution, SolverSettings, Strategy, reference

GameFactory = Callable[..., Game]
Start = Callable[[Game], np.ndarray]

HeadOn = Callable[..., tuple[Game, np.ndarray]]


def paper(**settings: Any) -> SolverSettings:
    """The settings of the paper, apart from these."""
    return SolverSettings(**{"method": "iterative_lq"} | settings)


PAPER = paper()


def random_inputs(game: Game, count: int, size: float = 0.3, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    shape = np.cos(np.pi * np.arange(game.horizon) / game.horizon)
    return shape[:, None, None] * rng.uniform(-size, size, (game.players.n_inputs, count))


def solve(
    game: Game, x0: np.ndarray, u: np.ndarray, first_step: int = 0, **settings: Any
) -> Solution:
    """Solve a game by the iterations of the paper, with these settings."""
    solver = GameSolver(game, paper(**settings))
    return solver.solve(x0, Strategy.from_inputs(first_step, x0, u))


def check_against_reference(game: Game, x0: np.ndarray, u: np.ndarray, **settings: Any) -> int:
    """Compare every particle that rounding errors do not carry elsewhere; return their number."""
    compiled = solve(game, x0, u, **settings)
    compared = 0
    for k in range(u.shape[2]):
        one = reference.solve(game, x0, u[..., k], paper(**settings))
        other = reference.solve(game, x0, u[..., k] * (1 + 1e-14), paper(**settings))
        # Some seeds pass close to where the Riccati recursion is singular, and there amplify a
        # rounding error to centimetres: no two implementations can agree on these.
        if one.iterations != other.iterations or np.abs(one.x - other.x).max() > 3e-7:
            continue
        compared += 1
        assert compiled.status[k] == one.status
        assert compiled.iterations[k] == one.iterations
        for mine, theirs in zip(compiled.strategy.arrays, (one.x, one.u, one.P), strict=True):
            np.testing.assert_allclose(mine[..., k], theirs, rtol=0, atol=1e-6)
    return compared
