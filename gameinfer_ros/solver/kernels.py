"""Compiled passes over the horizon, for one block of particles.

Arrays carry the particle in their last axis, which is as wide as the lanes of the pass; T is the
horizon, N the number of players, nx and nu the sizes of the joint state and input:

| array | shape | meaning |
|---|---|---|
| x | (T + 1, nx, width) | states |
| u | (T, nu, width) | inputs |
| P | (T, nu, nx, width) | gains |
| alpha | (T, nu, width) | feed-forward terms |

Lanes never mix: what one particle gets does not depend on which others are in its block.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from gameinfer_ros.games.blocks import block, length, reshaped, rows
from gameinfer_ros.games.kernels import Array, GameKernels, part
from gameinfer_ros.games.lanes import fma
from gameinfer_ros.solver.matrices import add_transposed_product, eliminate


class Passes(NamedTuple):
    """The passes for one width."""

    rollout: Any
    lq_pass: Any


@cache
def passes(width: int) -> Passes:
    """The passes for blocks of `width` particles."""

    @njit(cache=True, error_model="numpy")
    def rollout(
        game: GameKernels, x_ref: Array, u_ref: Array, P: Array, alpha: Array, scale: Array,
        x: Array, u: Array, moved: Array, workspace: Array,
    ) -> None:  # fmt: skip
        """Play u = u_ref - P (x - x_ref) - scale alpha from x[0].

        Writes the states x[1:], the inputs u, and for each particle in moved (1, width) the
        largest change of any state component against x_ref (nan if one is not a number); scale
        has the shape (1, width).
        """
        _rollout(
            game,
            block(x_ref, width),
            block(u_ref, width),
            block(P, width),
            block(alpha, width),
            block(scale, width),
            block(x, width),
            block(u, width),
            block(workspace, width),
            block(moved, width),
        )

    @njit(cache=True, error_model="numpy")
    def lq_pass(
        game: GameKernels, x: Array, u: Array, first_step: int,
        state_regularisation: float, input_regularisation: float,
        P: Array, alpha: Array, workspace: Array,
    ) -> None:  # fmt: skip
        """Feedback Nash strategies of the LQ game that approximates the game along x and u.

        Goes backwards over the horizon. At each step it linearises the dynamics, quadraticises
        the costs (adding the regularisation to the diagonals of Q and R), solves the coupled
        equations

            (R_i + B_i' Z_i B_i) P_i + B_i' Z_i sum_{j != i} B_j P_j = B_i' Z_i A
            (R_i + B_i' Z_i B_i) alpha_i + B_i' Z_i sum_{j != i} B_j alpha_j = B_i' zeta_i + r_i

        for all players at once, and takes the values 1/2 dx' Z_i dx + zeta_i' dx one step back:

            F = A - sum_j B_j P_j,  beta = -sum_j B_j alpha_j
            zeta_i <- F' (zeta_i + Z_i beta) + q_i + P_i' (R_i alpha_i - r_i)
            Z_i <- F' Z_i F + Q_i + P_i' R_i P_i

        Basar and Olsder, Dynamic Noncooperative Game Theory, 2nd ed., corollary 6.1. Writes P and
        alpha.
        """
        T, nu, nx, N = u.shape[0], u.shape[1], x.shape[1], len(game.step)
        states, inputs = game.state_offset, game.input_offset
        a_offset, b_offset = _block_offsets(states, states), _block_offsets(states, inputs)
        r_offset = _block_offsets(inputs, inputs)
        nZ = N * nx * nx
        ends = np.cumsum(
            np.array(
                [
                    *(a_offset[N], b_offset[N], r_offset[N], nu, nZ, nZ, N * nx, N * nx),
                    *(nu * nx, nu * nu, nu * (nx + 1), nx * nx, nx * nx, nx, nu),
                ]
            )
        )
        memory = block(workspace, width)
        A, B = rows(memory, 0, ends[0]), rows(memory, ends[0], ends[1])
        R, r = rows(memory, ends[1], ends[2]), rows(memory, ends[2], ends[3])
        # The costs of step k are gathered in Q and q, which then become the values of step k.
        Z, Q = rows(memory, ends[3], ends[4]), rows(memory, ends[4], ends[5])
        zeta, q = rows(memory, ends[5], ends[6]), rows(memory, ends[6], ends[7])
        BZ = reshaped(rows(memory, ends[7], ends[8]), nu, nx)
        # The coupled equations S [P alpha] = [Y y], side by side.
        S = reshaped(rows(memory, ends[8], ends[9]), nu, nu)
        Y = reshaped(rows(memory, ends[9], ends[10]), nu, nx + 1)
        S_numbers = workspace[ends[8] : ends[9]].reshape((nu, nu, width))
        Y_numbers = workspace[ends[9] : ends[10]].reshape((nu, nx + 1, width))
        F = reshaped(rows(memory, ends[10], ends[11]), nx, nx)
        ZF = reshaped(rows(memory, ends[11], ends[12]), nx, nx)
        beta = rows(memory, ends[12], ends[13])
        no_input = rows(memory, ends[13], ends[14])
        for a in range(nu):
            no_input[a] = 0.0
        xs, us, Ps, alphas = block(x, width), block(u, width), block(P, width), block(alpha, width)

        _quadraticise(
            game, xs[T], no_input, (first_step + T) * game.dt,
            state_regularisation, input_regularisation, Z, zeta, R, r, r_offset,
        )  # fmt: skip
        for k in range(T - 1, -1, -1):
            _quadraticise(
                game, xs[k], us[k], (first_step + k) * game.dt,
                state_regularisation, input_regularisation, Q, q, R, r, r_offset,
            )  # fmt: skip
            _linearise(game, xs[k], us[k], A, B, a_offset, b_offset)
            _couple(game, Z, zeta, A, B, R, r, a_offset, b_offset, r_offset, BZ, S, Y)
            eliminate(S, S_numbers, Y, Y_numbers)
            _store(Y, Ps[k], alphas[k])
            _close_loop(game, A, B, a_offset, b_offset, Y, F, beta)
            for i in range(N):
                _step_back(
                    _value(Z, nx, i), rows(zeta, i * nx, (i + 1) * nx), F, beta,
                    _square(R, r_offset, inputs, i), rows(r, inputs[i], inputs[i + 1]),
                    Y, inputs[i], ZF, _value(Q, nx, i), rows(q, i * nx, (i + 1) * nx),
                )  # fmt: skip
            Z, Q = Q, Z
            zeta, q = q, zeta

    return Passes(rollout, lq_pass)


@njit(cache=True, error_model="numpy")
def _rollout(
    game: GameKernels, x_ref: Array, u_ref: Array, P: Array, alpha: Array, scale: Array,
    x: Array, u: Array, dx: Array, moved: Array,
) -> None:  # fmt: skip
    T, nu, nx = len(u), length(u, 1), length(x, 1)
    moved[0] = 0.0
    for k in range(T + 1):
        for row in range(nx):
            dx[row] = x[k, row] - x_ref[k, row]
            moved[0] = np.maximum(moved[0], np.abs(dx[row]))
        if k == T:
            return
        for a in range(nu):
            total = u_ref[k, a] - scale[0] * alpha[k, a]
            for row in range(nx):
                total = fma(-P[k, a, row], dx[row], total)
            u[k, a] = total
        for i in range(len(game.step)):
            first, last = game.state_offset[i], game.state_offset[i + 1]
            game.step[i](
                rows(x[k], first, last),
                rows(u[k], game.input_offset[i], game.input_offset[i + 1]),
                game.dt,
                part(game.dynamics_params, game.dynamics_params_offset, i),
                rows(x[k + 1], first, last),
            )


@njit(cache=True, error_model="numpy")
def _quadraticise(
    game: GameKernels, x: Array, u: Array, t: float,
    state_regularisation: float, input_regularisation: float,
    Q: Array, q: Array, R: Array, r: Array, r_offset: Array,
) -> None:  # fmt: skip
    """Costs of all players at one step: Q, q, R and r, player after player."""
    nx = len(x)
    for row in range(len(R)):
        R[row] = 0.0
    for row in range(len(r)):
        r[row] = 0.0
    for row in range(len(Q)):
        Q[row] = 0.0
    for row in range(len(q)):
        q[row] = 0.0
    for i in range(len(game.step)):
        own_Q = _value(Q, nx, i)
        for row in range(nx):
            own_Q[row, row] = state_regularisation
        first, last = game.input_offset[i], game.input_offset[i + 1]
        own_R = _square(R, r_offset, game.input_offset, i)
        for a in range(last - first):
            own_R[a, a] = input_regularisation
        for j in range(game.term_offset[i], game.term_offset[i + 1]):
            game.quadraticise[j](
                t,
                x,
                rows(u, first, last),
                part(game.term_index, game.term_index_offset, j),
                part(game.term_params, game.term_params_offset, j),
                own_Q,
                rows(q, i * nx, (i + 1) * nx),
                own_R,
                rows(r, first, last),
            )


@njit(cache=True, error_model="numpy")
def _linearise(
    game: GameKernels, x: Array, u: Array, A: Array, B: Array, a_offset: Array, b_offset: Array
) -> None:
    """Blocks A and B of all players at one step."""
    for row in range(len(A)):
        A[row] = 0.0
    for row in range(len(B)):
        B[row] = 0.0
    states, inputs = game.state_offset, game.input_offset
    for i in range(len(game.linearise)):
        game.linearise[i](
            rows(x, states[i], states[i + 1]),
            rows(u, inputs[i], inputs[i + 1]),
            game.dt,
            part(game.dynamics_params, game.dynamics_params_offset, i),
            _square(A, a_offset, states, i),
            _oblong(B, b_offset, states, inputs, i),
        )


@njit(cache=True, error_model="numpy")
def _couple(
    game: GameKernels, Z: Array, zeta: Array, A: Array, B: Array, R: Array, r: Array,
    a_offset: Array, b_offset: Array, r_offset: Array, BZ: Array, S: Array, Y: Array,
) -> None:  # fmt: skip
    """Set up the coupled equations: S (nu, nu), Y (nu, nx + 1)."""
    states, inputs = game.state_offset, game.input_offset
    N, nx = len(states) - 1, length(BZ, 1)
    for i in range(N):
        Z_i, zeta_i = _value(Z, nx, i), rows(zeta, i * nx, (i + 1) * nx)
        B_i = _oblong(B, b_offset, states, inputs, i)
        R_i = _square(R, r_offset, inputs, i)
        for a in range(inputs[i + 1] - inputs[i]):
            row = inputs[i] + a
            for c in range(nx):
                total = B_i[0, a] * Z_i[states[i], c]
                for s in range(1, len(B_i)):
                    total = fma(B_i[s, a], Z_i[states[i] + s, c], total)
                BZ[row, c] = total
            y = r[row]
            for s in range(len(B_i)):
                y = fma(B_i[s, a], zeta_i[states[i] + s], y)
            Y[row, nx] = y
            for j in range(N):
                A_j = _square(A, a_offset, states, j)
                B_j = _oblong(B, b_offset, states, inputs, j)
                for b in range(inputs[j + 1] - inputs[j]):
                    total = 0.0 * y
                    if i == j:
                        total = R_i[a, b]
                    for s in range(len(B_j)):
                        total = fma(BZ[row, states[j] + s], B_j[s, b], total)
                    S[row, inputs[j] + b] = total
                for c in range(len(A_j)):
                    total = BZ[row, states[j]] * A_j[0, c]
                    for s in range(1, len(A_j)):
                        total = fma(BZ[row, states[j] + s], A_j[s, c], total)
                    Y[row, states[j] + c] = total


@njit(cache=True, error_model="numpy")
def _store(Y: Array, P: Array, alpha: Array) -> None:
    for a in range(len(P)):
        for c in range(length(P, 1)):
            P[a, c] = Y[a, c]
        alpha[a] = Y[a, length(P, 1)]


@njit(cache=True, error_model="numpy")
def _close_loop(
    game: GameKernels, A: Array, B: Array, a_offset: Array, b_offset: Array,
    Y: Array, F: Array, beta: Array,
) -> None:  # fmt: skip
    """F = A - sum_j B_j P_j and beta = -sum_j B_j alpha_j."""
    states, inputs = game.state_offset, game.input_offset
    nx = len(F)
    for i in range(len(states) - 1):
        A_i, B_i = _square(A, a_offset, states, i), _oblong(B, b_offset, states, inputs, i)
        for s in range(len(A_i)):
            row = states[i] + s
            for c in range(nx):
                total = -B_i[s, 0] * Y[inputs[i], c]
                for a in range(1, length(B_i, 1)):
                    total = fma(-B_i[s, a], Y[inputs[i] + a, c], total)
                F[row, c] = total
            for c in range(len(A_i)):
                F[row, states[i] + c] += A_i[s, c]
            total = -B_i[s, 0] * Y[inputs[i], nx]
            for a in range(1, length(B_i, 1)):
                total = fma(-B_i[s, a], Y[inputs[i] + a, nx], total)
            beta[row] = total


@njit(cache=True, error_model="numpy")
def _step_back(
    Z: Array, zeta: Array, F: Array, beta: Array, R: Array, r: Array, Y: Array, first_input: int,
    ZF: Array, Q: Array, q: Array,
) -> None:  # fmt: skip
    """Take the value of one player one step back: Z, zeta (which is changed) -> Q, q."""
    nx, m = len(F), len(R)
    for s in range(nx):
        total = zeta[s]
        for c in range(nx):
            total = fma(Z[s, c], beta[c], total)
        zeta[s] = total
    for s in range(nx):
        for c in range(nx):
            ZF[s, c] = 0.0
    add_transposed_product(Z, F, ZF, False)  # Z is symmetric
    for c in range(nx):
        total = q[c]
        for s in range(nx):
            total = fma(F[s, c], zeta[s], total)
        for a in range(m):
            Ra, RP = -r[a], 0.0 * r[a]
            for b in range(m):
                Ra = fma(R[a, b], Y[first_input + b, nx], Ra)
                RP = fma(R[a, b], Y[first_input + b, c], RP)
            total = fma(Y[first_input + a, c], Ra, total)
            for e in range(c + 1):
                Q[e, c] = fma(Y[first_input + a, e], RP, Q[e, c])
        q[c] = total
    add_transposed_product(F, ZF, Q, True)
    for c in range(nx):
        for e in range(c):
            Q[c, e] = Q[e, c]


@njit(cache=True, error_model="numpy")
def _square(blocks: Array, offset: Array, side: Array, i: int) -> Array:
    """Player i's block of an array that holds square blocks in turn."""
    n = side[i + 1] - side[i]
    return reshaped(rows(blocks, offset[i], offset[i + 1]), n, n)


@njit(cache=True, error_model="numpy")
def _oblong(blocks: Array, offset: Array, down: Array, across: Array, i: int) -> Array:
    """Player i's block of an array that holds blocks in turn."""
    n, m = down[i + 1] - down[i], across[i + 1] - across[i]
    return reshaped(rows(blocks, offset[i], offset[i + 1]), n, m)


@njit(cache=True, error_model="numpy")
def _value(blocks: Array, nx: int, i: int) -> Array:
    """Player i's matrix (nx, nx) of an array that holds those of all players in turn."""
    return reshaped(rows(blocks, i * nx * nx, (i + 1) * nx * nx), nx, nx)


@njit(cache=True, error_model="numpy")
def _block_offsets(down: Array, across: Array) -> Array:
    """Where the block of each player begins in an array that holds their blocks in turn."""
    offset = np.zeros(len(down), np.int64)
    for i in range(len(down) - 1):
        offset[i + 1] = offset[i] + (down[i + 1] - down[i]) * (across[i + 1] - across[i])
    return offset


def workspace_rows(game: GameKernels) -> int:
    """Rows that the workspace (rows, width) of a pass needs."""
    n, m = np.diff(game.state_offset), np.diff(game.input_offset)
    nx, nu, N = int(n.sum()), int(m.sum()), len(n)
    per_player = int((n * n + n * m + m * m).sum())
    values = 2 * (N * nx * nx + N * nx)
    return per_player + values + nu * (2 * nx + nu + 3) + 2 * nx * nx + nx
