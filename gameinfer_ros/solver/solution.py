"""Solutions of the solver."""

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
    SADDLE = 5
    GOOD_ENOUGH = 6


@dataclass(frozen=True)
class Solution:
    """Strategies of K particles, and how the solver found them.

    Attributes:
        strategy: local equilibria of the particles that converged. Of the others, the last
            strategies that could be rolled out: the initial ones if the status is `NOT_FINITE`.
            If it is `NOT_REACHED`, the initial ones with their initial trajectories. If it is
            `SADDLE`, all players are stationary, but not all at a minimum. If it is `GOOD_ENOUGH`,
            they are stationary enough for one step of a receding horizon; whether they are at
            minima is not tested.
        status: `Status` of each particle (K,).
        iterations: number of LQ games solved (K,).
        step_size: scale of the feed-forward terms in the last iteration (K,); nan if there was
            none.
        movement: largest change of a state component in the last iteration (K,).
        residual: largest residual of stationarity of a player, relative to the size of its terms
            (K,); nan if the method is `iterative_lq`, or if there was no iteration.
        pivot: curvature of each player's own problem (N, K), relative to its input cost: positive
            if the player is at a minimum, nan if that is unknown. The smallest one of the horizon,
            or else the last one that is not positive.
        pivot_step: number of steps from the first one to that of `pivot` (N, K).
    """

    strategy: Strategy
    status: np.ndarray
    iterations: np.ndarray
    step_size: np.ndarray
    movement: np.ndarray
    residual: np.ndarray
    pivot: np.ndarray
    pivot_step: np.ndarray

    @classmethod
    def unsolved(cls, strategy: Strategy, players: int) -> Solution:
        """Create the solution of particles that the solver has not reached."""
        K = len(strategy)
        return cls(
            strategy,
            status=np.full(K, Status.NOT_REACHED),
            iterations=np.zeros(K, dtype=int),
            step_size=np.full(K, np.nan),
            movement=np.zeros(K),
            residual=np.full(K, np.nan),
            pivot=np.full((players, K), np.nan),
            pivot_step=np.zeros((players, K), dtype=int),
        )

    @property
    def converged(self) -> np.ndarray:
        """Whether each particle converged (K,)."""
        return self.status == Status.CONVERGED

    @property
    def usable(self) -> np.ndarray:
        """Whether each particle converged or is good enough for one step (K,)."""
        return np.isin(self.status, (Status.CONVERGED, Status.GOOD_ENOUGH))

    def reason(self, particle: int) -> str:
        """Describe why the solver stopped on a particle."""
        n, moved = self.iterations[particle], self.movement[particle]
        status, residual = Status(self.status[particle]), self.residual[particle]
        if status is Status.SADDLE:
            i = int(np.argmin(self.pivot[:, particle] > 0.0))
            return (
                f"saddle: after iteration {n}, the residual is {residual:.3g}, but player {i} is "
                f"not at a minimum: at step {self.pivot_step[i, particle]}, the curvature of its "
                f"cost is {self.pivot[i, particle]:.3g} times that of its input cost"
            )
        if status is Status.GOOD_ENOUGH:
            return f"good enough for one step: after iteration {n}, the residual is {residual:.3g}"
        if status is Status.CONVERGED and np.isfinite(residual):
            return f"converged: after iteration {n}, the residual is {residual:.3g}"
        if status is Status.ITERATION_LIMIT and np.isfinite(residual):
            return f"iteration limit: after iteration {n}, the residual is {residual:.3g}"
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
