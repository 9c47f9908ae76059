"""The solver of a game, for many particles at once."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from gameinfer_ros.games import Game
from gameinfer_ros.lanes.array import WIDE
from gameinfer_ros.solver.lq_search import LQSearch
from gameinfer_ros.solver.newton_search import NewtonSearch
from gameinfer_ros.solver.settings import SolverSettings
from gameinfer_ros.solver.solution import Solution, Status
from gameinfer_ros.solver.strategy import Strategy
from gameinfer_ros.solver.task import Task

if TYPE_CHECKING:
    from gameinfer_ros.solver.batch import Batch


class GameSolver:
    """A solver that finds one local feedback Nash equilibrium for each initial strategy.

    `SolverSettings.method` determines how: see `NewtonSearch` and `LQSearch`.

    Several threads may call the same solver at the same time.

    Args:
        game: the game to solve.
        settings: settings of the solver; its defaults if `None`.
    """

    def __init__(self, game: Game, settings: SolverSettings | None = None) -> None:
        self.game = game
        self.settings = settings or SolverSettings()
        #: Batches that no call is using, by their number of lanes.
        self._idle: defaultdict[int, deque[Batch]] = defaultdict(deque)
        self._pool = ThreadPoolExecutor(max(1, self.settings.threads - 1), "solver")

    def warm_up(self, alone: bool = False) -> None:
        """Compile the code that `solve` needs, or load it from Numba's disk cache.

        Call this before time matters: compiling takes half a minute, loading one second.

        Args:
            alone: whether `solve` will only be called with one particle at a time.
        """
        nx, nu, T = self.game.players.n_states, self.game.players.n_inputs, self.game.horizon
        for particles in (1,) if alone else (1, WIDE):
            idle = Strategy.from_inputs(0, np.zeros(nx), np.zeros((T, nu, particles)))
            with self._batches(particles) as (batch, *_):
                batch.load(np.arange(particles), idle.flat, np.arange(particles))
                batch.store(np.arange(particles), idle.flat, np.arange(particles))
                batch.warm_up()
            self.game.costs(idle.x_ref, idle.u_ref)
            self.game.step(idle.x_ref[0], idle.u_ref[0])

    def solve(
        self,
        x0: np.ndarray,
        initial: Strategy,
        order: np.ndarray | None = None,
        max_iterations: int | np.ndarray | None = None,
        deadline: float = np.inf,
        step: int | None = None,
        for_one_step: bool = False,
    ) -> Solution:
        """Solve the game from `x0` for every particle of `initial`.

        Particles are processed side by side; a finished one makes room for the next. The solution
        of a particle does not depend on the others or on the number of threads. With a deadline,
        the number of its iterations does.

        Args:
            x0: state (nx,).
            initial: seeds, or the strategies of an earlier solution as a warm start.
            order: indices (K,) of the particles in order of priority; by default, 0 to K - 1.
            max_iterations: maximum number of iterations, of all particles or of each one (K,); by
                default, that of the settings.
            deadline: value of `time.perf_counter()` after which no iteration starts.
            step: the step of `x0`, if it is later than the first step of `initial`. The solution
                starts there, from `initial.advanced(step)`.
            for_one_step: whether warm starts need only be good enough for one step of a receding
                horizon: the method `newton` then stops at `warm_tolerance`.

        Returns:
            A solution for the K particles of `initial`, in the same order.

        Raises:
            ValueError: a shape does not fit the game, `x0` is not finite, or `max_iterations` is
                below 1.
            IndexError: the horizon of `initial` does not contain `step`.
        """
        self._check(x0, initial)
        first_step = initial.first_step if step is None else step
        K, players = len(initial), self.game.players
        initial = initial.near(first_step, x0, players.is_angle)
        strategy = Strategy.zeros(
            first_step, self.game.horizon, players.n_states, players.n_inputs, K
        )
        most = self.settings.max_iterations if max_iterations is None else max_iterations
        limits = np.broadcast_to(most, K)
        if (limits < 1).any():
            raise ValueError(
                f"max_iterations: {limits.min()} is not allowed: it must be at least 1"
            )
        solution = Solution.unsolved(strategy, len(players))
        status = solution.status
        waiting = iter(range(K) if order is None else order.tolist())
        skipped = initial.index(first_step)
        task = Task(x0, initial.flat, skipped, waiting, limits, deadline, for_one_step, solution)
        search = NewtonSearch if self.settings.method == "newton" else LQSearch
        work: Callable[[Any], None] = search(task, self.settings).work
        with self._batches(K) as batches:
            others = [self._pool.submit(work, batch) for batch in batches[1:]]
            try:
                work(batches[0])
            finally:
                wait(others)  # the next call uses the same batches
            for other in others:
                other.result()
            unsolved = np.flatnonzero(np.isin(status, (Status.NOT_FINITE, Status.NOT_REACHED)))
            strategy.assign(unsolved, initial.take(unsolved).advanced(first_step), slice(None))
            self._play_out(batches[0], x0, strategy, np.flatnonzero(status == Status.NOT_FINITE))
        return solution

    def play_out(self, x0: np.ndarray, initial: Strategy) -> Strategy:
        """Roll out strategies from `x0` (nx,).

        Returns:
            The strategies `initial` around the trajectories that they lead to.
        """
        every = np.arange(len(initial))
        near = initial.near(initial.first_step, x0, self.game.players.is_angle)
        strategy = near.take(every)
        with self._batches(len(initial)) as (batch, *_):
            self._play_out(batch, x0, strategy, every)
        return strategy

    @staticmethod
    def _play_out(batch: Batch, x0: np.ndarray, strategy: Strategy, particles: np.ndarray) -> None:
        """Roll out, in place, the particles of `strategy` with these indices."""
        width, flat = len(batch.moved), strategy.flat
        for start in range(0, len(particles), width):
            some = particles[start : start + width]
            lanes = np.arange(len(some))
            batch.load(lanes, flat, some)
            batch.play_out(x0, lanes)
            batch.store(lanes, flat, some)

    @contextmanager
    def _batches(self, particles: int) -> Iterator[list[Batch]]:
        """Lend one batch for each thread that this number of particles can keep busy."""
        width = 1 if particles == 1 else WIDE
        idle, needed = self._idle[width], max(1, min(self.settings.threads, -(-particles // width)))
        lent: list[Batch] = []
        while len(lent) < needed:
            try:
                lent.append(idle.pop())
            except IndexError:
                lent.append(self._make_batch(width))
        yield lent
        idle.extend(lent)  # not after an exception: a thread may still be using them

    def _make_batch(self, width: int) -> Batch:
        # The modules import Numba, which only solving needs.
        if self.settings.method == "newton":
            from gameinfer_ros.solver.newton_batch import NewtonBatch

            return NewtonBatch(self.game, self.settings, width)
        from gameinfer_ros.solver.batch import Batch

        return Batch(self.game, self.settings, width)

    def _check(self, x0: np.ndarray, initial: Strategy) -> None:
        nx, nu = self.game.players.n_states, self.game.players.n_inputs
        T, K = self.game.horizon, len(initial)
        for name, array, shape in (
            ("x0", x0, (nx,)),
            ("initial.x_ref", initial.x_ref, (T + 1, nx, K)),
            ("initial.u_ref", initial.u_ref, (T, nu, K)),
            ("initial.P", initial.P, (T, nu, nx, K)),
        ):
            if array.shape != shape:
                raise ValueError(
                    f"{name}: the shape {array.shape} is not allowed: it must be {shape}"
                )
        if not np.isfinite(x0).all():
            raise ValueError(f"x0: {x0.tolist()} is not allowed: it must be finite")
