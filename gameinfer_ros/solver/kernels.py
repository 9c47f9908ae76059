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

from typing import NamedTuple

import numpy as np

from gameinfer_ros.games.kernels import GameKernels
from gameinfer_ros.lanes.addresses import call
from gameinfer_ros.lanes.blocks import aligned_zeros, block, length, reshaped, rows
from gameinfer_ros.lanes.compile_cache import njit
from gameinfer_ros.lanes.lanes import Array, fma
from gameinfer_ros.lanes.matrices import (
    add_transposed_product,
    add_transposed_vector,
    eliminate,
    mirror,
    sparse_product,
)
from gameinfer_ros.lanes.numbers import part


class Workspace(NamedTuple):
    """Memory of the LQ pass for one batch; the lanes are the last axis of all arrays.

    The value of a player is stored as Z above zeta', and the derivatives of its cost by the state
    as Q above q'.
    """

    A: Array  # Jacobians of the dynamics, one player after the other
    B: Array
    R: Array  # (nu nu,) and (nu,): derivatives of one player's cost by its input
    r: Array
    Z: Array  # (N, nx + 1, nx): values of all players
    Q: Array  # (N, nx + 1, nx): values one step before
    AZ: Array  # (nx, nx + 1), (nu, nx + 1) and (nu, nu) of one player
    BZ: Array
    BZB: Array
    S: Array  # (nu, nu) and (nu, nx + 1): the coupled equations S [P alpha] = Y
    Y: Array
    V: Array  # (N, nu nu) and (N, nu)
    w: Array
    left: Array  # (N, 2 nu, nx), (2 nu, nx) and (2 nu,): see `_step_back`
    right: Array
    right_column: Array
    no_input: Array  # (nu,): zeros

    @classmethod
    def of(cls, game: GameKernels) -> Workspace:
        """Create the memory for a game."""
        nx, nu, N = game.state_offset[-1], game.input_offset[-1], len(game.step)
        shapes = (
            *((game.A_offset[-1],), (game.B_offset[-1],), (nu * nu,), (nu,)),
            *((N, nx + 1, nx), (N, nx + 1, nx)),
            *((nx, nx + 1), (nu, nx + 1), (nu, nu), (nu, nu), (nu, nx + 1)),
            *((N, nu * nu), (N, nu), (N, 2 * nu, nx), (2 * nu, nx), (2 * nu,), (nu,)),
        )
        return cls(*(aligned_zeros(*shape, len(game.lanes)) for shape in shapes))


@njit(nogil=True, error_model="numpy")
def rollout(
    game: GameKernels, x_ref: Array, u_ref: Array, P: Array, alpha: Array, scale: Array,
    per_unit: Array, x: Array, u: Array, moved: Array, dx: Array,
) -> None:  # fmt: skip
    """Roll out u = u_ref - P (x - x_ref) - scale alpha from x[0].

    Writes the states x[1:], the inputs u, and the largest change of any state component against
    x_ref, times per_unit (nx,), to moved (1, width), which is nan if a component is. The shape of
    scale is (1, width). dx (nx, width) is memory for x - x_ref.
    """
    lanes = game.lanes
    x_ref, u_ref, x, u = block(x_ref, lanes), block(u_ref, lanes), block(x, lanes), block(u, lanes)
    P, alpha, scale = block(P, lanes), block(alpha, lanes), block(scale, lanes)
    moved, dx = block(moved, lanes), block(dx, lanes)
    T, nu, nx = len(u), length(u, 1), length(x, 1)
    moved[0] = 0.0
    for k in range(T + 1):
        for row in range(nx):
            dx[row] = x[k, row] - x_ref[k, row]
            moved[0] = np.maximum(moved[0], per_unit[row] * np.abs(dx[row]))
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


