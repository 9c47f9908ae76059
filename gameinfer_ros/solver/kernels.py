"""Compiled passes over the horizon, for one batch of particles.

The particle is the last axis of all arrays; its length `width` is the number of lanes. T is the
horizon, N the number of players, nx and nu the sizes of the joint state and input:

| array | shape | meaning |
|---|---|---|
| x | (T + 1, nx, width) | states |
| u | (T, nu, width) | inputs |
| P | (T, nu, nx, width) | gains |
| alpha | (T, nu, width) | feed-forward terms |

Lanes are independent: the result for one particle does not depend on the others in its batch.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from gameinfer_ros.games.kernels import GameKernels
from gameinfer_ros.lanes.addresses import call
from gameinfer_ros.lanes.blocks import block, length, reshaped, rows
from gameinfer_ros.lanes.lanes import Array, fma
from gameinfer_ros.lanes.matrices import (
    add_transposed_product,
    add_transposed_vector,
    eliminate,
    mirror,
    sparse_product,
)
from gameinfer_ros.lanes.numbers import part


class Passes(NamedTuple):
    """The compiled passes for one width."""

    rollout: Any
    lq_pass: Any


@cache
def passes(width: int) -> Passes:
    """Return the passes for batches of `width` particles."""

    @njit(cache=True, nogil=True, error_model="numpy")
    def rollout(
        game: GameKernels, x_ref: Array, u_ref: Array, P: Array, alpha: Array, scale: Array,
        x: Array, u: Array, moved: Array, workspace: Array,
    ) -> None:  # fmt: skip
        """Roll out u = u_ref - P (x - x_ref) - scale alpha from x[0].

        Writes the states x[1:], the inputs u, and the largest change of any state component
        against x_ref to moved (1, width), which is nan if a component is. The shape of scale is
        (1, width).
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

    @njit(cache=True, nogil=True, error_model="numpy")
    def lq_pass(
        game: GameKernels, x: Array, u: Array, first_step: int,
        state_regularisation: float, input_regularisation: float,
        P: Array, alpha: Array, workspace: Array,
    ) -> None:  # fmt: skip
        """Compute the feedback Nash strategies of the LQ game along x and u.

        Writes P and alpha. Backwards over the horizon, each step linearises the dynamics,
        quadraticises the costs (with regularisation on the diagonals of Q and R) and solves the
        coupled equations of all players

            (R_i + B_i' Z_i B_i) P_i + B_i' Z_i sum_{j != i} B_j P_j = B_i' Z_i A
            (R_i + B_i' Z_i B_i) alpha_i + B_i' Z_i sum_{j != i} B_j alpha_j = B_i' zeta_i + r_i

        (Basar and Olsder, Dynamic Noncooperative Game Theory, 2nd ed., corollary 6.1). The values
        1/2 dx' Z_i dx + zeta_i' dx of the step before are then

            F = A - sum_j B_j P_j,  beta = -sum_j B_j alpha_j
            zeta_i <- F' (zeta_i + Z_i beta) + q_i + P_i' (R_i alpha_i - r_i)
            Z_i <- F' Z_i F + Q_i + P_i' R_i P_i

        By the coupled equations, B_i' Z_i F = R_i P_i and B_i' (zeta_i + Z_i beta) =
        R_i alpha_i - r_i, so the terms with P_i' on the left cancel. With W_i = B' Z_i A,
        V_i = B' Z_i B and w_i = B' zeta_i for the inputs of all players, this becomes

            Z_i <- Q_i + A' Z_i A - W_i' P - sum_{j != i} P_j' (W_i - V_i P)_j
            zeta_i <- q_i + A' zeta_i - W_i' alpha - sum_{j != i} P_j' (w_i - V_i alpha)_j

        A and B are sparse, so the products with P take nearly all of the time.
        """
        T, nu, nx, N = u.shape[0], u.shape[1], x.shape[1], len(game.step)
        ends = np.cumsum(_row_counts(game))
        memory = block(workspace, width)
        A, B = rows(memory, 0, ends[0]), rows(memory, ends[0], ends[1])
        R, r = rows(memory, ends[1], ends[2]), rows(memory, ends[2], ends[3])
        # A player's value is stored as Z above zeta'. The costs of step k, Q above q', are
        # accumulated in the memory of the values of step k.
        Z, Q = rows(memory, ends[3], ends[4]), rows(memory, ends[4], ends[5])
        AZ = reshaped(rows(memory, ends[5], ends[6]), nx, nx + 1)
        BZ = reshaped(rows(memory, ends[6], ends[7]), nu, nx + 1)
        BZB = reshaped(rows(memory, ends[7], ends[8]), nu, nu)
        # The coupled equations S [P alpha] = [Y y], side by side.
        S = reshaped(rows(memory, ends[8], ends[9]), nu, nu)
        Y = reshaped(rows(memory, ends[9], ends[10]), nu, nx + 1)
        S_numbers = workspace[ends[8] : ends[9]].reshape((nu, nu, width))
        Y_numbers = workspace[ends[9] : ends[10]].reshape((nu, nx + 1, width))
        V, w = rows(memory, ends[10], ends[11]), rows(memory, ends[11], ends[12])
        left = rows(memory, ends[12], ends[13])
        right = reshaped(rows(memory, ends[13], ends[14]), 2 * nu, nx)
        right_column = rows(memory, ends[14], ends[15])
        no_input = rows(memory, ends[15], ends[16])
        for a in range(nu):
            no_input[a] = 0.0
        xs, us, Ps, alphas = block(x, width), block(u, width), block(P, width), block(alpha, width)

        for row in range(len(Z)):
            Z[row] = 0.0
        for i in range(N):
            _quadraticise(
                game, i, xs[T], no_input, (first_step + T) * game.dt,
                state_regularisation, input_regularisation, _value(Z, nx, i), R, r,
            )  # fmt: skip
        for k in range(T - 1, -1, -1):
            _linearise(game, xs[k], us[k], A, B)
            for i in range(N):
                own_Q = _value(Q, nx, i)
                own_V, own_w, own_left = _coupling(game, V, w, left, i)
                own_W = rows(own_left, 0, nu)
                _propagate(game, A, B, _value(Z, nx, i), own_Q, AZ, BZ, BZB, own_w, own_W)
                _quadraticise(
                    game, i, xs[k], us[k], (first_step + k) * game.dt,
                    state_regularisation, input_regularisation, own_Q, R, r,
                )  # fmt: skip
                _couple(game, i, R, r, BZB, own_w, own_W, S, Y, own_V)
            eliminate(S, S_numbers, Y, Y_numbers)
            _store(Y, Ps[k], alphas[k], right, right_column)
            for i in range(N):
                own_V, own_w, own_left = _coupling(game, V, w, left, i)
                _step_back(game, i, own_V, own_w, own_left, right, right_column, _value(Q, nx, i))
            Z, Q = Q, Z

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
            own = rows(u[k], game.input_offset[i], game.input_offset[i + 1])
            params = part(game.dynamics_params, game.dynamics_params_offset, i)
            x_i, x_next_i = rows(x[k], first, last), rows(x[k + 1], first, last)
            call(game.step[i], (x_i, own, game.dt, params, x_next_i))


