"""The method `newton`: LQ games first, then Newton's method, and away from saddles."""

from __future__ import annotations

from collections import deque
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from gameinfer_ros.solver.settings import SolverSettings
from gameinfer_ros.solver.solution import Status
from gameinfer_ros.solver.task import Task

if TYPE_CHECKING:
    from gameinfer_ros.solver.newton_batch import NewtonBatch

#: Residuals below which the gains are kept, and Newton steps begin: at the first attempt, and later
#: or from a warm start. Far from an equilibrium, the gains are not those of its LQ game.
_FIRST_BELOW, _THEN_BELOW = 0.1, 0.5

#: Share of the horizon after which the gains of a warm start are too old to be kept.
_OLD = 0.25

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

    A warm start begins with (2), so that its gains do not jump from one solve to the next. Steps
    that it adds at the end of the horizon have no gains; it begins with (1) if these are many.

    Threads share one search for each call of the solver; each particle is in one thread at a time.

    Args:
        task: what to solve. The search writes to its solution.
        settings: settings of the solver.
    """

    def __init__(self, task: Task, settings: SolverSettings) -> None:
        K = len(task.solution.status)
        self._task, self._settings = task, settings
        order, warm = list(task.waiting), _warm_starts(task)
        self._seeds = deque(k for k in order if not warm[k])
        self._warm = deque(k for k in order if warm[k])
        self._good_enough = warm & task.for_one_step
        self._tolerance = np.where(self._good_enough, settings.warm_tolerance, settings.tolerance)
        self._resuming: deque[int] = deque()  # particles for LQ games that have begun
        self._near: deque[int] = deque()  # particles for Newton steps
        self._stationary: deque[int] = deque()  # particles that may be at saddles
        self._lq_games = np.zeros(K, dtype=int)  # since the last resumption
        self._attempts, self._steps = np.zeros((2, K), dtype=int)  # of Newton's method
        self._attempts[warm] = 1
        self._tried = np.zeros(K)  # residual at the last attempt
        self._escapes = np.zeros(K, dtype=int)

    def work(self, batch: NewtonBatch) -> None:
        """Solve particles until none is left, or until the deadline."""
        worked = True
        while worked:
            worked = self._iterate_newton(batch)
            worked |= self._iterate_lq_games(batch)
            worked |= self._classify(batch)

    def _iterate_lq_games(self, batch: NewtonBatch) -> bool:
        """Iterate LQ games until no particle needs them; return whether any did."""
        task, solution = self._task, self._task.solution
        particles = np.full(len(batch.moved), -1)  # the particle in each lane; -1: free
        worked = False
        while True:
            if not self._late:
                self._load(batch, particles, self._resuming)
                self._begin(batch, particles, self._seeds)
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
            below = np.where(self._attempts[now] == 0, _FIRST_BELOW, _THEN_BELOW)
            near = (residual <= below) & (self._lq_games[now] > self._patience(now))
            near |= residual <= _PROGRESS * self._tried[now]
            near |= residual <= self._tolerance[now]
            near &= solution.status[now] == Status.ITERATION_LIMIT
            stopped = (solution.status[now] != Status.ITERATION_LIMIT) | self._exhausted(now)
            stopped &= ~(residual <= self._tolerance[now])
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
            if not self._late:
                loaded = self._load(batch, particles, self._near)
                if self._begin(batch, particles, self._warm) or loaded:
                    batch.find_residuals(task.first_step)
            lanes = np.flatnonzero(particles >= 0)
            if not len(lanes):
                return worked
            worked = True
            now, residual = particles[lanes], batch.residual[lanes]
            solution.residual[now] = residual
            converged = residual <= self._tolerance[now]
            ended = ~converged & self._exhausted(now)
            failed = ~converged & ~ended & (self._steps[now] >= _NEWTON_STEPS)
            failed |= ~converged & ~ended & (self._steps[now] == 0) & ~(residual <= _THEN_BELOW)
            stepping = ~converged & ~ended & ~failed
            if stepping.any():
                decreased = batch.step_by_newton(task.first_step, lanes[stepping])[lanes]
                solution.iterations[now[stepping]] += 1
                self._steps[now[stepping]] += 1
                failed |= stepping & ~decreased
            leaving = converged | ended | failed
            self._store(batch, lanes[leaving], now[leaving])
            particles[lanes[leaving]] = -1
            enough = self._good_enough[now]
            solution.status[now[converged & enough]] = Status.GOOD_ENOUGH
            self._stationary.extend(now[converged & ~enough].tolist())
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

    def _begin(self, batch: NewtonBatch, particles: np.ndarray, queue: deque[int]) -> bool:
        """Load initial strategies into free lanes; return whether there were any."""
        loaded = False
        while len(lanes := self._take(batch, particles, queue)):
            self._task.play_out(batch, lanes, particles)
            loaded = True
        return loaded

    def _load(self, batch: NewtonBatch, particles: np.ndarray, queue: deque[int]) -> bool:
        """Load particles that have begun into free lanes; return whether there were any."""
        lanes = self._take(batch, particles, queue)
        batch.load(lanes, self._task.found, particles[lanes])
        return bool(len(lanes))

    @staticmethod
    def _take(batch: NewtonBatch, particles: np.ndarray, queue: deque[int]) -> np.ndarray:
        """Assign particles of a queue to free lanes; return these lanes."""
        taken = []
        for lane in np.flatnonzero(particles < 0):
            try:
                particles[lane] = queue.popleft()
            except IndexError:  # another thread may have taken the last one
                break
            taken.append(lane)
        lanes = np.array(taken, dtype=int)
        batch.begin(lanes)
        return lanes

    def _store(self, batch: NewtonBatch, lanes: np.ndarray, particles: np.ndarray) -> None:
        """Store particles, unless they are not finite."""
        finite = self._task.solution.status[particles] != Status.NOT_FINITE
        batch.store(lanes[finite], self._task.found, particles[finite])


def _warm_starts(task: Task) -> np.ndarray:
    """Return which initial strategies have gains that are not too old (K,)."""
    T, nu, nx, K = task.solution.strategy.P.shape
    gains = task.initial[2].reshape(K, T, nu * nx)
    # Each step by which the horizon recedes adds one without gains at its end.
    newest = T - 1 - max(0, int(_OLD * T) - task.skipped)
    return np.asarray(gains[:, task.skipped].any(axis=1) & gains[:, newest].any(axis=1))
