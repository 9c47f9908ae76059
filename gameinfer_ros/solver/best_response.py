"""Best responses: what a player can gain by deviating from its strategy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gameinfer_ros.games import Game
from gameinfer_ros.solver.settings import SolverSettings
from gameinfer_ros.solver.strategy import Strategy

#: Standard deviation of the offset, in the units of the inputs, with which the second descent
#: starts: the first one cannot leave a saddle point.
NUDGE = 0.01

#: Step of central differences, times the magnitude of the number if that is above 1.
_H = 1e-6

#: Value of `BestResponse.reason` for a search that converged.
CONVERGED = "converged"

#: Reasons by the status of `scipy.optimize.minimize`.
_REASONS = {0: CONVERGED, 1: "iteration limit"}

#: Cost of inputs that lead to states or costs that are not finite.
_NOT_FINITE_COST = 1e150


@dataclass(frozen=True)
class BestResponse:
    """The best response of a player to the strategies of all others, as found by a local search.

    Attributes:
        player: index of the player.
        cost: its cost if it follows its own strategy.
        best_cost: its cost with the best response; `cost` if nothing better was found.
        x: joint states (T + 1, nx) with the best response.
        u: joint inputs (T, nu) with the best response.
        moved: largest distance, in m, between the player's positions with the best response and
            with its own strategy.
        evaluations: number of rollouts.
        reason: why the search ended; `converged` if both descents converged. If not, the player
            may be able to gain more.
    """

    player: int
    cost: float
    best_cost: float
    x: np.ndarray
    u: np.ndarray
    moved: float
    evaluations: int
    reason: str

    @property
    def gap(self) -> float:
        """What the player gains by the best response; 0 in a local Nash equilibrium."""
        return self.cost - self.best_cost

    @property
    def relative_gap(self) -> float:
        """The gap divided by the cost; 0 if there is nothing to gain."""
        return self.gap / abs(self.cost) if self.gap > 0 else 0.0


def best_response(
    game: Game, x0: np.ndarray, strategy: Strategy, player: int, max_iterations: int = 500
) -> BestResponse:
    """Search for inputs with which a player pays less than with its strategy.

    The player's inputs along the horizon are free. All others follow their strategies with
    feedback, so they react to the player. The search uses the dynamics and costs of the game
    itself: no linearisation, no Riccati equation and no regularisation.

    L-BFGS-B descends twice, from the inputs of the player's strategy and from a point next to
    them; the lower cost counts. The search is local, but may move far, for instance if the player
    gains by passing on the other side; see `BestResponse.moved`.

    Args:
        game: the game.
        x0: state (nx,) at the first step of the strategy's horizon.
        strategy: strategies (of one particle) of all players.
        player: index of the player.
        max_iterations: maximum number of iterations of each descent.

    Raises:
        ValueError: `strategy` does not have exactly one particle, or leads to states or costs that
            are not finite.
    """
    from scipy.optimize import minimize  # slow to import, and not needed by nodes

    if len(strategy) != 1:
        raise ValueError(f"strategy: {len(strategy)} particles are not allowed: it must have 1")
    strategy = strategy.near(strategy.first_step, x0, game.players.is_angle)
    response = _Response(game, x0, strategy, player)
    zero = np.zeros(response.size)
    x_own, u_own = response.play_out(zero)
    cost = response.cost_of(x_own, u_own)
    if not np.isfinite(cost):
        raise ValueError(f"strategy: its cost for player {player} must be finite, but is {cost}")
    nudge = NUDGE * np.random.default_rng(0).normal(size=response.size)
    bounds = {"maxiter": max_iterations, "maxfun": 4 * max_iterations}
    options = {**bounds, "ftol": 1e-9, "gtol": 1e-6, "maxcor": 20}
    with np.errstate(all="ignore"):  # the line search may try inputs that overflow
        descents = [
            minimize(
                response.cost_and_gradient, start, jac=True, method="L-BFGS-B", options=options
            )
            for start in (zero, nudge)
        ]
    best = min(descents, key=lambda descent: float(descent.fun))
    # A descent that did not converge might have found a lower cost, so its reason counts.
    decisive = next((descent for descent in descents if descent.status != 0), best)
    gained = best.fun < cost
    x, u = response.play_out(best.x) if gained else (x_own, u_own)
    rows = game.players.position_rows(player)
    return BestResponse(
        player,
        cost,
        float(best.fun) if gained else cost,
        x,
        u,
        float(np.linalg.norm((x - x_own)[:, rows], axis=1).max()),
        1 + sum(int(descent.nfev) for descent in descents),
        _REASONS.get(decisive.status, str(decisive.message).lower()),
    )


class _Response:
    """The cost of one player as a function of its inputs.

    Inputs are given as offsets (T m,) that are added to the inputs (T, m) of the player's strategy,
    feedback included. Any inputs can be expressed in this way. The search is better conditioned
    than one over the inputs themselves, because offsets of different steps hardly interact.
    """

    def __init__(self, game: Game, x0: np.ndarray, strategy: Strategy, player: int) -> None:
        self._game, self._x0, self._player = game, x0, player
        self._first_step, self._P = strategy.first_step, strategy.P[..., 0]
        self._own = game.players.inputs(player)
        self._inputs = (game.horizon, self._own.stop - self._own.start)
        from gameinfer_ros.solver.batch import Batch

        self._batch, self._flat = Batch(game, SolverSettings(), 1), strategy.flat

    @property
    def size(self) -> int:
        """Number of inputs T m."""
        return int(np.prod(self._inputs))

    def play_out(self, offsets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the states (T + 1, nx) and inputs (T, nu) of all players for offsets (T m,)."""
        lane = np.zeros(1, dtype=int)
        self._batch.load(lane, self._flat, lane)
        self._batch.u[:, self._own, 0] += offsets.reshape(self._inputs)
        self._batch.play_out(self._x0, lane)
        return self._batch.x[..., 0].copy(), self._batch.u[..., 0].copy()

    def cost_of(self, x: np.ndarray, u: np.ndarray) -> float:
        """Return the player's cost of a trajectory."""
        return float(self._game.costs(x, u, self._first_step)[self._player].sum())

    def cost_and_gradient(self, offsets: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the player's cost for offsets (T m,), and its gradient (T m,)."""
        x, u = self.play_out(offsets)
        cost = self.cost_of(x, u)
        if not np.isfinite(cost):
            return _NOT_FINITE_COST, np.zeros(self.size)
        by_x, by_u = self._cost_derivatives(x, u)
        A, B = self._step_derivatives(x[:-1], u)
        gradient = np.empty(self._inputs)
        P_own, costate = self._P[:, self._own], by_x[-1]
        for k in range(len(u) - 1, -1, -1):
            by_input = B[k].T @ costate
            gradient[k] = by_u[k] + by_input[self._own]
            costate = by_x[k] - P_own[k].T @ by_u[k] + A[k].T @ costate - self._P[k].T @ by_input
        return cost, gradient.ravel()

    def _cost_derivatives(self, x: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Differentiate the player's cost per step by x (T + 1, nx) and its own inputs (T, m)."""
        nx, m = x.shape[1], self._inputs[1]
        values = np.concatenate([x, np.zeros((len(x), u.shape[1]))], axis=1)
        values[:-1, nx:] = u
        columns = [*range(nx), *range(nx + self._own.start, nx + self._own.stop)]
        varied, h = _varied(values, [[column] for column in columns])
        costs = self._game.costs(varied[:, :nx], varied[:-1, nx:], self._first_step)[self._player]
        slopes = (costs[:, : nx + m] - costs[:, nx + m :]) / (2 * h[:, columns])
        return slopes[:, :nx], slopes[:-1, nx:]

    def _step_derivatives(self, x: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Differentiate each next state by state, A (T, nx, nx), and input, B (T, nx, nu)."""
        players, (T, nx), nu = self._game.players, x.shape, u.shape[1]
        # The dynamics of players are independent, so their j-th numbers can be varied together.
        owned = [
            [*range(*players.states(i).indices(nx)),
             *range(nx + players.inputs(i).start, nx + players.inputs(i).stop)]
            for i in range(len(players))
        ]  # fmt: skip
        longest = max(map(len, owned))
        groups = [[own[j] for own in owned if j < len(own)] for j in range(longest)]
        varied, h = _varied(np.concatenate([x, u], axis=1), groups)
        particles = np.moveaxis(varied, 0, -1).reshape(nx + nu, -1)
        after = self._game.step(particles[:nx], particles[nx:]).reshape(nx, 2 * longest, T)
        differences = after[:, :longest] - after[:, longest:]
        slopes = np.zeros((T, nx, nx + nu))
        for i, own in enumerate(owned):
            rows = players.states(i)
            for j, column in enumerate(own):
                slopes[:, rows, column] = differences[rows, j].T / (2 * h[:, column, None])
        return slopes[:, :, :nx], slopes[:, :, nx:]


def _varied(values: np.ndarray, groups: list[list[int]]) -> tuple[np.ndarray, np.ndarray]:
    """Vary G groups of columns of rows (S, n) for central differences.

    Returns the varied rows (S, n, 2 G), G with one group increased and G with it decreased, and
    the steps (S, n).
    """
    h = _H * np.maximum(1.0, np.abs(values))
    varied = np.repeat(values[..., None], 2 * len(groups), axis=-1)
    for j, group in enumerate(groups):
        varied[:, group, j] += h[:, group]
        varied[:, group, len(groups) + j] -= h[:, group]
    return varied, h
