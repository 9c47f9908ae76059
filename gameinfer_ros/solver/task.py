"""A call of the solver, shared by the threads that work on it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gameinfer_ros.solver.solution import Solution, Status
from gameinfer_ros.solver.strategy import FlatArrays

if TYPE_CHECKING:
    from gameinfer_ros.solver.batch import Batch


class Task(NamedTuple):
    """A call of `GameSolver.solve`.

    Attributes:
        x0: state (nx,) from which to solve.
        initial: arrays of the initial strategies; see `Strategy.flat`.
        skipped: steps of the initial strategies before those of the solution.
        waiting: particles that no thread has taken.
        limits: maximum number of iterations of each particle (K,).
        deadline: value of `time.perf_counter()` after which no iteration starts.
        for_one_step: whether warm starts need only be good enough for one step.
        solution: solution, to whose arrays the threads write.
    """

    x0: np.ndarray
    initial: FlatArrays
    skipped: int
    waiting: Iterator[int]
    limits: np.ndarray
    deadline: float
    for_one_step: bool
    solution: Solution

    @property
    def first_step(self) -> int:
        """The step at which the horizon starts."""
        return self.solution.strategy.first_step

    @property
    def found(self) -> FlatArrays:
        """Arrays of the strategies of the solution."""
        return self.solution.strategy.flat

    def play_out(self, batch: Batch, lanes: np.ndarray, particles: np.ndarray) -> None:
        """Load particles into lanes, and roll out their initial strategies.

        Those whose states are not finite are finished, and their lanes become free.

        Args:
            batch: the batch.
            lanes: the lanes.
            particles: the particle in each lane of the batch; -1: free. Updated.
        """
        batch.load(lanes, self.initial, particles[lanes], self.skipped)
        batch.play_out(self.x0, lanes)
        finite = np.isfinite(batch.moved[lanes])
        self.solution.status[particles[lanes]] = np.where(
            finite, Status.ITERATION_LIMIT, Status.NOT_FINITE
        )
        particles[lanes[~finite]] = -1
