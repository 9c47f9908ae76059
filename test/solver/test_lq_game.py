"""LQ games: the Nash property by brute force, and the compiled pass against the reference."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from gameinfer_ros.games import Game
from gameinfer_ros.solver import SolverSettings
from gameinfer_ros.solver.reference import LQGame, approximate, solve_lq_game

GameFactory = Callable[..., Game]


def random_lq_game(rng: np.random.Generator, sizes: tuple[int, ...], T: int, nx: int) -> LQGame:
    """An LQ game in which every player's problem is strictly convex."""

    def definite(n: int, floor: float) -> np.ndarray:
        root = rng.normal(size=(n, n))
        return root @ root.T + floor * np.eye(n)

    return LQGame(
        A=np.eye(nx) + 0.2 * rng.normal(size=(T, nx, nx)),
        B=[rng.normal(size=(T, nx, m)) for m in sizes],
        Q=np.array([[definite(nx, 0.0) for _ in range(T + 1)] for _ in sizes]),
        q=rng.normal(size=(len(sizes), T + 1, nx)),
        R=[np.array([definite(m, 0.5) for _ in range(T)]) for m in sizes],
        r=[rng.normal(size=(T, m)) for m in sizes],
    )


def own_rows(lq: LQGame, i: int) -> slice:
    ends = np.cumsum([B.shape[2] for B in lq.B])
    return slice(int(ends[i]) - lq.B[i].shape[2], int(ends[i]))


def cost(
    lq: LQGame,
    i: int,
    P: np.ndarray,
    alpha: np.ndarray,
    x: np.ndarray,
    first: int = 0,
    extra: np.ndarray | float = 0.0,
) -> float:
    """Cost of player i from the state `x` at step `first` on, with `extra` (T, m_i) added to its
    inputs, played out step by step.
    """
    T = len(lq.A)
    more = np.zeros_like(alpha)
    more[:, own_rows(lq, i)] = extra
    total = 0.0
    for k in range(first, T):
        u = -P[k] @ x - alpha[k] + more[k]
        own = u[own_rows(lq, i)]
        total += 0.5 * x @ lq.Q[i, k] @ x + lq.q[i, k] @ x
        total += 0.5 * own @ lq.R[i][k] @ own + lq.r[i][k] @ own
        x = lq.A[k] @ x + sum(B[k] @ u[own_rows(lq, j)] for j, B in enumerate(lq.B))
    return total + 0.5 * x @ lq.Q[i, T] @ x + lq.q[i, T] @ x


SIZES = [(2,), (2, 1), (1, 2, 2), (1, 1, 1, 1, 1)]


