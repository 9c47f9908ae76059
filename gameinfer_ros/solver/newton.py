"""Compiled passes for Newton's method on the stationarity of all players, for one batch.

The gains P of the strategies u = v - P x are constant here. Player i is then stationary if

    g_i = B_i' lambda_i + r_i = 0,  lambda_i <- F' lambda_i + q_i - P_i' r_i,  F = A - B P,

at every step: no change of its offsets v_i, to which all players react with P, changes its cost to
first order. That is a system of equations without a discontinuity where a cost term begins to act,
in contrast to the iteration of LQ games, whose gains jump there.

Shapes are those of `gameinfer_ros.solver.kernels`.
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
from gameinfer_ros.solver.kernels import linearise, quadraticise


class NewtonWorkspace(NamedTuple):
    """Memory of the passes for one batch; the lanes are the last axis of all arrays.

    H contains, for each player j, the second derivatives (N, n + m, n + m) of its dynamics, times
    the costates of each player.
    """

    A: Array  # as in `gameinfer_ros.solver.kernels.Workspace`
    B: Array
    R: Array
    r: Array
    L: Array  # (N, nx + 1, nx): derivative of the costates by the state, above the costate's step
    Q: Array  # (N, nx + 1, nx): the same one step before
    q: Array  # (nx + 1, nx): the last row contains q of one player, the others are not used
    AL: Array  # (nx, nx + 1)
    BL: Array  # (nu, nx + 1)
    xu: Array  # (nx, nu)
    uu: Array  # (N, nu, nu)
    S: Array
    Y: Array
    left: Array  # (N, 2 nu, nx): -P and M_xu', see `newton_pass`
    right: Array  # (2 nu, nx)
    right_column: Array  # (2 nu,)
    w: Array  # (N, nu): B' times the costates' step
    now: Array  # (N, nx): costates
    H: Array
    c: Array  # (N nx,): costates of one player's states
    no_input: Array
    alive: Array  # (N, 1): 1 until a pivot that is not positive is found, then 0

    @classmethod
    def of(cls, game: GameKernels) -> NewtonWorkspace:
        """Create the memory for a game."""
        nx, nu, N = game.state_offset[-1], game.input_offset[-1], len(game.step)
        sizes = np.diff(game.state_offset) + np.diff(game.input_offset)
        shapes = (
            *((game.A_offset[-1],), (game.B_offset[-1],), (nu * nu,), (nu,)),
            *((N, nx + 1, nx), (N, nx + 1, nx), (nx + 1, nx)),
            *((nx, nx + 1), (nu, nx + 1), (nx, nu), (N, nu, nu)),
            *((nu, nu), (nu, nx + 1), (N, 2 * nu, nx), (2 * nu, nx), (2 * nu,), (N, nu)),
            *((N, nx), (N * (sizes**2).sum(),), (N * nx,), (nu,), (N, 1)),
        )
        return cls(*(aligned_zeros(*shape, len(game.lanes)) for shape in shapes))


@njit(nogil=True, error_model="numpy")
def stationarity(
    game: GameKernels, x: Array, u: Array, P: Array, first_step: int,
    g: Array, unit: Array, costate: Array, size: Array, largest: Array, squares: Array,
    workspace: NewtonWorkspace,
) -> None:  # fmt: skip
    """Compute the residuals of stationarity along x and u.

    To compare inputs with different units, residuals are divided by the square root of the
    curvature of the player's cost by that input, which is positive if every input has a cost.

    Writes

    - g (T, nu, width): the residuals g_i of all players,
    - unit (T, nu, width): the divisors of the residuals below,
    - costate (T, N, nx, width): the costates lambda_i after each step,
    - size (N, width): the largest sum of the magnitudes of the two terms of a residual,
    - largest (N, width): the largest magnitude of a residual,
    - squares (N, width): the sum of the squares of the residuals.
    """
    lanes, N = game.lanes, len(game.step)
    x, u, P = block(x, lanes), block(u, lanes), block(P, lanes)
    g, unit = block(g, lanes), block(unit, lanes)
    costate, size = block(costate, lanes), block(size, lanes)
    largest, squares = block(largest, lanes), block(squares, lanes)
    A, B = block(workspace.A, lanes), block(workspace.B, lanes)
    R, r, q = block(workspace.R, lanes), block(workspace.r, lanes), block(workspace.q, lanes)
    now, w, no_input = (
        block(workspace.now, lanes),
        block(workspace.w, lanes),
        block(workspace.no_input, lanes),
    )
    T, nx, nu = len(u), length(x, 1), length(u, 1)
    for i in range(N):
        size[i], largest[i], squares[i] = 0.0, 0.0, 0.0
        for row in range(nx):
            q[nx, row] = 0.0
        quadraticise(
            game,
            game.gauss_newton,
            i,
            x[T],
            no_input,
            (first_step + T) * game.dt,
            0.0,
            0.0,
            q,
            R,
            r,
        )
        for row in range(nx):
            now[i, row] = q[nx, row]
    for k in range(T - 1, -1, -1):
        linearise(game, x[k], u[k], A, B)
        for i in range(N):
            first, last = game.input_offset[i], game.input_offset[i + 1]
            for row in range(nx):
                q[nx, row] = 0.0
            quadraticise(
                game,
                game.gauss_newton,
                i,
                x[k],
                u[k],
                (first_step + k) * game.dt,
                0.0,
                0.0,
                q,
                R,
                r,
            )
            for row in range(nx):
                costate[k, i, row] = now[i, row]
            _sparse_vector(game.B_items, game.B_columns, B, now[i], w[i])
            for a in range(first, last):
                own = r[a - first]
                curvature = R[(a - first) * (last - first) + a - first]
                unit[k, a] = np.where(curvature > 0.0, np.sqrt(curvature), 1.0)
                residual = w[i, a] + own
                scaled = residual / unit[k, a]
                size[i] = np.maximum(size[i], (np.abs(w[i, a]) + np.abs(own)) / unit[k, a])
                largest[i] = np.maximum(largest[i], np.abs(scaled))
                squares[i] = fma(scaled, scaled, squares[i])
                g[k, a] = residual
                w[i, a] = residual
            # Adds -P' (B' lambda + r), in which r belongs to the player's own inputs.
            _sparse_vector(game.A_items, game.A_columns, A, costate[k, i], now[i])
            for a in range(nu):
                for row in range(nx):
                    now[i, row] = fma(-w[i, a], P[k, a, row], now[i, row])
            for row in range(nx):
                now[i, row] += q[nx, row]


@njit(nogil=True, error_model="numpy")
def newton_pass(
    game: GameKernels, x: Array, u: Array, P: Array, first_step: int, g: Array, costate: Array,
    K: Array, alpha: Array, workspace: NewtonWorkspace,
) -> None:  # fmt: skip
    """Compute the step du = -K dx - alpha of all players that makes them stationary to first order.

    With M = [Hxx + A' L A, ...] the second derivatives of each player's Hamiltonian by the states
    and inputs of all, where L_i is the derivative of lambda_i by the state and H contains the
    second derivatives of cost and dynamics, the steps solve

        (M_uu)_i [K alpha] = [(M_ux)_i, g_i + B_i' l_i],  i = 1, ..., N,
        L_i <- M_xx - P' M_ux - (M_xu - P' M_uu) K,
        l_i <- F' l_i - (M_xu - P' M_uu) alpha.

    L is not symmetric, because the gains P are not those of the step.
    """
    lanes, N = game.lanes, len(game.step)
    x, u, P, g = block(x, lanes), block(u, lanes), block(P, lanes), block(g, lanes)
    costate, K, alpha = block(costate, lanes), block(K, lanes), block(alpha, lanes)
    A, B = block(workspace.A, lanes), block(workspace.B, lanes)
    R, r = block(workspace.R, lanes), block(workspace.r, lanes)
    L, Q = block(workspace.L, lanes), block(workspace.Q, lanes)
    AL, BL, xu = block(workspace.AL, lanes), block(workspace.BL, lanes), block(workspace.xu, lanes)
    uu, S, Y = block(workspace.uu, lanes), block(workspace.S, lanes), block(workspace.Y, lanes)
    left, right = block(workspace.left, lanes), block(workspace.right, lanes)
    right_column, w = block(workspace.right_column, lanes), block(workspace.w, lanes)
    H, c = block(workspace.H, lanes), block(workspace.c, lanes)
    no_input = block(workspace.no_input, lanes)
    T, nx, nu = len(u), length(x, 1), length(u, 1)
    workspace.L[:] = 0.0
    for i in range(N):
        quadraticise(
            game,
            game.quadraticise,
            i,
            x[T],
            no_input,
            (first_step + T) * game.dt,
            0.0,
            0.0,
            L[i],
            R,
            r,
        )
        for row in range(nx):
            L[i, nx, row] = 0.0
    for k in range(T - 1, -1, -1):
        linearise(game, x[k], u[k], A, B)
        _curve(game, x[k], u[k], costate[k], H, c)
        for i in range(N):
            first, last = game.input_offset[i], game.input_offset[i + 1]
            M_ux = rows(right, 0, nu)
            _hamiltonian(
                game, i, x[k], u[k], (first_step + k) * game.dt, A, B, R, r, L[i], H,
                Q[i], M_ux, rows(left[i], nu, 2 * nu), uu[i], AL, BL, xu,
            )  # fmt: skip
            for row in range(nx):
                Q[i, nx, row] = AL[row, nx]
            for a in range(nu):
                w[i, a] = BL[a, nx]
                for row in range(nx):
                    left[i, a, row] = M_ux[a, row]
            for a in range(first, last):
                for b in range(nu):
                    S[a, b] = uu[i, a, b]
                for row in range(nx):
                    Y[a, row] = M_ux[a, row]
                Y[a, nx] = g[k, a] + w[i, a]
        eliminate(S, workspace.S, Y, workspace.Y)
        for a in range(nu):
            for row in range(nx):
                K[k, a, row] = Y[a, row]
            alpha[k, a] = Y[a, nx]
        for i in range(N):
            # The rows of `left` become -P and M_xu', those of `right` M_ux - M_uu K and -K.
            for a in range(nu):
                total = w[i, a]
                for b in range(nu):
                    total = fma(-uu[i, a, b], alpha[k, b], total)
                right_column[a], right_column[nu + a] = total, -alpha[k, a]
                for row in range(nx):
                    right[a, row], left[i, a, row] = left[i, a, row], -P[k, a, row]
                    right[nu + a, row] = -K[k, a, row]
            for a in range(nu):
                for b in range(nu):
                    S[b, a] = uu[i, a, b]
            add_transposed_product(S, rows(right, nu, 2 * nu), rows(right, 0, nu), False)
            add_transposed_product(left[i], right, rows(Q[i], 0, nx), False)
            add_transposed_vector(left[i], right_column, Q[i, nx])
        L, Q = Q, L


@njit(nogil=True, error_model="numpy")
def curvature_pass(
    game: GameKernels, x: Array, u: Array, P: Array, first_step: int, costate: Array,
    K: Array, away: Array, pivot: Array, step: Array, workspace: NewtonWorkspace,
) -> None:  # fmt: skip
    """Test whether each player's own problem, with the gains of the others, has a minimum here.

    That is the case if the Hessian M_ii of its cost-to-go by its own inputs is positive definite
    at every step. Backwards over the horizon, Z_i is the second derivative of the cost-to-go by
    the state:

        Y = M_ux - M_uu P_others,  K_i = M_ii^-1 Y_i,
        Z_i <- M_xx - P_others' Y - M_xu P_others - Y_i' K_i.

    Writes

    - K (T, nu, nx, width): the best reactions K_i of all players,
    - pivot (N, 1, width): the first pivot of M_ii that is not positive, backwards in time, or the
      smallest one; relative to the input cost,
    - step (N, 1, width): its step,
    - away (T, nu, width): where player i has no minimum, the only step that is not 0 contains a
      direction v of its inputs. With s v, and K_i afterwards, its cost changes by -s^2 / 2 to
      second order.
    """
    lanes, N = game.lanes, len(game.step)
    x, u, P, costate = block(x, lanes), block(u, lanes), block(P, lanes), block(costate, lanes)
    K, away = block(K, lanes), block(away, lanes)
    pivot, step = block(pivot, lanes), block(step, lanes)
    A, B = block(workspace.A, lanes), block(workspace.B, lanes)
    R, r = block(workspace.R, lanes), block(workspace.r, lanes)
    L, Q = block(workspace.L, lanes), block(workspace.Q, lanes)
    AL, BL, xu = block(workspace.AL, lanes), block(workspace.BL, lanes), block(workspace.xu, lanes)
    uu, S, Y = block(workspace.uu, lanes), block(workspace.S, lanes), block(workspace.Y, lanes)
    left, right = block(workspace.left, lanes), block(workspace.right, lanes)
    H, c = block(workspace.H, lanes), block(workspace.c, lanes)
    no_input, alive = block(workspace.no_input, lanes), block(workspace.alive, lanes)
    T, nx, nu = len(u), length(x, 1), length(u, 1)
    workspace.L[:] = 0.0
    for i in range(N):
        quadraticise(
            game,
            game.quadraticise,
            i,
            x[T],
            no_input,
            (first_step + T) * game.dt,
            0.0,
            0.0,
            L[i],
            R,
            r,
        )
        pivot[i, 0], step[i, 0], alive[i, 0] = np.inf, float(T), 1.0
    for k in range(T - 1, -1, -1):
        linearise(game, x[k], u[k], A, B)
        _curve(game, x[k], u[k], costate[k], H, c)
        for i in range(N):
            first, last = game.input_offset[i], game.input_offset[i + 1]
            m, M_ux = last - first, rows(right, 0, nu)
            _hamiltonian(
                game, i, x[k], u[k], (first_step + k) * game.dt, A, B, R, r,
                L[i], H, Q[i], M_ux, rows(left[i], nu, 2 * nu), uu[i], AL, BL, xu,
            )  # fmt: skip
            # The rows of `left` become -P_others and M_xu', those of `right` Y and -P_others.
            for a in range(nu):
                for row in range(nx):
                    gain = P[k, a, row]
                    if first <= a < last:
                        gain = 0.0 * gain
                    left[i, a, row] = -gain
                    right[nu + a, row] = -gain
                for b in range(nu):
                    S[b, a] = uu[i, a, b]
            add_transposed_product(S, rows(right, nu, 2 * nu), rows(right, 0, nu), False)
            add_transposed_product(left[i], right, rows(Q[i], 0, nx), False)
            for a in range(m):
                for b in range(m):
                    S[a, b] = uu[i, first + a, first + b]
                for row in range(nx):
                    Y[a, row] = right[first + a, row]
            _eliminate_in_order(S, Y, m)
            _note_pivots(S, R, m, k, rows(away[k], first, last), c, alive[i], pivot[i], step[i])
            for a in range(m - 1, -1, -1):
                for row in range(nx):
                    total = Y[a, row]
                    for b in range(a + 1, m):
                        total = fma(-S[a, b], K[k, first + b, row], total)
                    K[k, first + a, row] = total / S[a, a]
            for a in range(m):
                for row in range(nx):
                    Y[a, row] = -K[k, first + a, row]
                Y[a, nx] = 0.0 * S[a, a]
            upper = rows(Q[i], 0, nx)
            add_transposed_product(rows(right, first, last), rows(Y, 0, m), Q[i], False)
            mirror(upper)  # or rounding errors that are not symmetric would grow
        L, Q = Q, L


@njit(error_model="numpy")
def _eliminate_in_order(S: Array, Y: Array, m: int) -> None:
    """Eliminate the first m rows of S and Y without pivoting.

    The factors replace the elements of S below the diagonal.
    """
    for a in range(m):
        for b in range(a + 1, m):
            factor = S[b, a] / S[a, a]
            S[b, a] = factor
            for e in range(a + 1, m):
                S[b, e] = fma(-factor, S[a, e], S[b, e])
            for row in range(length(Y, 1)):
                Y[b, row] = fma(-factor, Y[a, row], Y[b, row])


@njit(error_model="numpy")
def _note_pivots(
    S: Array, R: Array, m: int, k: int, away: Array, v: Array, alive: Array, pivot: Array,
    step: Array,
) -> None:  # fmt: skip
    """Write the first pivot of S that is not positive, and the direction that it belongs to."""
    for a in range(m):
        away[a] = 0.0
    for a in range(m):
        relative = S[a, a] / R[a * m + a]
        fails = np.where(S[a, a] > 0.0, 0.0 * alive[0], alive[0])
        # The direction v solves V' v = e_a, with the factors V.
        v[a] = 1.0
        for c in range(a - 1, -1, -1):
            total = 0.0 * relative
            for b in range(c + 1, a + 1):
                total = fma(-S[b, c], v[b], total)
            v[c] = total
        size = np.sqrt(np.maximum(np.abs(S[a, a]), 1e-6 * R[a * m + a]))
        for c in range(a + 1):
            away[c] = np.where(fails > 0.0, v[c] / size, away[c])
        pivot[0] = np.where(
            fails > 0.0,
            relative,
            np.where(alive[0] > 0.0, np.minimum(pivot[0], relative), pivot[0]),
        )
        step[0] = np.where(fails > 0.0, float(k), step[0])
        alive[0] = alive[0] - fails


@njit(error_model="numpy")
def _hamiltonian(
    game: GameKernels, i: int, x: Array, u: Array, t: float,
    A: Array, B: Array, R: Array, r: Array, L: Array, H: Array,
    xx: Array, ux: Array, xu_transposed: Array, uu: Array, AL: Array, BL: Array, xu: Array,
) -> None:  # fmt: skip
    """Write the second derivatives M of player i's Hamiltonian by the states and inputs of all.

    L (nx + 1, nx) is the derivative of its costate after the step above a row l'. A' l is written
    to the last column of AL, and B' l to that of BL.
    """
    nx, first, last = len(x), game.input_offset[i], game.input_offset[i + 1]
    m = last - first
    upper = rows(xx, 0, nx)
    # (L A)' and (L B)' first, then A' L A, B' L A, A' L B and B' L B.
    sparse_product(game.A_items, game.A_columns, A, L, AL, False)
    sparse_product(game.B_items, game.B_columns, B, L, BL, False)
    sparse_product(game.A_items, game.A_columns, A, AL, upper, False)
    sparse_product(game.B_items, game.B_columns, B, AL, ux, False)
    sparse_product(game.A_items, game.A_columns, A, BL, xu, False)
    sparse_product(game.B_items, game.B_columns, B, BL, uu, False)
    quadraticise(game, game.quadraticise, i, x, u, t, 0.0, 0.0, xx, R, r)
    for a in range(m):
        for b in range(m):
            uu[first + a, first + b] += R[a * m + b]
    _add_curvature(game, i, H, upper, ux, xu, uu)
    for a in range(len(ux)):
        for row in range(nx):
            xu_transposed[a, row] = xu[row, a]


@njit(nogil=True, error_model="numpy")
def offsets_pass(
    game: GameKernels, x: Array, u: Array, P: Array, K: Array, alpha: Array,
    workspace: NewtonWorkspace,
) -> None:  # fmt: skip
    """Replace alpha by -dv, the step of the offsets of u = v - P x, along the linear dynamics."""
    lanes = game.lanes
    x, u, P = block(x, lanes), block(u, lanes), block(P, lanes)
    K, alpha = block(K, lanes), block(alpha, lanes)
    A, B = block(workspace.A, lanes), block(workspace.B, lanes)
    q, du = block(workspace.q, lanes), block(workspace.w, lanes)[0]
    dx, dx_next = q[0], q[1]
    nx, nu, states, inputs = length(x, 1), length(u, 1), game.state_offset, game.input_offset
    for row in range(nx):
        dx[row] = 0.0
    for k in range(len(u)):
        linearise(game, x[k], u[k], A, B)
        for a in range(nu):
            total, offset = -alpha[k, a], 0.0 * alpha[k, a]
            for row in range(nx):
                total = fma(-K[k, a, row], dx[row], total)
                offset = fma(P[k, a, row], dx[row], offset)
            du[a] = total
            alpha[k, a] = -(total + offset)
        for i in range(len(game.step)):
            n, m = states[i + 1] - states[i], inputs[i + 1] - inputs[i]
            A_i = reshaped(rows(A, game.A_offset[i], game.A_offset[i + 1]), n, n)
            B_i = reshaped(rows(B, game.B_offset[i], game.B_offset[i + 1]), n, m)
            for row in range(n):
                total = 0.0 * dx[0]
                for column in range(n):
                    total = fma(A_i[row, column], dx[states[i] + column], total)
                for column in range(m):
                    total = fma(B_i[row, column], du[inputs[i] + column], total)
                dx_next[states[i] + row] = total
        dx, dx_next = dx_next, dx


@njit(nogil=True, error_model="numpy")
def agreement(lanes: Array, a: Array, b: Array, unit: Array, cosine: Array) -> None:
    """Write the cosines (1, width) of the angles between feed-forward terms (T, nu, width).

    `unit` (T, nu, width) multiplies the terms; see `stationarity`.
    """
    a, b, unit, cosine = block(a, lanes), block(b, lanes), block(unit, lanes), block(cosine, lanes)
    ab, aa, bb = 0.0 * a[0, 0], 0.0 * a[0, 0], 0.0 * a[0, 0]
    for k in range(len(a)):
        for j in range(length(a, 1)):
            one, other = unit[k, j] * a[k, j], unit[k, j] * b[k, j]
            ab = fma(one, other, ab)
            aa = fma(one, one, aa)
            bb = fma(other, other, bb)
    cosine[0] = ab / np.sqrt(aa * bb)


@njit(error_model="numpy")
def _sparse_vector(items: Array, columns: Array, values: Array, vector: Array, out: Array) -> None:
    """Write M' vector to out, for a sparse matrix M; see `sparse_product`."""
    for c in range(len(out)):
        total = 0.0 * vector[0]
        for item in range(columns[c], columns[c + 1]):
            total = fma(values[items[item, 0]], vector[items[item, 1]], total)
        out[c] = total


