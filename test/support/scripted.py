"""Solvers that fail as they are told to, and remember their calls."""

from __future__ import annotations

from typing import Any

import numpy as np
from solving import PAPER

from gameinfer_ros.games import Game
from gameinfer_ros.solver import GameSolver, Solution, SolverSettings, Status, Strategy


class Scripted(GameSolver):
    """Is told which particles do not converge in each of the next calls."""

    def __init__(self, game: Game, settings: SolverSettings | None = None) -> None:
        super().__init__(game, settings or PAPER)
        self.failures: list[list[int]] = []
        self.calls: list[Strategy] = []
        self.bounds: list[tuple[Any, ...]] = []

    def solve(self, x0: np.ndarray, initial: Strategy, *more: Any, **how: Any) -> Solution:
        later = len(more) == 4 and more[3] > initial.first_step
        self.calls.append(initial.advanced(more[3]) if later else initial)
        self.bounds.append(more[:3])
        solution = super().solve(x0, initial, *more, **how)
        for k in self.failures.pop(0) if self.failures else []:
            solution.status[k] = Status.LINE_SEARCH_FAILED
        return solution


class Fickle(GameSolver):
    """Is told which particles it does not find, until it is told otherwise."""

    def __init__(self, game: Game) -> None:
        super().__init__(game, PAPER)
        self.failures: dict[int, Status] = {}
        self.orders: list[Any] = []

    def fail(self, particles: int) -> None:
        """Find none of the first particles."""
        self.failures = dict.fromkeys(range(particles), Status.LINE_SEARCH_FAILED)

    def solve(
        self, x0: np.ndarray, initial: Strategy, order: Any = None, *more: Any, **how: Any
    ) -> Solution:
        self.orders.append(order)
        solution = super().solve(x0, initial, order, *more, **how)
        for k, status in self.failures.items():
            if k < len(initial):
                solution.status[k] = status
                if status == Status.NOT_REACHED:  # it keeps what it had
                    solution.strategy.assign(k, initial, k)
        return solution
