"""A readable implementation of the iterative LQ solver in plain NumPy, for one particle.

The tests compare the compiled solver, `GameSolver`, with it. Both share only the kernels of
dynamics and cost terms, which the tests compare with finite differences.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gameinfer_ros.games import Game
from gameinfer_ros.solver.settings import SolverSettings
from gameinfer_ros.solver.solution import Status


@dataclass(frozen=True)
class LQGame:
    """A linear-quadratic game of N players over T steps.

    The joint state follows x_{k+1} = A_k x_k + sum_i B_ik u_ik. Player i minimises the sum of
    1/2 x' Q_i x + q_i' x + 1/2 u_i' R_i u_i + r_i' u_i over the steps, plus 1/2 x' Q_i x + q_i' x
    at the last state.

    Attributes:
        A: state matrices (T, nx, nx).
        B: input matrices (T, nx, m_i), one for each player.
        Q: Hessians of the costs by state (N, T + 1, nx, nx), symmetric.
        q: gradients of the costs by state (N, T + 1, nx).
        R: Hessians of the costs by input (T, m_i, m_i), symmetric, one for each player.
        r: gradients of the costs by input (T, m_i), one for each player.
    """

    A: np.ndarray
    B: list[np.ndarray]
    Q: np.ndarray
    q: np.ndarray
    R: list[np.ndarray]
    r: list[np.ndarray]


@dataclass(frozen=True)
class ReferenceSolution:
    """The strategies u = u_ref - P (x - x_ref) that `solve` found, and how it ended.

    Attributes:
        x: reference states (T + 1, nx).
        u: reference inputs (T, nu).
        P: gains (T, nu, nx).
        status: why the solver stopped.
        iterations: number of LQ games solved.
    """

    x: np.ndarray
    u: np.ndarray
    P: np.ndarray
    status: Status
    iterations: int


def approximate(
    game: Game, x: np.ndarray, u: np.ndarray, first_step: int, settings: SolverSettings
) -> LQGame:
    """Approximate a game along a trajectory by a regularised LQ game.

    The states and inputs of the LQ game are deviations from the trajectory.

    Args:
        game: the game.
        x: states (T + 1, nx).
        u: inputs (T, nu).
        first_step: step of x[0].
        settings: settings with the regularisation.
    """
    players = game.players
    T, N, nx = len(u), len(players), players.n_states
    sizes = [dynamics.n_inputs for dynamics in players.dynamics]
    lq = LQGame(
        A=np.zeros((T, nx, nx)),
        B=[np.zeros((T, nx, m)) for m in sizes],
        Q=np.zeros((N, T + 1, nx, nx)),
        q=np.zeros((N, T + 1, nx)),
        R=[np.zeros((T, m, m)) for m in sizes],
        r=[np.zeros((T, m)) for m in sizes],
    )
    for k in range(T + 1):
        t = (first_step + k) * game.dt
        for i, m in enumerate(sizes):
            rows = players.states(i)
            u_i = u[k, players.inputs(i)] if k < T else np.zeros(m)
            Q, q, R, r = _quadraticise(game, i, t, x[k], u_i)
            lq.Q[i, k] = Q + settings.state_regularisation * np.eye(nx)
            lq.q[i, k] = q
            if k < T:
                lq.R[i][k] = R + settings.input_regularisation * np.eye(m)
                lq.r[i][k] = r
                lq.A[k, rows, rows], lq.B[i][k, rows] = _linearise(game, i, x[k, rows], u_i)
    return lq


def _linearise(
    game: Game, i: int, x_i: np.ndarray, u_i: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the Jacobians A_i (n, n) and B_i (n, m) of player i's dynamics."""
    dynamics = game.players.dynamics[i]
    n, m = dynamics.n_states, dynamics.n_inputs
    A, B, params = np.zeros((n, n, 1)), np.zeros((n, m, 1)), np.array(dynamics.params, dtype=float)
    # Looked up in the class, because an instance would bind the kernel like a method.
    kernel = type(dynamics).linearise_kernel
    if kernel is None:
        # Complex steps, one in each column: exact, because nothing is subtracted.
        steps = 1e-30j * np.eye(n + m)
        after = np.zeros((n, n + m), dtype=complex)
        x, u = x_i[:, None] + steps[:n], u_i[:, None] + steps[n:]
        type(dynamics).step_kernel(x, u, game.dt, params, after)
        return after.imag[:, :n] / 1e-30, after.imag[:, n:] / 1e-30
    kernel.compiled(x_i[:, None], u_i[:, None], game.dt, params, A, B)
    return A[..., 0], B[..., 0]


