"""The method `iterative_lq`: LQ games, whose steps are damped, until these move little."""

from __future__ import annotations

from itertools import islice
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from gameinfer_ros.solver.settings import SolverSettings
from gameinfer_ros.solver.solution import Status
from gameinfer_ros.solver.task import Task

if TYPE_CHECKING:
    from gameinfer_ros.solver.batch import Batch


class LQSearch:
    """Finds trajectories that an iteration hardly moves.

    Each iteration approximates the game along the last trajectory by an LQ game and solves that
    for its feedback Nash strategies. A line search scales their feed-forward terms down until the
    new trajectory stays close to the last one (Fridovich-Keil et al., "Efficient Iterative
    Linear-Quadratic Approximations for Nonlinear Multi-Player General-Sum Differential Games",
    ICRA 2020).

    Threads share one search for each call of the solver; each particle is in one thread at a time.

    Args:
        task: what to solve. The search writes to its solution.
        settings: settings of the solver.
    """

    def __init__(self, task: Task, settings: SolverSettings) -> None:
        self._task, self._settings = task, settings

    def work(self, batch: Batch) -> None:
        """Solve waiting particles until there are none, or until the deadline."""
        task, settings = self._task, self._settings
        solution, status = task.solution, task.solution.status
        particles = np.full(len(batch.moved), -1)  # the particle in each lane; -1: free
        late = perf_counter() >= task.deadline
        while True:
            if not late:
                self._fill(batch, particles)
            lanes = np.flatnonzero(particles >= 0)
            if not len(lanes):
                return
            batch.iterate(task.first_step, lanes)
            now, moved, step_size = particles[lanes], batch.moved[lanes], batch.scale[lanes]
            solution.iterations[now] += 1
            solution.movement[now], solution.step_size[now] = moved, step_size
            status[now[settings.converged(step_size, moved)]] = Status.CONVERGED
            status[now[~(moved <= settings.max_movement)]] = Status.LINE_SEARCH_FAILED
            status[now[~batch.solvable()[lanes]]] = Status.NOT_FINITE
            done = status[now] != Status.ITERATION_LIMIT
            done |= solution.iterations[now] == task.limits[now]
            late = perf_counter() >= task.deadline
            done |= late
            finite = done & (status[now] != Status.NOT_FINITE)
            batch.store(lanes[finite], task.found, now[finite])
            particles[lanes[done]] = -1

    def _fill(self, batch: Batch, particles: np.ndarray) -> None:
        """Load waiting particles into free lanes, until either run out; updates `particles`."""
        while True:
            free = np.flatnonzero(particles < 0)
            taken = list(islice(self._task.waiting, len(free)))
            if not taken:
                return
            lanes = free[: len(taken)]
            particles[lanes] = taken
            self._task.play_out(batch, lanes, particles)
