"""The iterative LQ game solver, for many particles at once."""

from __future__ import annotations

import numpy as np

from gameinfer_ros.games import Game
from gameinfer_ros.solver import kernels
from gameinfer_ros.solver.settings import SolverSettings
from gameinfer_ros.solver.solution import Solution, Status
from gameinfer_ros.solver.strategy import Strategy

#: Particles that one call of a compiled pass works on; see `solve`.
LANES = 32


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

    def warm_up(self) -> None:
        """Compile all that `solve` needs, or load it from Numba's disk cache.

        Worth calling before time matters: compiling takes about 15 s, loading 2 s.
        """
        nx, nu, T = self.game.players.n_states, self.game.players.n_inputs, self.game.horizon
        idle = Strategy.from_inputs(0, np.zeros(nx), np.zeros((T, nu, 1)))
        alpha = np.zeros((T, nu, 1))
        kernels.lq_pass(self.game.kernels, idle.x_ref, idle.u_ref, 0, 1.0, 1.0, idle.P, alpha)
        self._line_search(idle.x_ref, idle.u_ref, idle.P, alpha)
        self.game.costs(idle.x_ref, idle.u_ref)
        self.game.step(idle.x_ref[0], idle.u_ref[0])

    def solve(self, x0: np.ndarray, initial: Strategy) -> Solution:
        """Solve the game from `x0`, for every particle of `initial`.

        Particles that are not done are worked on in blocks of up to `LANES`; the more of them
        there are in a block, the better the processor's vector units are used.

        Args:
            x0: state (nx,) at step `initial.first_step`.
            initial: a seed, or the strategies of an earlier solution as a warm start.

        Raises:
            ValueError: the shapes do not fit the game, or `x0` is not finite.
        """
        self._check(x0, initial)
        settings, game = self.settings, self.game.kernels
        T, nu, K = initial.u_ref.shape
        x_ref, u_ref = np.empty_like(initial.x_ref), np.empty_like(initial.u_ref)
        no_alpha = np.zeros_like(u_ref)
        P = initial.P.copy()
        status = np.full(K, Status.ITERATION_LIMIT)
        iterations = np.zeros(K, dtype=int)
        step_sizes: list[np.ndarray] = []
        movement = np.zeros(K)

        x_ref[0] = x0[:, None]
        kernels.rollout(
            game, initial.x_ref, initial.u_ref, P, no_alpha, np.ones(K), x_ref, u_ref, movement
        )
        finite = np.isfinite(x_ref).all(axis=(0, 1)) & np.isfinite(u_ref).all(axis=(0, 1))
        status[~finite] = Status.NOT_FINITE
        pending = np.flatnonzero(finite)
        while len(pending) and len(step_sizes) < settings.max_iterations:
            step_sizes.append(np.full(K, np.nan))
            for start in range(0, len(pending), LANES):
                lanes = pending[start : start + LANES]
                x, u = np.take(x_ref, lanes, axis=-1), np.take(u_ref, lanes, axis=-1)
                P_new = np.empty((T, nu, len(x0), len(lanes)))
                alpha = np.empty((T, nu, len(lanes)))
                kernels.lq_pass(
                    game,
                    x,
                    u,
                    initial.first_step,
                    settings.state_regularisation,
                    settings.input_regularisation,
                    P_new,
                    alpha,
                )
                x_new, u_new, scale, moved = self._line_search(x, u, P_new, alpha)
                accepted = moved <= settings.max_movement
                x_ref[..., lanes[accepted]] = x_new[..., accepted]
                u_ref[..., lanes[accepted]] = u_new[..., accepted]
                P[..., lanes[accepted]] = P_new[..., accepted]
                movement[lanes] = moved
                step_sizes[-1][lanes] = scale
                iterations[lanes] += 1
                solvable = np.isfinite(alpha).all(axis=(0, 1)) & np.isfinite(P_new).all(
                    axis=(0, 1, 2)
                )
                status[lanes[moved <= settings.converged_movement]] = Status.CONVERGED
                status[lanes[~accepted]] = Status.LINE_SEARCH_FAILED
                status[lanes[~solvable]] = Status.NOT_FINITE
            pending = pending[status[pending] == Status.ITERATION_LIMIT]
        return Solution(
            Strategy(initial.first_step, x_ref, u_ref, P),
            status,
            iterations,
            np.array(step_sizes).reshape(len(step_sizes), K),
            movement,
        )

    def _line_search(
        self, x_ref: np.ndarray, u_ref: np.ndarray, P: np.ndarray, alpha: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Play out the strategies with smaller and smaller feed-forward terms.

        Returns:
            States, inputs, the scale for each particle, and how far it moved a state component;
            that is above the limit, or nan, where no scale was small enough.
        """
        settings = self.settings
        x, u = x_ref.copy(), np.empty_like(u_ref)
        moved = np.empty(x.shape[2])
        scale = np.full(x.shape[2], settings.first_step_size)
        for halvings in range(settings.max_halvings + 1):
            kernels.rollout(self.game.kernels, x_ref, u_ref, P, alpha, scale, x, u, moved)
            too_far = ~(moved <= settings.max_movement)
            if not too_far.any() or halvings == settings.max_halvings:
                break
            scale[too_far] *= 0.5
        return x, u, scale, moved

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