def _quadraticise(
    game: Game, i: int, t: float, x: np.ndarray, u_i: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the derivatives Q (nx, nx), q (nx,), R (m, m), r (m,) of player i's cost per step."""
    nx, m = len(x), len(u_i)
    Q, q = np.zeros((nx, nx, 1)), np.zeros((nx, 1))
    R, r = np.zeros((m, m, 1)), np.zeros((m, 1))
    for bound in game.terms[i]:
        index, params = np.array(bound.index, dtype=np.int64), np.array(bound.params, dtype=float)
        kernel = type(bound.term).quadraticise_kernel
        kernel(t, x[:, None], u_i[:, None], index, params, Q, q, R, r)
    return Q[..., 0], q[..., 0], R[..., 0], r[..., 0]


def solve_lq_game(lq: LQGame) -> tuple[np.ndarray, np.ndarray]:
    """Compute feedback Nash strategies u = -P x - alpha by the coupled Riccati recursion.

    Let 1/2 x' Z_i x + zeta_i' x be the value of player i one step later. The strategies are best
    responses to each other if, for all players i,

        (R_i + B_i' Z_i B_i) P_i + B_i' Z_i sum_{j != i} B_j P_j = B_i' Z_i A,
        (R_i + B_i' Z_i B_i) alpha_i + B_i' Z_i sum_{j != i} B_j alpha_j = B_i' zeta_i + r_i

    (Basar and Olsder, Dynamic Noncooperative Game Theory, 2nd ed., corollary 6.1).

    Args:
        lq: the LQ game.

    Returns:
        The gains P (T, nu, nx) and the feed-forward terms alpha (T, nu) of all players.

    Raises:
        numpy.linalg.LinAlgError: the equations of a step have no unique solution.
    """
    T, nx = lq.A.shape[:2]
    N, nu = len(lq.B), sum(B_i.shape[2] for B_i in lq.B)
    ends = np.cumsum([B_i.shape[2] for B_i in lq.B])
    inputs = [slice(end - B_i.shape[2], end) for end, B_i in zip(ends, lq.B, strict=True)]
    P, alpha = np.empty((T, nu, nx)), np.empty((T, nu))
    Z, zeta = list(lq.Q[:, T]), list(lq.q[:, T])
    for k in reversed(range(T)):
        A, B = lq.A[k], np.hstack([B_i[k] for B_i in lq.B])
        S, Y, y = np.empty((nu, nu)), np.empty((nu, nx)), np.empty(nu)
        for i, own in enumerate(inputs):
            B_i = B[:, own]
            S[own] = B_i.T @ Z[i] @ B
            S[own, own] += lq.R[i][k]
            Y[own] = B_i.T @ Z[i] @ A
            y[own] = B_i.T @ zeta[i] + lq.r[i][k]
        P[k] = np.linalg.solve(S, Y)
        alpha[k] = np.linalg.solve(S, y)

        F, beta = A - B @ P[k], -B @ alpha[k]
        for i in range(N):
            P_i, alpha_i = P[k, inputs[i]], alpha[k, inputs[i]]
            R_i, r_i = lq.R[i][k], lq.r[i][k]
            zeta[i] = F.T @ (zeta[i] + Z[i] @ beta) + lq.q[i, k] + P_i.T @ (R_i @ alpha_i - r_i)
            Z[i] = F.T @ Z[i] @ F + lq.Q[i, k] + P_i.T @ R_i @ P_i
    return P, alpha


def rollout(
    game: Game,
    x0: np.ndarray,
    x_ref: np.ndarray,
    u_ref: np.ndarray,
    P: np.ndarray,
    alpha: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Roll out u = u_ref - P (x - x_ref) - alpha from `x0`.

    Args:
        game: the game.
        x0: state (nx,).
        x_ref: reference states (T + 1, nx).
        u_ref: reference inputs (T, nu).
        P: gains (T, nu, nx).
        alpha: feed-forward terms (T, nu).

    Returns:
        States (T + 1, nx) and inputs (T, nu).
    """
    x, u = np.empty_like(x_ref), np.empty_like(u_ref)
    x[0] = x0
    for k in range(len(u)):
        u[k] = u_ref[k] - P[k] @ (x[k] - x_ref[k]) - alpha[k]
        x[k + 1] = game.step(x[k], u[k])
    return x, u


def solve(
    game: Game, x0: np.ndarray, u_seed: np.ndarray, settings: SolverSettings, first_step: int = 0
) -> ReferenceSolution:
    """Find the local feedback Nash equilibrium that a seed leads to.

    Args:
        game: the game.
        x0: state (nx,) at `first_step`.
        u_seed: inputs (T, nu) of the initial open-loop strategies.
        settings: settings of the solver.
        first_step: the step at which the horizon starts.

    Returns:
        The last strategies that could be rolled out, and why the solver stopped.
    """
    P, alpha = np.zeros((*u_seed.shape, len(x0))), np.zeros_like(u_seed)
    standstill = np.tile(x0, (len(u_seed) + 1, 1))
    x, u = rollout(game, x0, standstill, u_seed, P, alpha)
    if not np.isfinite(x).all():
        return ReferenceSolution(x, u, P, Status.NOT_FINITE, 0)

    initial = x, u, P
    for iteration in range(1, settings.max_iterations + 1):
        try:
            P, alpha = solve_lq_game(approximate(game, x, u, first_step, settings))
        except np.linalg.LinAlgError:
            return ReferenceSolution(*initial, Status.NOT_FINITE, iteration)
        if not (np.isfinite(P).all() and np.isfinite(alpha).all()):
            return ReferenceSolution(*initial, Status.NOT_FINITE, iteration)

        scale = settings.first_step_size
        for _ in range(settings.max_halvings + 1):
            x_new, u_new = rollout(game, x0, x, u, P, scale * alpha)
            movement = np.abs(x_new - x).max()
            if movement <= settings.max_movement:
                break
            scale *= 0.5
        else:
            return ReferenceSolution(x, u, P, Status.LINE_SEARCH_FAILED, iteration)

        x, u = x_new, u_new
        if settings.converged(scale, movement):
            return ReferenceSolution(x, u, P, Status.CONVERGED, iteration)
    return ReferenceSolution(x, u, P, Status.ITERATION_LIMIT, iteration)
