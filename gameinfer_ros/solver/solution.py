"""Solutions of the iterative LQ solver."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from gameinfer_ros.solver.strategy import Strategy


class Status(IntEnum):
    """Why the solver stopped on a particle."""

    CONVERGED = 0
    ITERATION_LIMIT = 1
    LINE_SEARCH_FAILED = 2
    NOT_FINITE = 3
    NOT_REACHED = 4


@dataclass(frozen=True)
class Solution:
    """Strategies of K particles, and how the solver found them.

    Attributes:
        strategy: local equilibria of the particles that converged. Of the others, the last
            strategies that could be rolled out: the initial ones if the status is `NOT_FINITE`.
            If it is `NOT_REACHED`, the initial ones with their initial trajectories.
        status: `Status` of each particle (K,).
        iterations: number of LQ games solved (K,).
        step_size: scale of the feed-forward terms in the last iteration (K,); nan if there was
            none.
        movement: largest change of a state component in the last iteration (K,).
    """

    strategy: Strategy
    status: np.ndarray
    iterations: np.ndarray
    step_size: np.ndarray
    movement: np.ndarray

    @property
    def converged(self) -> np.ndarray:
        """Whether each particle converged (K,)."""
        return self.status == Status.CONVERGED

    def reason(self, particle: int) -> str:
        """Describe why the solver stopped on a particle."""
        n, moved = self.iterations[particle], self.movement[particle]
        status = Status(self.status[particle])
        if status is Status.CONVERGED:
            return f"converged: iteration {n} moved no state component by more than {moved:.3g}"
        if status is Status.ITERATION_LIMIT:
            return f"iteration limit: iteration {n} still moved a state component by {moved:.3g}"
        if status is Status.LINE_SEARCH_FAILED:
            return (
                f"line search failed: in iteration {n}, even the smallest step moved a state "
                f"component by {moved:.3g}"
            )
        if status is Status.NOT_REACHED:
            return "not reached: the deadline came before the first iteration"
        return f"not finite: iteration {n} gave strategies or states that are not numbers"