@njit(error_model="numpy")
def _curve(game: GameKernels, x: Array, u: Array, costate: Array, H: Array, c: Array) -> None:
    """Write the second derivatives of the dynamics of all players, times all costates."""
    states, inputs, start, N = game.state_offset, game.input_offset, 0, len(game.step)
    for j in range(N):
        n, size = states[j + 1] - states[j], states[j + 1] - states[j] + inputs[j + 1] - inputs[j]
        for i in range(N):
            for row in range(n):
                c[i * n + row] = costate[i, states[j] + row]
        x_j, u_j = rows(x, states[j], states[j + 1]), rows(u, inputs[j], inputs[j + 1])
        params = part(game.dynamics_params, game.dynamics_params_offset, j)
        costates = reshaped(rows(c, 0, N * n), N, n)
        end = start + N * size * size
        H_j = reshaped(rows(H, start, end), N, size * size)
        call(game.curve[j], (game.curved[j], x_j, u_j, game.dt, params, costates, H_j))
        start = end


@njit(error_model="numpy")
def _add_curvature(
    game: GameKernels, i: int, H: Array, xx: Array, ux: Array, xu: Array, uu: Array
) -> None:
    """Add the second derivatives of all dynamics, times the costates of player i."""
    start, N = 0, len(game.step)
    for j in range(N):
        x0, n = game.state_offset[j], game.state_offset[j + 1] - game.state_offset[j]
        u0, m = game.input_offset[j], game.input_offset[j + 1] - game.input_offset[j]
        size = n + m
        first = start + i * size * size
        own = reshaped(rows(H, first, first + size * size), size, size)
        for a in range(n):
            for b in range(n):
                xx[x0 + a, x0 + b] += own[a, b]
            for b in range(m):
                xu[x0 + a, u0 + b] += own[a, n + b]
                ux[u0 + b, x0 + a] += own[n + b, a]
        for a in range(m):
            for b in range(m):
                uu[u0 + a, u0 + b] += own[n + a, n + b]
        start += N * size * size
