"""LQ games: the Nash property by brute force, and the compiled pass against the reference."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from solving import GameFactory

from gameinfer_ros.games import Game
from gameinfer_ros.solver import SolverSettings
from gameinfer_ros.solver.reference import LQGame, approximate, solve_lq_game


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


def test_no_player_gains_by_other_inputs(solved: tuple[LQGame, np.ndarray, np.ndarray]) -> None:
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
            # The cost is quadratic in the player's inputs, so this is the exact slope: no other
            # inputs from here on are better, and thus no other strategy is.
            assert plus - minus == pytest.approx(0.0, abs=1e-9 * (abs(plus) + abs(minus)))


def test_one_step_towards_a_shared_goal_is_one_minimisation() -> None:
    lq = random_lq_game(np.random.default_rng(4), (2, 2), T=1, nx=5)
    lq.Q[1], lq.q[1] = lq.Q[0], lq.q[0]
    B, Q, q = np.hstack([B_i[0] for B_i in lq.B]), lq.Q[0, 1], lq.q[0, 1]
    # No player pays for the other's input, so both minimise the sum of all costs.
    hessian = B.T @ Q @ B
    hessian[:2, :2] += lq.R[0][0]
    hessian[2:, 2:] += lq.R[1][0]
    P, alpha = solve_lq_game(lq)
    np.testing.assert_allclose(hessian @ P[0], B.T @ Q @ lq.A[0], rtol=1e-9)
    np.testing.assert_allclose(hessian @ alpha[0], B.T @ q + np.ravel([r[0] for r in lq.r]))


def assert_same_pass(
    found: Any,
    game: Game,
    settings: SolverSettings,
    x: np.ndarray,
    u: np.ndarray,
    step: int,
    tolerance: float,
) -> None:
    """Of each particle: P and alpha are those of the reference, relative to the largest item."""
    for lane in range(x.shape[2]):
        lq = approximate(game, x[..., lane], u[..., lane], step, settings)
        for compiled, reference in zip(found, solve_lq_game(lq), strict=True):
            atol = tolerance * np.abs(reference).max()
            np.testing.assert_allclose(compiled[..., lane], reference, rtol=0, atol=atol)


@pytest.mark.parametrize("kinds", ["u", "d", "uu", "ud", "du", "uuu", "udu", "dduu"])
def test_the_compiled_pass_agrees_with_the_reference(
    kinds: str, make_game: GameFactory, lq_pass: Any
) -> None:
    game, settings, lanes = make_game(kinds), SolverSettings(), 5
    nx, nu = game.players.n_states, game.players.n_inputs
    rng = np.random.default_rng(len(kinds))
    x, u = rng.normal(0, 1, (21, nx, lanes)), rng.normal(0, 1, (20, nu, lanes))
    assert_same_pass(lq_pass(game, settings, x, u, 3), game, settings, x, u, 3, 1e-9)


def test_the_compiled_pass_swaps_pivots_for_each_lane(make_game: GameFactory, lq_pass: Any) -> None:
    # Rows of the coupled equations are swapped in some lanes only, when players are as close as
    # here: the Hessian of the proximity cost is indefinite and the regularisation is off.
    game, lanes = make_game("ud", radius=3.0), 8
    nx, nu = game.players.n_states, game.players.n_inputs
    rng = np.random.default_rng(0)
    x, u = rng.normal(0, 1, (21, nx, lanes)), rng.normal(0, 1, (20, nu, lanes))
    settings = SolverSettings(state_regularisation=0.0, input_regularisation=0.0)
    assert_same_pass(lq_pass(game, settings, x, u, 0), game, settings, x, u, 0, 1e-7)


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
