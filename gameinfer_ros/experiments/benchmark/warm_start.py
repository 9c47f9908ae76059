"""Warm starts from solved games."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
from typing_extensions import Self

from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import GameSolver, Solution, Strategy


class WarmStart(NamedTuple):
    """The starting point of an update at step 1."""

    strategy: Strategy  # of K particles, from step 0 on
    x: np.ndarray  # state (nx,) at step 1 that the first of them leads to

    @classmethod
    def of(cls, solution: Solution) -> Self:
        """Create a warm start from the converged strategies, or from all if none converged."""
        kept = np.flatnonzero(solution.converged)
        strategy = solution.strategy
        strategy = strategy.take(kept if len(kept) else np.arange(len(strategy)))
        return cls(strategy, strategy.x_ref[1, :, 0].copy())

    def of_particles(self, count: int) -> Self:
        """Return a warm start with `count` particles, repeating the particles as needed."""
        return self._replace(strategy=self.strategy.take(np.arange(count) % len(self.strategy)))

    def update(self, solver: GameSolver, iterations: int) -> Callable[[], Solution]:
        """Return a function that solves all particles in at most some iterations."""
        return partial(solver.solve, self.x, self.strategy, None, iterations, step=1)


def solver_of(scenario: Scenario, threads: int = 1) -> GameSolver:
    """Create a warmed-up solver with the given number of threads."""
    settings = scenario.solver.model_copy(update={"threads": threads})
    solver = GameSolver(scenario.game, settings)
    solver.warm_up()
    return solver


def seeds_of(scenario: Scenario, count: int) -> Strategy:
    """Draw initial strategies of `count` particles."""
    game = scenario.game
    u = scenario.seeds.sample(np.random.default_rng(0), game.players, game.horizon, count)
    return Strategy.from_inputs(0, scenario.initial_state, u)