@njit(cache=True, error_model="numpy")
def _quadraticise(
    game: GameKernels, i: int, x: Array, u: Array, t: float,
    state_regularisation: float, input_regularisation: float, Q: Array, R: Array, r: Array,
) -> None:  # fmt: skip
    """Add the state cost of player i at one step to Q above q', and write its R and r."""
    nx, first, last = len(x), game.input_offset[i], game.input_offset[i + 1]
    own_R, own_r = _square(R, game.R_offset, game.input_offset, i), rows(r, first, last)
    for row in range(nx):
        Q[row, row] += state_regularisation
    for a in range(last - first):
        own_r[a] = 0.0
        for b in range(last - first):
            own_R[a, b] = 0.0
        own_R[a, a] = input_regularisation
    own_u, by_xx, by_x = rows(u, first, last), rows(Q, 0, nx), Q[nx]
    for j in range(game.term_offset[i], game.term_offset[i + 1]):
        index = part(game.term_index, game.term_index_offset, j)
        params = part(game.term_params, game.term_params_offset, j)
        call(game.quadraticise[j], (t, x, own_u, index, params, by_xx, by_x, own_R, own_r))


@njit(cache=True, error_model="numpy")
def _linearise(game: GameKernels, x: Array, u: Array, A: Array, B: Array) -> None:
    """Write the blocks A and B of all players at one step, one player after the other."""
    for row in range(len(A)):
        A[row] = 0.0
    for row in range(len(B)):
        B[row] = 0.0
    states, inputs = game.state_offset, game.input_offset
    for i in range(len(game.linearise)):
        x_i, u_i = rows(x, states[i], states[i + 1]), rows(u, inputs[i], inputs[i + 1])
        params = part(game.dynamics_params, game.dynamics_params_offset, i)
        A_i = _square(A, game.A_offset, states, i)
        B_i = reshaped(
            rows(B, game.B_offset[i], game.B_offset[i + 1]), len(x_i), inputs[i + 1] - inputs[i]
        )
        call(game.linearise[i], (x_i, u_i, game.dt, params, A_i, B_i))


@njit(cache=True, error_model="numpy")
def _propagate(
    game: GameKernels, A: Array, B: Array, Z: Array,
    Q: Array, AZ: Array, BZ: Array, BZB: Array, w: Array, W: Array,
) -> None:  # fmt: skip
    """Compute the products of a player's value with the dynamics.

    Writes A' Z A (upper triangle) above zeta' A to Q, B' Z B to BZB, B' zeta to w, B' Z A to W.
    """
    nx = len(AZ)
    # Z is symmetric, so Z above zeta' is the transpose of [Z zeta].
    sparse_product(game.A_items, game.A_columns, A, Z, AZ, False)
    sparse_product(game.B_items, game.B_columns, B, Z, BZ, False)
    sparse_product(game.A_items, game.A_columns, A, AZ, rows(Q, 0, nx), True)
    sparse_product(game.B_items, game.B_columns, B, AZ, W, False)
    sparse_product(game.B_items, game.B_columns, B, BZ, BZB, False)
    for c in range(nx):
        Q[nx, c] = AZ[c, nx]
    for a in range(len(w)):
        w[a] = BZ[a, nx]


