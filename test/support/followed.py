"""Equilibria that are followed as time goes on."""

from __future__ import annotations

from typing import Any

import numpy as np

from gameinfer_ros.solver import Equilibria, GameSolver, RecedingHorizon, Strategy


class Followed:
    """Equilibria with the receding horizon that re-solves them; has the attributes of both."""

    def __init__(self, solver: GameSolver, seeds: np.ndarray, patience: int | None = None) -> None:
        self._horizon = RecedingHorizon(solver, patience)
        self.equilibria = Equilibria.from_seeds(seeds)

    def __len__(self) -> int:
        return len(self.equilibria)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.equilibria, name)

    def solve(self, step: int, x: np.ndarray, *bounds: Any, **more_bounds: Any) -> Strategy:
        self.equilibria = self._horizon.solve(self.equilibria, step, x, *bounds, **more_bounds)
        return self.equilibria.strategy

    def take(self, index: np.ndarray | list[int]) -> None:
        self.equilibria = self.equilibria.take(index)
