"""Follow one equilibrium drawn at random."""

from __future__ import annotations

import numpy as np
from typing_extensions import override

from gameinfer_ros.inference import NO_PARTICLE, Belief, SeedDistribution
from gameinfer_ros.planning.equilibrium_player import EquilibriumPlayer
from gameinfer_ros.planning.planner import Planner
from gameinfer_ros.solver import GameSolver, Strategy


class BaselinePlanner(Planner):
    """Plays the equilibrium of one seed and ignores the belief, as the humans do."""

    kind = "baseline"
    needs_belief = False

    def __init__(
        self, solver: GameSolver, seeds: SeedDistribution, rng: np.random.Generator
    ) -> None:
        super().__init__(solver, seeds, rng)
        self._player = EquilibriumPlayer(solver, seeds, rng)

    @override
    def strategy(self, belief: Belief | None, step: int, x: np.ndarray) -> Strategy:
        strategy = self._player.solve(step, x)
        self.particle = NO_PARTICLE if self._player.brakes else 0
        return strategy
