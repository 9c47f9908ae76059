"""The method `newton`: LQ games first, then Newton's method, and away from saddles."""

from __future__ import annotations

from collections import deque
from itertools import islice
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from gameinfer_ros.solver.settings import SolverSettings
from gameinfer_ros.solver.solution import Status
from gameinfer_ros.solver.task import Task

if TYPE_CHECKING:
    from gameinfer_ros.solver.newton_batch import NewtonBatch

#: Residual below which the gains are kept, and Newton steps begin.
_NEWTON_BELOW = 0.5

#: Maximum number of Newton steps in a row.
_NEWTON_STEPS = 16

#: Number of LQ games after the first failure of Newton's method; it doubles with each one.
_PATIENCE = 5

#: The next attempt begins earlier if the residual is below this share of that at the last one.
_PROGRESS = 0.1

#: Decreases of a player's cost, as a share of it, with which a particle leaves a saddle.
_ESCAPES = np.array([0.001, -0.01, 0.1])


class NewtonSearch:
    """Finds trajectories at which all players are stationary, and at a minimum.

    (1) Iterations of LQ games with Gauss-Newton Hessians, whose steps adapt, lead near an
    equilibrium. They need not converge: their gains jump where a cost term begins to act.
    (2) Therefore, the gains are kept from there on, and Newton's method makes all players
    stationary. Where it fails, (1) resumes. (3) A player that is not at a minimum is moved along
    its negative curvature, and (1) resumes.

    Threads share one search for each call of the solver; each particle is in one thread at a time.

    Args:
        task: what to solve. The search writes to its solution.
        settings: settings of the solver.
    """

    def __init__(self, task: Task, settings: SolverSettings) -> None:
        K = len(task.solution.status)
        self._task, self._settings = task, settings
        self._resuming: deque[int] = deque()  # particles for LQ games that have begun
        self._near: deque[int] = deque()  # particles for Newton steps
        self._stationary: deque[int] = deque()  # particles that may be at saddles
        self._lq_games = np.zeros(K, dtype=int)  # since the last resumption
        self._attempts, self._steps = np.zeros((2, K), dtype=int)  # of Newton's method
        self._tried = np.zeros(K)  # residual at the last attempt
        self._escapes = np.zeros(K, dtype=int)

    def work(self, batch: NewtonBatch) -> None:
        """Solve particles until none is left, or until the deadline."""
        worked = True
        while worked:
            worked = self._iterate_lq_games(batch)
            worked |= self._iterate_newton(batch)
            worked |= self._classify(batch)

    def _iterate_lq_games(self, batch: NewtonBatch) -> bool:
        """Iterate LQ games until no particle needs them; return whether any did."""
        task, solution = self._task, self._task.solution
        particles = np.full(len(batch.moved), -1)  # the particle in each lane; -1: free
        worked = False
        while True:
            if not self._late:
                self._fill(batch, particles)
            lanes = np.flatnonzero(particles >= 0)
            if not len(lanes):
                return worked
            worked = True
            batch.solve_lq_games(task.first_step)
            now, residual = particles[lanes], batch.residual[lanes]
            solution.iterations[now] += 1
            self._lq_games[now] += 1
            solution.residual[now] = residual
            solution.status[now[~batch.solvable()[lanes]]] = Status.NOT_FINITE
            near = (residual <= _NEWTON_BELOW) & (self._lq_games[now] > self._patience(now))
            near |= residual <= _PROGRESS * self._tried[now]
            near |= residual <= self._settings.tolerance
            near &= solution.status[now] == Status.ITERATION_LIMIT
            stopped = (solution.status[now] != Status.ITERATION_LIMIT) | self._exhausted(now)
            stopped &= ~(residual <= self._settings.tolerance)
            on = ~near & ~stopped
            failed = lanes[on][~batch.step_towards_lq_games(lanes[on])[lanes[on]]]
            solution.status[particles[failed]] = Status.LINE_SEARCH_FAILED
            solution.step_size[now], solution.movement[now] = batch.scale[lanes], batch.moved[lanes]
            leaving = near | stopped | np.isin(lanes, failed)
            self._store(batch, lanes[leaving], now[leaving])
            particles[lanes[leaving]] = -1
            self._tried[now[near]] = residual[near]
            self._attempts[now[near]] += 1
            self._steps[now[near]] = 0
            self._near.extend(now[near & ~stopped].tolist())

    def _iterate_newton(self, batch: NewtonBatch) -> bool:
        """Take Newton steps until no particle needs them; return whether any did."""
        task, solution = self._task, self._task.solution
        particles = np.full(len(batch.moved), -1)
        worked = False
        while True:
            if not self._late and self._load(batch, particles, self._near):
                batch.find_residuals(task.first_step)
            lanes = np.flatnonzero(particles >= 0)
            if not len(lanes):
                return worked
            worked = True
            now, residual = particles[lanes], batch.residual[lanes]
            solution.residual[now] = residual
            converged = residual <= self._settings.tolerance
            ended = ~converged & self._exhausted(now)
            failed = ~converged & ~ended & (self._steps[now] >= _NEWTON_STEPS)
            stepping = ~converged & ~ended & ~failed
            if stepping.any():
                decreased = batch.step_by_newton(task.first_step, lanes[stepping])[lanes]
                solution.iterations[now[stepping]] += 1
                self._steps[now[stepping]] += 1
                failed |= stepping & ~decreased
            leaving = converged | ended | failed
            self._store(batch, lanes[leaving], now[leaving])
            particles[lanes[leaving]] = -1
            self._stationary.extend(now[converged].tolist())
            self._resume(now[failed])

    def _classify(self, batch: NewtonBatch) -> bool:
        """Decide whether stationary particles have converged, and move the others off saddles."""
        task, solution = self._task, self._task.solution
        particles = np.full(len(batch.moved), -1)
        if not self._load(batch, particles, self._stationary):
            return False
        lanes = np.flatnonzero(particles >= 0)
        now = particles[lanes]
        batch.find_residuals(task.first_step)
        batch.find_curvatures(task.first_step)
        solution.pivot[:, now] = batch.pivot[:, lanes]
        solution.pivot_step[:, now] = batch.pivot_step[:, lanes]
        saddle = ~(batch.pivot[:, lanes] > 0.0).all(axis=0)
        final = (self._escapes[now] >= len(_ESCAPES)) | self._exhausted(now)
        solution.status[now[~saddle]] = Status.CONVERGED
        solution.status[now[saddle & final]] = Status.SADDLE
        leaving = saddle & ~final
        if leaving.any():
            share = np.zeros(len(batch.moved))
            share[lanes[leaving]] = _ESCAPES[self._escapes[now[leaving]]]
            batch.leave_saddles(task.first_step, lanes[leaving], share)
            self._escapes[now[leaving]] += 1
            self._attempts[now[leaving]] = 1
            self._store(batch, lanes[leaving], now[leaving])
            self._resume(now[leaving])
        return True

    def _resume(self, particles: np.ndarray) -> None:
        self._lq_games[particles] = 0
        self._resuming.extend(particles.tolist())

    def _patience(self, particles: np.ndarray) -> np.ndarray:
        """Number of LQ games before the next attempt of Newton's method."""
        attempts = self._attempts[particles]
        return np.where(attempts == 0, 0, _PATIENCE * 2 ** np.maximum(attempts - 1, 0))

    def _exhausted(self, particles: np.ndarray) -> np.ndarray:
        spent = self._task.solution.iterations[particles] >= self._task.limits[particles]
        return np.asarray(spent | self._late)

    @property
    def _late(self) -> bool:
        return perf_counter() >= self._task.deadline

    def _fill(self, batch: NewtonBatch, particles: np.ndarray) -> None:
        """Load particles for LQ games into free lanes: those that have begun, then new ones."""
        self._load(batch, particles, self._resuming)
        while True:
            free = np.flatnonzero(particles < 0)
            taken = list(islice(self._task.waiting, len(free)))
            if not taken:
                return
            lanes = free[: len(taken)]
            particles[lanes] = taken
            batch.begin(lanes)
            self._task.play_out(batch, lanes, particles)

    def _load(self, batch: NewtonBatch, particles: np.ndarray, queue: deque[int]) -> bool:
        """Load particles of a queue into free lanes; return whether there were any."""
        loaded = []
        for lane in np.flatnonzero(particles < 0):
            try:
                particles[lane] = queue.popleft()
            except IndexError:  # another thread may have taken the last one
                break
            loaded.append(lane)
        lanes = np.array(loaded, dtype=int)
        batch.begin(lanes)
        batch.load(lanes, self._task.found, particles[lanes])
        return bool(loaded)

    def _store(self, batch: NewtonBatch, lanes: np.ndarray, particles: np.ndarray) -> None:
        """Store particles, unless they are not finite."""
        finite = self._task.solution.status[particles] != Status.NOT_FINITE
        batch.store(lanes[finite], self._task.found, particles[finite])
