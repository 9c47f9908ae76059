"""A solver that fails as it is told to, and what its strategies are compared by."""

from __future__ import annotations

from typing import Any

import numpy as np

from gameinfer_ros.games import Game
from gameinfer_ros.solver import (
    IterativeLQ,
    Solution,
    SolverSettings,
    Status,
    Strategy,
)


class Scripted(IterativeLQ):
    """A solver that is told which of its particles do not converge, and remembers its calls."""

    def __init__(self, game: Game, settings: SolverSettings | None = None) -> None:
        super().__init__(game, settings)
        self.failures: list[list[int]] = []
        self.calls: list[Strategy] = []
        self.bounds: list[tuple[Any, ...]] = []

    def solve(self, x0: np.ndarray, initial: Strategy, *more: Any) -> Solution:
        later = len(more) == 4 and more[3] > initial.first_step
        self.calls.append(initial.advanced(more[3]) if later else initial)
        self.bounds.append(more[:3])
        solution = super().solve(x0, initial, *more)
        for k in self.failures.pop(0) if self.failures else []:
            solution.status[k] = Status.LINE_SEARCH_FAILED
        return solution


def check_same(one: Strategy, other: Strategy, k: int, k_other: int) -> None:
    assert one.first_step == other.first_step
    np.testing.assert_array_equal(one.x_ref[..., k], other.x_ref[..., k_other])
    np.testing.assert_array_equal(one.u_ref[..., k], other.u_ref[..., k_other])
    np.testing.assert_array_equal(one.P[..., k], other.P[..., k_other])