@pytest.fixture(params=SIZES, ids=str)
def solved(request: pytest.FixtureRequest) -> tuple[LQGame, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(len(request.param))
    lq = random_lq_game(rng, request.param, T=8, nx=5)
    return lq, *solve_lq_game(lq)


def test_nobody_gains_by_other_inputs(solved: tuple[LQGame, np.ndarray, np.ndarray]) -> None:
    lq, P, alpha = solved
    rng = np.random.default_rng(0)
    for i in range(len(lq.B)):
        for trial in range(40):
            x, first = rng.normal(size=5), int(rng.integers(8))
            extra = rng.normal(size=lq.r[i].shape)
            if trial % 2:
                extra[np.arange(8) != rng.integers(first, 8)] = 0.0
            at_nash = cost(lq, i, P, alpha, x, first)
            plus = cost(lq, i, P, alpha, x, first, extra)
            minus = cost(lq, i, P, alpha, x, first, -extra)
            assert min(plus, minus) > at_nash
            # The cost is quadratic in the player's inputs, so this is the exact slope.
            assert plus - minus == pytest.approx(0.0, abs=1e-9 * (abs(plus) + abs(minus)))


def test_nobody_gains_by_another_strategy(solved: tuple[LQGame, np.ndarray, np.ndarray]) -> None:
    lq, P, alpha = solved
    rng = np.random.default_rng(1)
    for i in range(len(lq.B)):
        for trial in range(40):
            x, first = rng.normal(size=5), int(rng.integers(8))
            own, size = own_rows(lq, i), 10.0 ** rng.uniform(-3, 0)
            steps = np.arange(8) >= first if trial % 2 else np.arange(8) == rng.integers(first, 8)
            P_other, alpha_other = P.copy(), alpha.copy()
            P_other[steps, own] += size * rng.normal(size=P_other[steps, own].shape)
            alpha_other[steps, own] += size * rng.normal(size=alpha_other[steps, own].shape)
            at_nash = cost(lq, i, P, alpha, x, first)
            assert cost(lq, i, P_other, alpha_other, x, first) > at_nash


def test_players_do_gain_by_agreeing() -> None:
    # Else the checks above could not tell a Nash equilibrium from a social optimum.
    lq = random_lq_game(np.random.default_rng(2), (2, 2), T=8, nx=5)
    P, alpha = solve_lq_game(lq)
    rng = np.random.default_rng(3)
    x = rng.normal(size=5)
    together = [
        sum(cost(lq, i, P, alpha + 0.02 * shift, x) for i in range(2))
        for shift in rng.normal(size=(200, *alpha.shape))
    ]
    assert min(together) < sum(cost(lq, i, P, alpha, x) for i in range(2))


def test_one_step_towards_a_shared_goal_is_one_minimisation() -> None:
    lq = random_lq_game(np.random.default_rng(4), (2, 2), T=1, nx=5)
    lq.Q[1], lq.q[1] = lq.Q[0], lq.q[0]
    B, Q, q = np.hstack([B_i[0] for B_i in lq.B]), lq.Q[0, 1], lq.q[0, 1]
    # Nobody pays for the other's input, so both minimise the sum of the costs of state and inputs.
    hessian = B.T @ Q @ B
    hessian[:2, :2] += lq.R[0][0]
    hessian[2:, 2:] += lq.R[1][0]
    P, alpha = solve_lq_game(lq)
    np.testing.assert_allclose(hessian @ P[0], B.T @ Q @ lq.A[0], rtol=1e-9)
    np.testing.assert_allclose(hessian @ alpha[0], B.T @ q + np.ravel([r[0] for r in lq.r]))


@pytest.mark.parametrize("kinds", ["u", "d", "uu", "ud", "du", "uuu", "udu", "dduu"])
def test_the_compiled_pass_agrees_with_the_reference(
    kinds: str, make_game: GameFactory, lq_pass: Any
) -> None:
    game, settings, lanes = make_game(kinds), SolverSettings(), 5
    nx, nu = game.players.n_states, game.players.n_inputs
    rng = np.random.default_rng(len(kinds))
    x, u = rng.normal(0, 1, (21, nx, lanes)), rng.normal(0, 1, (20, nu, lanes))
    P, alpha = lq_pass(game, settings, x, u, 3)
    for lane in range(lanes):
        lq = approximate(game, x[..., lane], u[..., lane], 3, settings)
        P_reference, alpha_reference = solve_lq_game(lq)
        for compiled, reference in (
            (P[..., lane], P_reference),
            (alpha[..., lane], alpha_reference),
        ):
            error = np.abs(compiled - reference).max(axis=tuple(range(1, reference.ndim)))
            size = np.abs(reference).max(axis=tuple(range(1, reference.ndim)))
            assert (error <= 1e-9 * size.max()).all()


def test_the_compiled_pass_swaps_pivots_for_each_lane(make_game: GameFactory, lq_pass: Any) -> None:
    # Rows of the coupled equations are swapped in some lanes only, when players are as close as
    # here: the Hessian of the proximity cost is indefinite and the regularisation is off.
    game, lanes = make_game("ud", radius=3.0), 8
    nx, nu = game.players.n_states, game.players.n_inputs
    rng = np.random.default_rng(0)
    x, u = rng.normal(0, 1, (21, nx, lanes)), rng.normal(0, 1, (20, nu, lanes))
    settings = SolverSettings(state_regularisation=0.0, input_regularisation=0.0)
    P, alpha = lq_pass(game, settings, x, u, 0)
    for lane in range(lanes):
        lq = approximate(game, x[..., lane], u[..., lane], 0, settings)
        P_reference, alpha_reference = solve_lq_game(lq)
        scale = np.abs(P_reference).max()
        np.testing.assert_allclose(P[..., lane], P_reference, rtol=0, atol=1e-7 * scale)
        scale = np.abs(alpha_reference).max()
        np.testing.assert_allclose(alpha[..., lane], alpha_reference, rtol=0, atol=1e-7 * scale)


def test_approximation_is_regularised_and_leaves_other_players_inputs_alone(
    make_game: GameFactory,
) -> None:
    game = make_game("ud", horizon=6)
    rng = np.random.default_rng(5)
    x, u = rng.normal(size=(7, 8)), rng.normal(size=(6, 4))
    plain = approximate(
        game, x, u, 0, SolverSettings(state_regularisation=0, input_regularisation=0)
    )
    regular = approximate(
        game, x, u, 0, SolverSettings(state_regularisation=7, input_regularisation=3)
    )
    np.testing.assert_allclose(regular.Q - plain.Q, np.broadcast_to(7 * np.eye(8), (2, 7, 8, 8)))
    for i in range(2):
        np.testing.assert_allclose(
            regular.R[i] - plain.R[i], np.broadcast_to(3 * np.eye(2), (6, 2, 2))
        )
        other = game.players.states(1 - i)
        assert not plain.B[i][:, other].any()
        assert not plain.A[:, game.players.states(i), other].any()
    np.testing.assert_array_equal(regular.q, plain.q)


def test_equations_without_a_solution_are_refused() -> None:
    lq = LQGame(
        A=np.ones((1, 1, 1)),
        B=[np.zeros((1, 1, 1))],
        Q=np.ones((1, 2, 1, 1)),
        q=np.ones((1, 2, 1)),
        R=[np.zeros((1, 1, 1))],
        r=[np.zeros((1, 1))],
    )
    with pytest.raises(np.linalg.LinAlgError):
        solve_lq_game(lq)
