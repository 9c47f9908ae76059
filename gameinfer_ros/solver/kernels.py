"""Compiled passes over the horizon, for one block of lanes.

Arrays carry the lane, that is the particle, in their last axis; T is the horizon, N the number of
players, nx and nu the sizes of the joint state and input, L the number of lanes:

| array | shape | meaning |
|---|---|---|
| x | (T + 1, nx, L) | states |
| u | (T, nu, L) | inputs |
| P | (T, nu, nx, L) | gains |
| alpha | (T, nu, L) | feed-forward terms |

Lanes never mix: what one particle gets does not depend on which others are in its block.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from gameinfer_ros.games.kernels import Array, GameKernels, part


@njit(cache=True, error_model="numpy")
def rollout(
    game: GameKernels, x_ref: Array, u_ref: Array, P: Array, alpha: Array, scale: Array,
    x: Array, u: Array, moved: Array,
) -> None:  # fmt: skip
    """Play u = u_ref - P (x - x_ref) - scale alpha from x[0].

    Writes the states x[1:], the inputs u, and for each lane in moved (L,) the largest change of
    any state component against x_ref (nan if a state is not a number).
    """
    T, nu, L = u.shape
    nx = x.shape[1]
    dx = np.empty((nx, L))
    moved[:] = 0.0
    for k in range(T + 1):
        for r in range(nx):
            for lane in range(L):
                dx[r, lane] = x[k, r, lane] - x_ref[k, r, lane]
                moved[lane] = np.maximum(moved[lane], np.abs(dx[r, lane]))
        if k == T:
            return
        for a in range(nu):
            for lane in range(L):
                u[k, a, lane] = u_ref[k, a, lane] - scale[lane] * alpha[k, a, lane]
            for r in range(nx):
                for lane in range(L):
                    u[k, a, lane] -= P[k, a, r, lane] * dx[r, lane]
        for i in range(len(game.step)):
            game.step[i](
                part(x[k], game.state_offset, i),
                part(u[k], game.input_offset, i),
                game.dt,
                part(game.dynamics_params, game.dynamics_params_offset, i),
                part(x[k + 1], game.state_offset, i),
            )


@njit(cache=True, error_model="numpy")
def lq_pass(
    game: GameKernels, x: Array, u: Array, first_step: int,
    state_regularisation: float, input_regularisation: float,
    P: Array, alpha: Array,
) -> None:  # fmt: skip
    """Feedback Nash strategies of the LQ game that approximates the game along x and u.

    Goes backwards over the horizon. At each step it linearises the dynamics, quadraticises the
    costs (adding the regularisation to the diagonals of Q and R), solves the coupled equations

        (R_i + B_i' Z_i B_i) P_i + B_i' Z_i sum_{j != i} B_j P_j = B_i' Z_i A
        (R_i + B_i' Z_i B_i) alpha_i + B_i' Z_i sum_{j != i} B_j alpha_j = B_i' zeta_i + r_i

    for all players at once, and takes the values 1/2 dx' Z_i dx + zeta_i' dx one step back:

        F = A - sum_j B_j P_j,  beta = -sum_j B_j alpha_j
        zeta_i <- F' (zeta_i + Z_i beta) + q_i + P_i' (R_i alpha_i - r_i)
        Z_i <- F' Z_i F + Q_i + P_i' R_i P_i

    Basar and Olsder, Dynamic Noncooperative Game Theory, 2nd ed., corollary 6.1. Writes P, alpha.
    """
    T, nu, L = u.shape
    nx = x.shape[1]
    N = len(game.step)
    so, uo = game.state_offset, game.input_offset
    a_offset = _block_offsets(so, so)
    b_offset = _block_offsets(so, uo)
    r_offset = _block_offsets(uo, uo)
    A = np.empty((a_offset[N], L))
    B = np.empty((b_offset[N], L))
    R = np.empty((r_offset[N], L))
    r = np.empty((nu, L))
    # The costs of step k are gathered in Q and q, which then become the values of step k.
    Q = np.empty((N, nx, nx, L))
    q = np.empty((N, nx, L))
    Z = np.empty((N, nx, nx, L))
    zeta = np.empty((N, nx, L))
    BZ = np.empty((nu, nx, L))
    # The coupled equations S [P alpha] = [Y y], side by side.
    S = np.empty((nu, nu, L))
    Y = np.empty((nu, nx + 1, L))
    F = np.empty((nx, nx, L))
    beta = np.empty((nx, L))
    ZF = np.empty((nx, L))
    no_input = np.zeros((nu, L))

    _quadraticise(
        game, x[T], no_input, (first_step + T) * game.dt,
        state_regularisation, input_regularisation, Z, zeta, R, r, r_offset,
    )  # fmt: skip
    for k in range(T - 1, -1, -1):
        _quadraticise(
            game, x[k], u[k], (first_step + k) * game.dt,
            state_regularisation, input_regularisation, Q, q, R, r, r_offset,
        )  # fmt: skip
        for i in range(N):
            n, m = so[i + 1] - so[i], uo[i + 1] - uo[i]
            game.linearise[i](
                part(x[k], so, i),
                part(u[k], uo, i),
                game.dt,
                part(game.dynamics_params, game.dynamics_params_offset, i),
                part(A, a_offset, i).reshape((n, n, L)),
                part(B, b_offset, i).reshape((n, m, L)),
            )

        for i in range(N):
            n, m = so[i + 1] - so[i], uo[i + 1] - uo[i]
            B_i = part(B, b_offset, i).reshape((n, m, L))
            R_i = part(R, r_offset, i).reshape((m, m, L))
            for a in range(m):
                row = uo[i] + a
                BZ[row] = 0.0
                for c in range(nx):
                    for s in range(n):
                        _add(BZ[row, c], B_i[s, a], Z[i, so[i] + s, c])
                Y[row, nx] = r[row]
                for s in range(n):
                    _add(Y[row, nx], B_i[s, a], zeta[i, so[i] + s])
                S[row] = 0.0
                S[row, uo[i] : uo[i + 1]] = R_i[a]
                Y[row, :nx] = 0.0
                for j in range(N):
                    n_j, m_j = so[j + 1] - so[j], uo[j + 1] - uo[j]
                    A_j = part(A, a_offset, j).reshape((n_j, n_j, L))
                    B_j = part(B, b_offset, j).reshape((n_j, m_j, L))
                    for s in range(n_j):
                        for b in range(m_j):
                            _add(S[row, uo[j] + b], BZ[row, so[j] + s], B_j[s, b])
                        for c in range(n_j):
                            _add(Y[row, so[j] + c], BZ[row, so[j] + s], A_j[s, c])

        _solve(S, Y)
        P[k] = Y[:, :nx]
        alpha[k] = Y[:, nx]

        F[:] = 0.0
        beta[:] = 0.0
        for i in range(N):
            n, m = so[i + 1] - so[i], uo[i + 1] - uo[i]
            A_i = part(A, a_offset, i).reshape((n, n, L))
            B_i = part(B, b_offset, i).reshape((n, m, L))
            F[so[i] : so[i + 1], so[i] : so[i + 1]] = A_i
            for s in range(n):
                for a in range(m):
                    for c in range(nx):
                        _subtract(F[so[i] + s, c], B_i[s, a], Y[uo[i] + a, c])
                    _subtract(beta[so[i] + s], B_i[s, a], Y[uo[i] + a, nx])

        for i in range(N):
            m = uo[i + 1] - uo[i]
            R_i = part(R, r_offset, i).reshape((m, m, L))
            for s in range(nx):
                for c in range(nx):
                    _add(zeta[i, s], Z[i, s, c], beta[c])
            for c in range(nx):
                ZF[:] = 0.0
                for s in range(nx):
                    for e in range(nx):
                        _add(ZF[s], Z[i, s, e], F[e, c])
                for s in range(nx):
                    _add(q[i, c], F[s, c], zeta[i, s])
                    for e in range(c + 1):
                        _add(Q[i, e, c], F[s, e], ZF[s])
                for a in range(m):
                    P_a = Y[uo[i] + a]
                    ZF[0] = 0.0
                    ZF[1] = -r[uo[i] + a]
                    for b in range(m):
                        _add(ZF[0], R_i[a, b], Y[uo[i] + b, c])
                        _add(ZF[1], R_i[a, b], Y[uo[i] + b, nx])
                    _add(q[i, c], P_a[c], ZF[1])
                    for e in range(c + 1):
                        _add(Q[i, e, c], P_a[e], ZF[0])
                for e in range(c):
                    Q[i, c, e] = Q[i, e, c]
        Z, Q = Q, Z
        zeta, q = q, zeta


@njit(cache=True, error_model="numpy")
def _quadraticise(
    game: GameKernels, x: Array, u: Array, t: float,
    state_regularisation: float, input_regularisation: float,
    Q: Array, q: Array, R: Array, r: Array, r_offset: Array,
) -> None:  # fmt: skip
    Q[:] = 0.0
    q[:] = 0.0
    R[:] = 0.0
    r[:] = 0.0
    for i in range(Q.shape[0]):
        own_u = part(u, game.input_offset, i)
        own_r = part(r, game.input_offset, i)
        m = own_u.shape[0]
        own_R = part(R, r_offset, i).reshape((m, m, u.shape[1]))
        for j in range(game.term_offset[i], game.term_offset[i + 1]):
            index = part(game.term_index, game.term_index_offset, j)
            params = part(game.term_params, game.term_params_offset, j)
            game.quadraticise[j](t, x, own_u, index, params, Q[i], q[i], own_R, own_r)
        for s in range(Q.shape[1]):
            Q[i, s, s] += state_regularisation
        for a in range(m):
            own_R[a, a] += input_regularisation


@njit(cache=True, error_model="numpy")
def _solve(S: Array, Y: Array) -> None:
    """Gaussian elimination with a pivot row for each lane: Y <- S^-1 Y; S is lost."""
    n, width, L = Y.shape
    factor = np.empty(L)
    for c in range(n):
        for lane in range(L):
            pivot = c
            for row in range(c + 1, n):
                if np.abs(S[row, c, lane]) > np.abs(S[pivot, c, lane]):
                    pivot = row
            if pivot != c:
                for e in range(c, n):
                    S[c, e, lane], S[pivot, e, lane] = S[pivot, e, lane], S[c, e, lane]
                for e in range(width):
                    Y[c, e, lane], Y[pivot, e, lane] = Y[pivot, e, lane], Y[c, e, lane]
        for row in range(c + 1, n):
            for lane in range(L):
                factor[lane] = S[row, c, lane] / S[c, c, lane]
            for e in range(c + 1, n):
                _subtract(S[row, e], factor, S[c, e])
            for e in range(width):
                _subtract(Y[row, e], factor, Y[c, e])
    for c in range(n - 1, -1, -1):
        for e in range(width):
            for row in range(c + 1, n):
                _subtract(Y[c, e], S[c, row], Y[row, e])
            for lane in range(L):
                Y[c, e, lane] /= S[c, c, lane]


@njit(cache=True, error_model="numpy", inline="always")
def _add(out: Array, a: Array, b: Array) -> None:
    for lane in range(out.shape[0]):
        out[lane] += a[lane] * b[lane]


@njit(cache=True, error_model="numpy", inline="always")
def _subtract(out: Array, a: Array, b: Array) -> None:
    for lane in range(out.shape[0]):
        out[lane] -= a[lane] * b[lane]


@njit(cache=True, error_model="numpy")
def _block_offsets(rows: Array, columns: Array) -> Array:
    """Where the block of each player begins in an array that holds their blocks in turn."""
    offset = np.zeros(rows.shape[0], np.int64)
    for i in range(rows.shape[0] - 1):
        size = (rows[i + 1] - rows[i]) * (columns[i + 1] - columns[i])
        offset[i + 1] = offset[i] + size
    return offset
