"""The iterative LQ game solver, for many particles at once."""

from __future__ import annotations

import numpy as np

from gameinfer_ros.games import Game
from gameinfer_ros.games.blocks import WIDE
from gameinfer_ros.solver.block import Block
from gameinfer_ros.solver.settings import SolverSettings
from gameinfer_ros.solver.solution import Solution, Status
from gameinfer_ros.solver.strategy import Strategy


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
        self._blocks: dict[int, Block] = {}

    def warm_up(self) -> None:
        """Compile all that `solve` needs, or load it from Numba's disk cache.

        Worth calling before time matters: compiling takes half a minute, loading one second.
        """
        nx, nu, T = self.game.players.n_states, self.game.players.n_inputs, self.game.horizon
        for particles in (1, WIDE):
            idle = Strategy.from_inputs(0, np.zeros(nx), np.zeros((T, nu, particles)))
            block = self._block(particles)
            block.load(np.arange(particles), idle, np.arange(particles))
            block.iterate(0, np.arange(particles))
            self.game.costs(idle.x_ref, idle.u_ref)
            self.game.step(idle.x_ref[0], idle.u_ref[0])

    def solve(self, x0: np.ndarray, initial: Strategy) -> Solution:
        """Solve the game from `x0`, for every particle of `initial`.

        Particles are worked on side by side. One that is done makes room for the next, so that
        none waits for the slowest. What a particle gets does not depend on the others.

        Args:
            x0: state (nx,) at step `initial.first_step`.
            initial: a seed, or the strategies of an earlier solution as a warm start.

        Raises:
            ValueError: the shapes do not fit the game, or `x0` is not finite.
        """
        self._check(x0, initial)
        settings, K = self.settings, len(initial)
        block = self._block(K)
        strategy = self.play_out(x0, initial)
        playable = np.isfinite(strategy.x_ref).all(axis=(0, 1))
        status = np.where(playable, Status.ITERATION_LIMIT, Status.NOT_FINITE)
        iterations = np.zeros(K, dtype=int)
        step_sizes = np.full((settings.max_iterations, K), np.nan)
        movement = np.zeros(K)

        waiting = np.flatnonzero(playable)
        particles = np.full(len(block.moved), -1)  # which one is in each lane; -1: none
        while True:
            free = np.flatnonzero(particles < 0)[: len(waiting)]
            particles[free], waiting = waiting[: len(free)], waiting[len(free) :]
            block.load(free, strategy, particles[free])
            lanes = np.flatnonzero(particles >= 0)
            if not len(lanes):
                break
            block.iterate(initial.first_step, lanes)
            now, moved = particles[lanes], block.moved[lanes]
            step_sizes[iterations[now], now] = block.scale[lanes]
            iterations[now] += 1
            movement[now] = moved
            status[now[moved <= settings.converged_movement]] = Status.CONVERGED
            status[now[~(moved <= settings.max_movement)]] = Status.LINE_SEARCH_FAILED
            status[now[~block.solvable()[lanes]]] = Status.NOT_FINITE
            done = (status[now] != Status.ITERATION_LIMIT) | (
                iterations[now] == settings.max_iterations
            )
            sound = done & (status[now] != Status.NOT_FINITE)
            block.store(lanes[sound], strategy, now[sound])
            particles[lanes[done]] = -1
        step_sizes = step_sizes[: iterations.max(initial=0)]
        return Solution(strategy, status, iterations, step_sizes, movement)

    def play_out(self, x0: np.ndarray, initial: Strategy) -> Strategy:
        """The strategies `initial` along the trajectories that they lead to from `x0` (nx,)."""
        block = self._block(len(initial))
        strategy = Strategy(initial.first_step, *(np.empty_like(a) for a in initial.arrays))
        width = len(block.moved)
        for start in range(0, len(initial), width):
            particles = np.arange(start, min(start + width, len(initial)))
            lanes = np.arange(len(particles))
            block.load(lanes, initial, particles)
            block.play_out(x0)
            block.store(lanes, strategy, particles)
        return strategy

    def _block(self, particles: int) -> Block:
        width = 1 if particles == 1 else WIDE
        if width not in self._blocks:
            self._blocks[width] = Block(self.game, self.settings, width)
        return self._blocks[width]

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
