"""The iterative LQ game solver, for many particles at once."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import replace
from itertools import islice
from time import perf_counter
from typing import NamedTuple

import numpy as np

from gameinfer_ros.games import Game
from gameinfer_ros.lanes.blocks import WIDE
from gameinfer_ros.solver.batch import Batch
from gameinfer_ros.solver.settings import SolverSettings
from gameinfer_ros.solver.solution import Solution, Status
from gameinfer_ros.solver.strategy import FlatArrays, Strategy


class IterativeLQ:
    """Finds local feedback Nash equilibria of a game, one for each initial strategy.

    Each iteration approximates the game along the last trajectory by an LQ game, solves that for
    its feedback Nash strategies, and scales their feed-forward terms down until the trajectory
    they lead to stays close to the last one (Fridovich-Keil et al., "Efficient Iterative
    Linear-Quadratic Approximations for Nonlinear Multi-Player General-Sum Differential Games",
    ICRA 2020).

    Args:
        game: the game to solve.
        settings: how to go about it.
    """

    def __init__(self, game: Game, settings: SolverSettings | None = None) -> None:
        self.game = game
        self.settings = settings or SolverSettings()
        self._batches: dict[int, list[Batch]] = {}
        self._helpers = ThreadPoolExecutor(max(1, self.settings.threads - 1), "solver")

    def warm_up(self, alone: bool = False) -> None:
        """Compile all that `solve` needs, or load it from Numba's disk cache.

        Worth calling before time matters: compiling takes half a minute, loading one second.

        Args:
            alone: whether it will only be called for one particle at a time.
        """
        nx, nu, T = self.game.players.n_states, self.game.players.n_inputs, self.game.horizon
        for particles in (1,) if alone else (1, WIDE):
            idle = Strategy.from_inputs(0, np.zeros(nx), np.zeros((T, nu, particles)))
            block = self._batches_for(particles)[0]
            block.load(np.arange(particles), idle.flat, np.arange(particles))
            block.store(np.arange(particles), idle.flat, np.arange(particles))
            block.iterate(0, np.arange(particles))
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
    ) -> Solution:
        """Solve the game from `x0`, for every particle of `initial`.

        Particles are worked on side by side. One that is done makes room for the next, so that
        none waits for the slowest. What a particle gets does not depend on the others, nor on the
        number of threads; where there is a deadline, whether it gets something does.

        Args:
            x0: state (nx,).
            initial: a seed, or the strategies of an earlier solution as a warm start.
            order: indices (K,) of the particles, the one that comes first first.
            max_iterations: for all particles or for each (K,), if not as in the settings.
            deadline: value of `time.perf_counter()` from which on no iteration begins.
            step: the step of `x0`, if it is not the one that `initial` starts at but a later one.
                The solution starts there, from `initial.advanced(step)`.

        Raises:
            ValueError: the shapes do not fit the game, `x0` is not finite, or a particle is granted
                no iteration.
            IndexError: the horizon of `initial` does not contain `step`.
        """
        self._check(x0, initial)
        first_step = initial.first_step if step is None else step
        K, players = len(initial), self.game.players
        strategy = Strategy.zeros(
            first_step, self.game.horizon, players.n_states, players.n_inputs, K
        )
        if max_iterations is None:
            max_iterations = self.settings.max_iterations
        limits = np.broadcast_to(max_iterations, K)
        if (limits < 1).any():
            raise ValueError(f"max_iterations: {limits.min()} is not at least 1")
        task = _Task(
            x0,
            first_step,
            initial.flat,
            initial.index(first_step),
            strategy.flat,
            iter(range(K) if order is None else order.tolist()),
            limits,
            deadline,
            Solution(
                strategy,
                np.full(K, Status.NOT_REACHED),
                np.zeros(K, dtype=int),
                np.full((limits.max(initial=0), K), np.nan),
                np.zeros(K),
            ),
        )
        blocks = self._batches_for(K)
        others = [self._helpers.submit(self._work, block, task) for block in blocks[1:]]
        try:
            self._work(blocks[0], task)
        finally:
            wait(others)  # they must not go on with blocks that the next call needs
        for other in others:
            other.result()
        solution = task.solution
        unsolved = np.isin(solution.status, (Status.NOT_FINITE, Status.NOT_REACHED))
        for particle in np.flatnonzero(unsolved).tolist():
            initial.advance_into(strategy, particle)
        self._play_out(blocks[0], x0, strategy, solution.status == Status.NOT_FINITE)
        last = solution.iterations.max(initial=0)
        return replace(solution, step_sizes=solution.step_sizes[:last])

    def _work(self, block: Batch, task: _Task) -> None:
        """Solve particles of a task, as long as there are any."""
        solution, settings = task.solution, self.settings
        status, iterations = solution.status, solution.iterations
        particles = np.full(len(block.moved), -1)  # which one is in each lane; -1: none
        late = perf_counter() >= task.deadline
        while True:
            free = np.flatnonzero(particles < 0)
            if len(free) and not late:
                taken = list(islice(task.waiting, len(free)))
                fresh = free[: len(taken)]
                particles[fresh] = taken
                if taken:
                    block.load(fresh, task.initial, particles[fresh], task.skipped)
                    block.play_out(task.x0, fresh)
                    playable = np.isfinite(block.moved[fresh])
                    status[particles[fresh]] = np.where(
                        playable, Status.ITERATION_LIMIT, Status.NOT_FINITE
                    )
                    particles[fresh[~playable]] = -1
                    if not playable.all():
                        continue
            lanes = np.flatnonzero(particles >= 0)
            if not len(lanes):
                return
            block.iterate(task.first_step, lanes)
            now, moved = particles[lanes], block.moved[lanes]
            solution.step_sizes[iterations[now], now] = block.scale[lanes]
            iterations[now] += 1
            solution.movement[now] = moved
            status[now[moved <= settings.converged_movement]] = Status.CONVERGED
            status[now[~(moved <= settings.max_movement)]] = Status.LINE_SEARCH_FAILED
            status[now[~block.solvable()[lanes]]] = Status.NOT_FINITE
            done = (status[now] != Status.ITERATION_LIMIT) | (iterations[now] == task.limits[now])
            late = perf_counter() >= task.deadline
            done |= late
            sound = done & (status[now] != Status.NOT_FINITE)
            block.store(lanes[sound], task.found, now[sound])
            particles[lanes[done]] = -1

    def play_out(self, x0: np.ndarray, initial: Strategy) -> Strategy:
        """The strategies `initial` along the trajectories that they lead to from `x0` (nx,)."""
        every = np.arange(len(initial))
        strategy = initial.take(every)
        self._play_out(self._batches_for(len(initial))[0], x0, strategy, every >= 0)
        return strategy

    def _play_out(
        self, block: Batch, x0: np.ndarray, strategy: Strategy, which: np.ndarray
    ) -> None:
        """Play out those particles of `strategy`, in place, that are true in `which` (K,)."""
        particles, width, flat = np.flatnonzero(which), len(block.moved), strategy.flat
        for start in range(0, len(particles), width):
            some = particles[start : start + width]
            lanes = np.arange(len(some))
            block.load(lanes, flat, some)
            block.play_out(x0, lanes)
            block.store(lanes, flat, some)

    def _batches_for(self, particles: int) -> list[Batch]:
        """A block for each thread that so many particles keep busy."""
        width = 1 if particles == 1 else WIDE
        blocks = self._batches.setdefault(width, [])
        needed = max(1, min(self.settings.threads, -(-particles // width)))
        while len(blocks) < needed:
            blocks.append(Batch(self.game, self.settings, width))
        return blocks[:needed]

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
                raise ValueError(f"{name} has the shape {array.shape}; the game needs {shape}")
        if not np.isfinite(x0).all():
            raise ValueError(f"x0 is not finite: {x0}")


class _Task(NamedTuple):
    """What is to be solved, shared by the threads that do it.

    Attributes:
        x0: state (nx,).
        first_step: the step it belongs to.
        initial: numbers of the strategies to start from.
        skipped: how many of their first steps are over.
        found: where the numbers of the strategies that are found go.
        waiting: the particles that are still to be solved; each is taken by one thread.
        limits: iterations for each particle (K,).
        deadline: value of `perf_counter` from which on no iteration begins.
        solution: where all else goes.
    """

    x0: np.ndarray
    first_step: int
    initial: FlatArrays
    skipped: int
    found: FlatArrays
    waiting: Iterator[int]
    limits: np.ndarray
    deadline: float
    solution: Solution
