"""Solved games, and what they are solved again from."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import IterativeLQ, Solution, Strategy


class WarmStart(NamedTuple):
    """Strategies for step 0 on, and where one of them leads.

    Attributes:
        strategy: the strategies (of K particles).
        x: state (nx,) at step 1.
    """

    strategy: Strategy
    x: np.ndarray

    @classmethod
    def of(cls, solution: Solution) -> WarmStart:
        """Start from the converged strategies of a solution; from all if there are none."""
        kept = np.flatnonzero(solution.converged)
        strategy = solution.strategy
        strategy = strategy.take(kept if len(kept) else np.arange(len(strategy)))
        return cls(strategy, strategy.x_ref[1, :, 0].copy())

    def of_particles(self, count: int) -> WarmStart:
        """Start with this many particles: the same ones again and again."""
        return self._replace(strategy=self.strategy.take(np.arange(count) % len(self.strategy)))


def solver_of(scenario: Scenario, threads: int = 1) -> IterativeLQ:
    """A solver with so many threads that is ready to be measured."""
    settings = scenario.solver.model_copy(update={"threads": threads})
    solver = IterativeLQ(scenario.game, settings)
    solver.warm_up()
    return solver


def seeds_of(scenario: Scenario, count: int) -> Strategy:
    """The first strategies that a belief of so many particles starts from."""
    game = scenario.game
    u = scenario.seeds.sample(np.random.default_rng(0), game.players, game.horizon, count)
    return Strategy.from_inputs(0, scenario.initial_state, u)
