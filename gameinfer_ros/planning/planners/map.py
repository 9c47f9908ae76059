"""Align with the most likely equilibrium."""

from __future__ import annotations

import numpy as np
from typing_extensions import override

from gameinfer_ros.inference import Belief
from gameinfer_ros.planning.planner import Planner
from gameinfer_ros.solver import Strategy


class MapPlanner(Planner):
    """Plays the MAP equilibrium (Peters et al. 2020, algorithm 1)."""

    kind = "map"

    @override
    def strategy(self, belief: Belief | None, step: int, x: np.ndarray) -> Strategy:
        assert belief is not None
        equilibrium = belief.equilibrium
        self.particle = equilibrium.particle
        return equilibrium.strategy
