"""A player that sticks to one equilibrium."""

from __future__ import annotations

import numpy as np

from gameinfer_ros.inference import SeedDistribution
from gameinfer_ros.solver import IterativeLQ, RecedingHorizon, Strategy, brake


class EquilibriumPlayer:
    """Follows the equilibrium that one seed leads to, re-solved from each state it observes.

    All humans who use the same generator state agree on their equilibrium without a word. A robot
    that plays like this, with a seed of its own, is the baseline. Where no solution is known,
    neither a new one nor one of old whose horizon is not over, the player brakes.

    Args:
        solver: solver of the game that all play.
        seeds: distribution that the one seed is drawn from.
        rng: where the seed comes from.
    """

    def __init__(
        self, solver: IterativeLQ, seeds: SeedDistribution, rng: np.random.Generator
    ) -> None:
        self._game = game = solver.game
        self._ends = 0  # the first step that no converged strategy is known for
        self._equilibrium = RecedingHorizon(
            solver, seeds.sample(rng, game.players, game.horizon, 1)
        )

    @property
    def converged(self) -> bool:
        """Whether the newest strategy is a converged one."""
        return bool(self._equilibrium.converged[0])

    @property
    def iterations(self) -> int:
        """Iterations that the last solve took."""
        return int(self._equilibrium.iterations[0])

    def solve(self, step: int, x: np.ndarray) -> Strategy:
        """Strategies (of one particle) of all players from the state `x` (nx,) at `step`."""
        strategy = self._equilibrium.solve(step, x)
        if self.converged:
            self._ends = strategy.end
        # A strategy of old may lead nowhere from a state that nobody expected.
        known = step < self._ends and strategy.finite.all()
        return strategy if known else brake(self._game, step, x)
