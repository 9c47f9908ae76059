"""A player that follows one equilibrium throughout."""

from __future__ import annotations

import numpy as np

from gameinfer_ros.inference import SeedDistribution
from gameinfer_ros.solver import Equilibria, GameSolver, RecedingHorizon, Strategy, brake


class EquilibriumPlayer:
    """A player that follows one equilibrium, re-solved in receding horizon.

    The player draws one seed and re-solves its equilibrium from each observed state. Humans whose
    generators are in the same state agree on one equilibrium. A robot with a seed of its own is
    the baseline.

    If a solve does not converge, the player keeps its last strategy until the horizon of the last
    converged one ends. Then it brakes.

    Args:
        solver: solver of the game.
        seeds: distribution of the seed.
        rng: generator that draws the seed.

    Attributes:
        brakes: whether the last call of `solve` returned a braking strategy.
    """

    def __init__(
        self, solver: GameSolver, seeds: SeedDistribution, rng: np.random.Generator
    ) -> None:
        self._game = game = solver.game
        self._horizon = RecedingHorizon(solver)
        self._equilibrium = Equilibria.from_seeds(seeds.sample(rng, game.players, game.horizon, 1))
        self._end = 0  # end of the horizon of the last converged strategy
        self.brakes = False

    @property
    def converged(self) -> bool:
        """Whether the last solve converged."""
        return bool(self._equilibrium.converged[0])

    @property
    def iterations(self) -> int:
        """Number of iterations of the last solve."""
        return int(self._equilibrium.iterations[0])

    def solve(self, step: int, x: np.ndarray) -> Strategy:
        """Re-solve the equilibrium from a state.

        Args:
            step: step of `x`; not earlier than that of the last call.
            x: joint state (nx,).

        Returns:
            Strategies (of one particle) of all players from `step` on.

        Raises:
            ValueError: `step` is earlier than that of the last call, or `x` does not fit the game.
        """
        self._equilibrium = self._horizon.solve(self._equilibrium, step, x)
        strategy = self._equilibrium.strategy
        assert strategy is not None
        if self.converged:
            self._end = strategy.end
        # From a state that it does not predict, an earlier strategy may diverge.
        self.brakes = step >= self._end or not strategy.finite.all()
        return brake(self._game, step, x) if self.brakes else strategy