@njit(nogil=True, error_model="numpy")
def lq_pass(
    game: GameKernels, hessians: Array, x: Array, u: Array, first_step: int,
    state_regularisation: float, input_regularisation: float,
    P: Array, alpha: Array, workspace: Workspace,
) -> None:  # fmt: skip
    """Compute the feedback Nash strategies of the LQ game along x and u.

    Writes P and alpha. Backwards over the horizon, each step linearises the dynamics,
    quadraticises the costs (with `hessians`, see `quadraticise`, and regularisation on the
    diagonals of Q and R) and solves the coupled equations of all players, which
    `gameinfer_ros.solver.reference.solve_lq_game` states. The values
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
    lanes, N = game.lanes, len(game.step)
    x, u, P, alpha = block(x, lanes), block(u, lanes), block(P, lanes), block(alpha, lanes)
    A, B = block(workspace.A, lanes), block(workspace.B, lanes)
    R, r = block(workspace.R, lanes), block(workspace.r, lanes)
    Z, Q = block(workspace.Z, lanes), block(workspace.Q, lanes)
    AZ, BZ = block(workspace.AZ, lanes), block(workspace.BZ, lanes)
    BZB, S, Y = block(workspace.BZB, lanes), block(workspace.S, lanes), block(workspace.Y, lanes)
    V, w, left = block(workspace.V, lanes), block(workspace.w, lanes), block(workspace.left, lanes)
    right, right_column = block(workspace.right, lanes), block(workspace.right_column, lanes)
    no_input = block(workspace.no_input, lanes)

    T = len(u)
    workspace.Z[:] = 0.0
    for i in range(N):
        quadraticise(
            game, hessians, i, x[T], no_input, (first_step + T) * game.dt,
            state_regularisation, input_regularisation, Z[i], R, r,
        )  # fmt: skip
    for k in range(T - 1, -1, -1):
        linearise(game, x[k], u[k], A, B)
        for i in range(N):
            first, last = game.input_offset[i], game.input_offset[i + 1]
            V_i, left_i = _coupling(V[i], left[i], last - first)
            W_i = rows(left_i, 0, length(u, 1))
            _propagate(game, A, B, Z[i], Q[i], AZ, BZ, BZB, w[i], W_i)
            quadraticise(
                game, hessians, i, x[k], u[k], (first_step + k) * game.dt,
                state_regularisation, input_regularisation, Q[i], R, r,
            )  # fmt: skip
            _couple(first, last, R, r, BZB, w[i], W_i, S, Y, V_i)
        eliminate(S, workspace.S, Y, workspace.Y)
        _store(Y, P[k], alpha[k], right, right_column)
        for i in range(N):
            first, last = game.input_offset[i], game.input_offset[i + 1]
            V_i, left_i = _coupling(V[i], left[i], last - first)
            _step_back(first, last, V_i, w[i], left_i, right, right_column, Q[i])
        Z, Q = Q, Z


@njit(error_model="numpy")
def quadraticise(
    game: GameKernels, hessians: Array, i: int, x: Array, u: Array, t: float,
    by_state: float, by_input: float, Q: Array, R: Array, r: Array,
) -> None:  # fmt: skip
    """Add the state cost of player i at one step to Q above q', and write its R and r.

    `hessians` is `game.quadraticise` or `game.gauss_newton`. `by_state` and `by_input` are added to
    the diagonals of Q and R.
    """
    nx, first, last = len(x), game.input_offset[i], game.input_offset[i + 1]
    m = last - first
    own_R, own_r = reshaped(rows(R, 0, m * m), m, m), rows(r, 0, m)
    for row in range(nx):
        Q[row, row] += by_state
    for a in range(m):
        own_r[a] = 0.0
        for b in range(m):
            own_R[a, b] = 0.0
        own_R[a, a] = by_input
    own_u, by_xx, by_x = rows(u, first, last), rows(Q, 0, nx), Q[nx]
    for j in range(game.term_offset[i], game.term_offset[i + 1]):
        index = part(game.term_index, game.term_index_offset, j)
        params = part(game.term_params, game.term_params_offset, j)
        call(hessians[j], (t, x, own_u, index, params, by_xx, by_x, own_R, own_r))


@njit(error_model="numpy")
def linearise(game: GameKernels, x: Array, u: Array, A: Array, B: Array) -> None:
    """Write the blocks A and B of all players at one step, one player after the other."""
    for row in range(len(A)):
        A[row] = 0.0
    for row in range(len(B)):
        B[row] = 0.0
    states, inputs = game.state_offset, game.input_offset
    for i in range(len(game.linearise)):
        x_i, u_i = rows(x, states[i], states[i + 1]), rows(u, inputs[i], inputs[i + 1])
        params = part(game.dynamics_params, game.dynamics_params_offset, i)
        n, m = len(x_i), len(u_i)
        A_i = reshaped(rows(A, game.A_offset[i], game.A_offset[i + 1]), n, n)
        B_i = reshaped(rows(B, game.B_offset[i], game.B_offset[i + 1]), n, m)
        call(game.linearise[i], (game.linearised[i], x_i, u_i, game.dt, params, A_i, B_i))


@njit(error_model="numpy")
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


@njit(error_model="numpy")
def _couple(
    first: int, last: int, R: Array, r: Array, BZB: Array, w: Array, W: Array,
    S: Array, Y: Array, V: Array,
) -> None:  # fmt: skip
    """Write a player's rows of the coupled equations, and the others' columns of B' Z B to V.

    The inputs of the player are those from `first` to `last` - 1.
    """
    nu, nx = length(S, 1), length(W, 1)
    for a in range(first, last):
        for b in range(nu):
            S[a, b] = BZB[a, b]
        for b in range(first, last):
            S[a, b] += R[(a - first) * (last - first) + b - first]
        for c in range(nx):
            Y[a, c] = W[a, c]
        Y[a, nx] = w[a] + r[a - first]
    for b in range(nu):
        for a in range(first):
            V[b, a] = BZB[b, a]
        for a in range(last, nu):
            V[b, a - last + first] = BZB[b, a]


@njit(error_model="numpy")
def _store(Y: Array, P: Array, alpha: Array, right: Array, right_column: Array) -> None:
    """Copy the solution Y = [P alpha], and write -P and -alpha to the first rows of `right`."""
    nx = length(P, 1)
    for a in range(len(P)):
        for c in range(nx):
            P[a, c] = Y[a, c]
            right[a, c] = -Y[a, c]
        alpha[a] = Y[a, nx]
        right_column[a] = -Y[a, nx]


@njit(error_model="numpy")
def _step_back(
    first: int, last: int, V: Array, w: Array, left: Array, right: Array, right_column: Array,
    Q: Array,
) -> None:  # fmt: skip
    """Complete the value of a player at the step before, Q above q'.

    The missing term is left' right. The rows of `left` are W and, below, -P of the other players;
    those of `right` are -P and, below, W - V P of the other players.
    """
    nu, nx = len(w), length(left, 1)
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


@njit(error_model="numpy")
def _coupling(V: Array, left: Array, m: int) -> tuple[Array, Array]:
    """Return V (nu, others) and `left` (nu + others, nx) of a player with m inputs.

    `others` is the number of inputs of the other players.
    """
    nu = len(left) // 2
    return reshaped(rows(V, 0, nu * (nu - m)), nu, nu - m), rows(left, 0, 2 * nu - m)