@njit(cache=True, error_model="numpy")
def _couple(
    game: GameKernels, i: int, R: Array, r: Array, BZB: Array, w: Array, W: Array,
    S: Array, Y: Array, V: Array,
) -> None:  # fmt: skip
    """Write player i's rows of the coupled equations, and the others' columns of B' Z B to V."""
    nu, nx = length(S, 1), length(W, 1)
    first, last = game.input_offset[i], game.input_offset[i + 1]
    own_R = _square(R, game.R_offset, game.input_offset, i)
    for a in range(first, last):
        for b in range(nu):
            S[a, b] = BZB[a, b]
        for b in range(first, last):
            S[a, b] += own_R[a - first, b - first]
        for c in range(nx):
            Y[a, c] = W[a, c]
        Y[a, nx] = w[a] + r[a]
    for b in range(nu):
        for a in range(first):
            V[b, a] = BZB[b, a]
        for a in range(last, nu):
            V[b, a - last + first] = BZB[b, a]


@njit(cache=True, error_model="numpy")
def _store(Y: Array, P: Array, alpha: Array, right: Array, right_column: Array) -> None:
    """Copy the solution Y = [P alpha], and write -P and -alpha to the first rows of `right`."""
    nx = length(P, 1)
    for a in range(len(P)):
        for c in range(nx):
            P[a, c] = Y[a, c]
            right[a, c] = -Y[a, c]
        alpha[a] = Y[a, nx]
        right_column[a] = -Y[a, nx]


@njit(cache=True, error_model="numpy")
def _step_back(
    game: GameKernels, i: int, V: Array, w: Array, left: Array, right: Array, right_column: Array,
    Q: Array,
) -> None:  # fmt: skip
    """Complete the value of player i at the step before, Q above q'.

    The missing term is left' right. The rows of `left` are W and, below, -P of the other players;
    those of `right` are -P and, below, W - V P of the other players.
    """
    nu, nx = len(w), length(left, 1)
    first, last = game.input_offset[i], game.input_offset[i + 1]
    for a in range(nu):
        if not first <= a < last:
            row = nu + (a if a < first else a - (last - first))
            right_column[row] = w[a]
            for c in range(nx):
                left[row, c] = right[a, c]
                right[row, c] = left[a, c]
    others = rows(right, nu, len(left))
    add_transposed_product(V, rows(right, 0, nu), others, False)
    add_transposed_vector(V, rows(right_column, 0, nu), rows(right_column, nu, len(left)))
    upper = rows(Q, 0, nx)
    add_transposed_product(left, rows(right, 0, len(left)), upper, True)
    mirror(upper)
    add_transposed_vector(left, right_column, Q[nx])


@njit(cache=True, error_model="numpy")
def _coupling(
    game: GameKernels, V: Array, w: Array, left: Array, i: int
) -> tuple[Array, Array, Array]:
    """Return player i's part of V (nu, others), w (nu,) and `left` (nu + others, nx).

    `others` is the number of inputs of the other players.
    """
    nx, nu = game.state_offset[-1], game.input_offset[-1]
    others = nu - (game.input_offset[i + 1] - game.input_offset[i])
    start, height = i * 2 * nu * nx, nu + others
    return (
        reshaped(rows(V, i * nu * nu, i * nu * nu + nu * others), nu, others),
        rows(w, i * nu, (i + 1) * nu),
        reshaped(rows(left, start, start + height * nx), height, nx),
    )


@njit(cache=True, error_model="numpy")
def _square(blocks: Array, offset: Array, side: Array, i: int) -> Array:
    """Return player i's block of an array of square blocks."""
    n = side[i + 1] - side[i]
    return reshaped(rows(blocks, offset[i], offset[i + 1]), n, n)


@njit(cache=True, error_model="numpy")
def _value(blocks: Array, nx: int, i: int) -> Array:
    """Return player i's value (nx + 1, nx) of an array of the values of all players."""
    size = (nx + 1) * nx
    return reshaped(rows(blocks, i * size, (i + 1) * size), nx + 1, nx)


@njit(cache=True)
def _row_counts(game: GameKernels) -> Array:
    """Return the number of workspace rows of each array of the LQ pass."""
    nx, nu, N = game.state_offset[-1], game.input_offset[-1], len(game.step)
    return np.array(
        [
            *(game.A_offset[N], game.B_offset[N], game.R_offset[N], nu),
            *(N * (nx + 1) * nx, N * (nx + 1) * nx),
            *(nx * (nx + 1), nu * (nx + 1), nu * nu),
            *(nu * nu, nu * (nx + 1), N * nu * nu, N * nu),
            *(N * 2 * nu * nx, 2 * nu * nx, 2 * nu, nu),
        ]
    )


def workspace_rows(game: GameKernels) -> int:
    """Return the number of rows of the workspace (rows, width) of a pass."""
    return int(_row_counts(game).sum())
