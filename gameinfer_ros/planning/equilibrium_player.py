"""A player that sticks to one equilibrium."""

from __future__ import annotations

import numpy as np

from gameinfer_ros.inference import SeedDistribution
from gameinfer_ros.solver import Equilibria, IterativeLQ, RecedingHorizon, Strategy, brake


class EquilibriumPlayer:
    """Follows the equilibrium that one seed leads to, re-solved from each state it observes.

    All humans with the same generator state agree on their equilibrium. A robot that plays like
    this, with a seed of its own, is the baseline. The player brakes if it has no solution: neither
    a new one nor an earlier one whose horizon has not ended.

    Args:
        solver: solver of the game that all play.
        seeds: distribution that the one seed is drawn from.
        rng: where the seed comes from.

    Attributes:
        brakes: whether the last strategy only brakes, because there is no solution.
    """

    def __init__(
        self, solver: IterativeLQ, seeds: SeedDistribution, rng: np.random.Generator
    ) -> None:
        self._game = game = solver.game
        self._horizon = RecedingHorizon(solver)
        self._equilibrium = Equilibria.from_seeds(seeds.sample(rng, game.players, game.horizon, 1))
        self._ends = 0  # the first step that no converged strategy is known for
        self.brakes = False

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
        self._equilibrium = self._horizon.solve(self._equilibrium, step, x)
        strategy = self._equilibrium.strategy
        assert strategy is not None
        if self.converged:
            self._ends = strategy.end
        # An earlier strategy may lead nowhere from a state that it did not expect.
        self.brakes = step >= self._ends or not strategy.finite.all()
        return brake(self._game, step, x) if self.brakes else strategy
