"""Games that are LQ games from the start, of players of all sizes, whose matrices have no zeros.

The kinds of dynamics and costs that come with the package leave most entries zero; those of a
user need not.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import pytest

from gameinfer_ros.games import BoundTerm, CostTerm, Dynamics, Game, Players, Vehicle
from gameinfer_ros.games.kernels import kernel
from gameinfer_ros.lanes.lanes import Array
from gameinfer_ros.solver import GameSolver, SolverSettings, Status, Strategy, best_response
from gameinfer_ros.solver.reference import LQGame, solve_lq_game

T = 7


@kernel
def linear_step(x: Array, u: Array, dt: float, params: Array, x_next: Array) -> None:
    n, m = len(x), len(u)
    for row in range(n):
        total = 0.0 * x[0]
        for c in range(n):
            total = total + params[row * n + c] * x[c]
        for c in range(m):
            total = total + params[n * n + row * m + c] * u[c]
        x_next[row] = total


@kernel
def linear_linearise(x: Array, u: Array, dt: float, params: Array, A: Array, B: Array) -> None:
    n, m = len(x), len(u)
    for row in range(n):
        for c in range(n):
            A[row, c] = params[row * n + c]
        for c in range(m):
            B[row, c] = params[n * n + row * m + c]


@kernel
def quadratic_cost(t: float, x: Array, u: Array, index: Array, params: Array) -> Array:
    n, m = len(x), len(u)
    Q, q = params[: n * n], params[n * n : n * n + n]
    R, r = params[n * n + n : n * n + n + m * m], params[n * n + n + m * m :]
    total = 0.0 * x[0]
    for a in range(n):
        total = total + q[a] * x[a]
        for b in range(n):
            total = total + 0.5 * Q[a * n + b] * x[a] * x[b]
    for a in range(m):
        total = total + r[a] * u[a]
        for b in range(m):
            total = total + 0.5 * R[a * m + b] * u[a] * u[b]
    return total


@kernel
def quadratic_quadraticise(
    t: float, x: Array, u: Array, index: Array, params: Array,
    Q: Array, q: Array, R: Array, r: Array,
) -> None:  # fmt: skip
    n, m = len(x), len(u)
    by_xx, by_x = params[: n * n], params[n * n : n * n + n]
    by_uu, by_u = params[n * n + n : n * n + n + m * m], params[n * n + n + m * m :]
    for a in range(n):
        q[a] += by_x[a]
        for b in range(n):
            Q[a, b] += by_xx[a * n + b]
            q[a] += by_xx[a * n + b] * x[b]
    for a in range(m):
        r[a] += by_u[a]
        for b in range(m):
            R[a, b] += by_uu[a * m + b]
            r[a] += by_uu[a * m + b] * u[b]


def linear(A: np.ndarray, B: np.ndarray) -> Dynamics:
    """Dynamics x_next = A x + B u."""

    class Linear(Vehicle):  # it gives no default to `kind`, and so joins no family
        state_names: ClassVar[Any] = tuple(f"x{j}" for j in range(len(A)))
        input_names: ClassVar[Any] = tuple(f"u{j}" for j in range(B.shape[1]))
        step_kernel: ClassVar[Any] = linear_step
        linearise_kernel: ClassVar[Any] = linear_linearise

        @property
        def params(self) -> tuple[float, ...]:
            return (*A.ravel(), *B.ravel())

        def poses(self, s: np.ndarray) -> Any: ...
        def twists(self, s: np.ndarray, w: np.ndarray) -> Any: ...
        def accelerations(self, w: np.ndarray) -> Any: ...
        def state(self, poses: np.ndarray, twists: np.ndarray) -> Any: ...
        def input(self, twists: np.ndarray, accelerations: np.ndarray) -> Any: ...

    return Linear(kind="linear")


def quadratic(name: str, Q: np.ndarray, q: np.ndarray, R: np.ndarray, r: np.ndarray) -> CostTerm:
    """1/2 x' Q x + q' x + 1/2 u' R u + r' u, for the player called `name`."""

    class Quadratic(CostTerm):
        cost_kernel: ClassVar[Any] = quadratic_cost
        quadraticise_kernel: ClassVar[Any] = quadratic_quadraticise

        def bind(self, players: Players, i: int) -> list[BoundTerm]:
            return [BoundTerm(self, (), (*Q.ravel(), *q, *R.ravel(), *r))]

    return Quadratic(kind="quadratic", players=(name,))


Case = tuple[Game, LQGame]


@pytest.fixture(params=[((3, 3),), ((2, 1), (3, 3)), ((3, 2), (1, 1), (2, 3))], ids=str)
def case(request: pytest.FixtureRequest) -> Case:
    """A game of players with these numbers of states and inputs, and the same as an LQ game."""
    sizes = request.param
    rng = np.random.default_rng(len(sizes))

    def definite(n: int, floor: float) -> np.ndarray:
        root = rng.normal(size=(n, n))
        return root @ root.T + floor * np.eye(n)

    nx, starts = sum(n for n, _ in sizes), np.cumsum([0] + [n for n, _ in sizes])
    names = [f"player_{i}" for i in range(len(sizes))]
    own = [(np.eye(n) + 0.3 * rng.normal(size=(n, n)), rng.normal(size=(n, m))) for n, m in sizes]
    costs = [
        (definite(nx, 0.0), rng.normal(size=nx), definite(m, 0.5), rng.normal(size=m))
        for _, m in sizes
    ]
    game = Game(
        {name: linear(*matrices) for name, matrices in zip(names, own, strict=True)},
        [quadratic(name, *parts) for name, parts in zip(names, costs, strict=True)],
        dt=0.1,
        horizon=T,
    )
    A, B = np.zeros((nx, nx)), [np.zeros((nx, m)) for _, m in sizes]
    for i, (A_i, B_i) in enumerate(own):
        rows = slice(starts[i], starts[i + 1])
        A[rows, rows], B[i][rows] = A_i, B_i

    def repeat(array: np.ndarray, times: int) -> np.ndarray:
        return np.repeat(array[None], times, axis=0)

    lq = LQGame(
        A=repeat(A, T),
        B=[repeat(B_i, T) for B_i in B],
        Q=np.array([repeat(Q, T + 1) for Q, _, _, _ in costs]),
        q=np.array([repeat(q, T + 1) for _, q, _, _ in costs]),
        R=[repeat(R, T) for _, _, R, _ in costs],
        r=[repeat(r, T) for _, _, _, r in costs],
    )
    return game, lq


def test_the_compiled_pass_gives_the_strategies_of_the_lq_game(case: Case, lq_pass: Any) -> None:
    game, lq = case
    nx, nu = game.players.n_states, game.players.n_inputs
    x, u = np.zeros((T + 1, nx, 3)), np.zeros((T, nu, 3))
    settings = SolverSettings(
        method="iterative_lq", state_regularisation=0.0, input_regularisation=0.0
    )
    P, alpha = lq_pass(game, settings, x, u, 0)
    P_expected, alpha_expected = solve_lq_game(lq)
    for lane in range(3):
        np.testing.assert_allclose(P[..., lane], P_expected, rtol=1e-8, atol=1e-9)
        np.testing.assert_allclose(alpha[..., lane], alpha_expected, rtol=1e-8, atol=1e-9)


def test_the_solver_reaches_the_equilibrium_from_anywhere_at_once(case: Case) -> None:
    game, lq = case
    rng = np.random.default_rng(0)
    x0, u = rng.normal(size=game.players.n_states), rng.normal(size=(T, game.players.n_inputs, 4))
    settings = SolverSettings(
        method="iterative_lq",
        state_regularisation=0.0,
        input_regularisation=0.0,
        first_step_size=1.0,
        max_movement=1e6,
        converged_movement=1e-7,
    )
    solution = GameSolver(game, settings).solve(x0, Strategy.from_inputs(0, x0, u))
    assert (solution.status == Status.CONVERGED).all()
    assert (solution.iterations == 2).all(), "one to get there, one to see that it is there"
    P, alpha = solve_lq_game(lq)
    x = x0
    for k in range(T):
        for particle in range(4):
            np.testing.assert_allclose(solution.strategy.x_ref[k, :, particle], x, atol=1e-8)
        now = -P[k] @ x - alpha[k]
        np.testing.assert_allclose(solution.strategy.u_ref[k, :, 0], now, atol=1e-8)
        elsewhere = rng.normal(size=len(x0))
        np.testing.assert_allclose(
            solution.strategy.inputs(k, elsewhere)[:, 0], -P[k] @ elsewhere - alpha[k], atol=1e-7
        )
        x = game.step(x, now)


@pytest.mark.parametrize("at_nash", [True, False])
def test_best_responses_are_those_of_the_quadratic_problem(case: Case, at_nash: bool) -> None:
    """Against affine strategies, a player's cost is quadratic in its inputs: one Newton step."""
    game, lq = case
    P, alpha = solve_lq_game(lq)
    rng = np.random.default_rng(2)
    if not at_nash:
        P, alpha = 0.1 * rng.normal(size=P.shape), rng.normal(size=alpha.shape)
    x0 = rng.normal(size=game.players.n_states)
    strategy = Strategy(
        0, np.zeros((T + 1, len(x0), 1)), -alpha[..., None].copy(), P[..., None].copy()
    )

    def cost(i: int, u: np.ndarray) -> float:
        states, inputs = [x0], []
        for k in range(T):
            now = -P[k] @ states[-1] - alpha[k]
            now[game.players.inputs(i)] = u[k]
            inputs.append(now)
            states.append(game.step(states[-1], now))
        return float(game.costs(np.array(states), np.array(inputs))[i].sum())

    for i, dynamics in enumerate(game.players.dynamics):
        shape = (T, dynamics.n_inputs)
        units = np.eye(T * dynamics.n_inputs).reshape(-1, *shape)
        zero = cost(i, np.zeros(shape))
        plus = np.array([cost(i, e) for e in units])
        slope = np.array([(p - cost(i, -e)) / 2 for p, e in zip(plus, units, strict=True)])
        curvature = np.array(
            [[cost(i, a + b) - p - q + zero for b, q in zip(units, plus, strict=True)]
             for a, p in zip(units, plus, strict=True)]
        )  # fmt: skip
        least = zero - 0.5 * slope @ np.linalg.solve(curvature, slope)
        found = best_response(game, x0, strategy, i)
        assert found.best_cost == pytest.approx(least, rel=1e-6, abs=1e-6)
        if at_nash:
            assert found.gap < 1e-6
        else:
            assert found.gap > 1
