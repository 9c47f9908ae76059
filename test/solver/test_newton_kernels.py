"""The passes of Newton's method, against finite differences of the players' costs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from solving import GameFactory, HeadOn, Start, random_inputs

from gameinfer_ros.games import Game
from gameinfer_ros.lanes.blocks import WIDE
from gameinfer_ros.solver import GameSolver, SolverSettings, Strategy, newton_search
from gameinfer_ros.solver.newton import (
    NewtonWorkspace,
    newton_pass,
    offsets_pass,
    stationarity,
)
from gameinfer_ros.solver.reference import rollout


class Point(NamedTuple):
    """Trajectories and gains of WIDE particles."""

    game: Game
    x: np.ndarray
    u: np.ndarray
    P: np.ndarray

    def moved(self, offsets: np.ndarray) -> Point:
        """Add offsets (T, nu, W) to u = u_ref - P (x - x_ref)."""
        game = self.game
        parts = [
            rollout(game, self.x[0, :, w], *(a[..., w] for a in (self.x, self.u, self.P, -offsets)))
            for w in range(self.x.shape[2])
        ]
        x, u = (np.ascontiguousarray(np.stack(a, axis=-1)) for a in zip(*parts, strict=True))
        return self._replace(x=x, u=u)

    def costs(self) -> np.ndarray:
        """Costs (N, W) of the players."""
        return self.game.costs(self.x, self.u, 3).sum(axis=1)

    def residuals(self) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (T, nu, W) and costates (T, N, nx, W)."""
        kernels, N = self.game.kernels(WIDE, exact=True), len(self.game.players)
        g, unit = np.full_like(self.u, np.nan), np.full_like(self.u, np.nan)
        costate = np.full((len(self.u), N, *self.x.shape[1:]), np.nan)
        sizes = np.full((3, N, WIDE), np.nan)
        workspace = NewtonWorkspace.of(kernels)
        stationarity(kernels, self.x, self.u, self.P, 3, g, unit, costate, *sizes, workspace)
        for i in range(N):
            inputs = self.game.players.inputs(i)
            own = g[:, inputs] / unit[:, inputs]
            np.testing.assert_allclose(sizes[1, i], np.abs(own).max(axis=(0, 1)))
            np.testing.assert_allclose(sizes[2, i], (own**2).sum(axis=(0, 1)))
        assert (sizes[0] >= sizes[1]).all()
        return g, costate


@pytest.fixture(params=["uu", "ud", "udu"])
def point(request: pytest.FixtureRequest, make_game: GameFactory, start: Start) -> Point:
    """Trajectories of random inputs, close to each other, and random gains."""
    game = make_game(request.param, horizon=12, radius=2.0)
    nx, nu = game.players.n_states, game.players.n_inputs
    u = random_inputs(game, WIDE)
    P = np.random.default_rng(1).normal(0, 0.1, (game.horizon, nu, nx, WIDE))
    at = np.repeat(start(game)[:, None], WIDE, axis=1) * 0.3
    x = np.zeros((game.horizon + 1, nx, WIDE))
    x[0] = at
    for k in range(game.horizon):
        x[k + 1] = game.step(x[k], u[k])
    return Point(game, x, u, P)


def test_the_residual_is_the_gradient_of_each_players_cost_by_its_offsets(point: Point) -> None:
    g, _ = point.residuals()
    h = 1e-5
    for i in range(len(point.game.players)):
        for a in range(point.game.players.n_inputs)[point.game.players.inputs(i)]:
            for k in (0, 5, 11):
                offset = np.zeros_like(point.u)
                offset[k, a] = h
                change = point.moved(offset).costs()[i] - point.moved(-offset).costs()[i]
                np.testing.assert_allclose(g[k, a], change / (2 * h), rtol=1e-5, atol=1e-4)


def test_a_newton_step_removes_the_residual_to_first_order(point: Point) -> None:
    g, costate = point.residuals()
    kernels = point.game.kernels(WIDE, exact=True)
    K, alpha = np.full_like(point.P, np.nan), np.full_like(point.u, np.nan)
    workspace = NewtonWorkspace.of(kernels)
    newton_pass(kernels, point.x, point.u, point.P, 3, g, costate, K, alpha, workspace)
    offsets_pass(kernels, point.x, point.u, point.P, K, alpha, workspace)
    h = 1e-6 / np.abs(alpha).max()
    moved, _ = point.moved(-h * alpha).residuals()
    back, _ = point.moved(h * alpha).residuals()
    np.testing.assert_allclose((moved - back) / (2 * h), -g, atol=1e-4 * np.abs(g).max())


def own_hessian(point: Point, i: int, w: int) -> np.ndarray:
    """Second derivatives of a player's cost by its inputs at all steps, the others reacting."""
    game, h = point.game, 1e-3
    own = game.players.inputs(i)
    x, u, P = (a[..., w].copy() for a in (point.x, point.u, point.P))
    P[:, own] = 0.0
    shape = u[:, own].shape

    def cost(offsets: np.ndarray) -> float:
        alpha = np.zeros_like(u)
        alpha[:, own] = -offsets.reshape(shape)
        x_new, u_new = rollout(game, x[0], x, u, P, alpha)
        return float(game.costs(x_new[..., None], u_new[..., None], 0)[i].sum())

    n = shape[0] * shape[1]
    steps = h * np.eye(n)
    H = np.zeros((n, n))
    for a in range(n):
        for b in range(a + 1):
            plus = cost(steps[a] + steps[b]) + cost(-steps[a] - steps[b])
            minus = cost(steps[a] - steps[b]) + cost(steps[b] - steps[a])
            H[a, b] = H[b, a] = (plus - minus) / (4 * h * h)
    return H


def test_pivots_are_positive_where_the_hessian_of_the_players_own_problem_is(
    head_on: HeadOn, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(newton_search, "_ESCAPES", np.zeros(0))
    game, x0 = head_on(horizon=10)
    u = random_inputs(game, WIDE, size=1.0)
    u[..., :3] = 0.0  # straight on
    solver = GameSolver(game, SolverSettings(method="newton", tolerance=1e-8))
    solution = solver.solve(x0, Strategy.from_inputs(0, x0, u))
    arrays = (np.ascontiguousarray(a) for a in solution.strategy.arrays)
    point = Point(game, *arrays)
    found = set()
    for w in np.flatnonzero(solution.residual <= 1e-8):
        for i in range(2):
            lowest = np.linalg.eigvalsh(own_hessian(point, i, w))[0]
            assert (solution.pivot[i, w] > 0) == (lowest > 0)
            found.add(bool(lowest > 0))
    assert found == {True, False}
