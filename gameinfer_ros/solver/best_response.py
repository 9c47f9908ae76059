"""Best responses: what a player can gain by other inputs, if the others react as they would."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gameinfer_ros.games import Game
from gameinfer_ros.solver.batch import Batch
from gameinfer_ros.solver.settings import SolverSettings
from gameinfer_ros.solver.strategy import Strategy

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

#: The second descent begins off the player's own inputs by so much (a standard deviation, in the
#: units of the inputs): from a saddle point, the first one does not get anywhere.
NUDGE = 0.01

#: Half the distance of central differences, times the size of the number if that is above 1.
_H = 1e-6

#: The reason of a search that found what it looked for; with any other, it gave up.
CONVERGED = "converged"

#: Why a search ends, by the status that it ends with.
_REASONS = {0: CONVERGED, 1: "iteration limit"}

#: The cost of inputs under which the game is left for numbers that are not finite.
_LOST = 1e150


@dataclass(frozen=True)
class BestResponse:
    """The cheapest that a player was found to do while all others keep to their strategies.

    Attributes:
        player: index of the player.
        cost: what it pays if it keeps to its own strategy too.
        best_cost: the least it pays with any other inputs that were found; `cost` if there are
            none.
        x: joint states (T + 1, nx) if it responds best.
        u: joint inputs (T, nu) then.
        moved: how far, in m, that moves the player at most from where its strategy takes it.
        evaluations: how often the game was played out.
        reason: why the search ended, in words; `converged` if both descents did, or else there may
            be more to gain.
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
        """What the player gains: 0 in a local Nash equilibrium."""
        return self.cost - self.best_cost

    @property
    def relative_gap(self) -> float:
        """The gap as a share of the cost; 0 where nothing is to be gained."""
        return self.gap / abs(self.cost) if self.gap > 0 else 0.0


def best_response(
    game: Game, x0: np.ndarray, strategy: Strategy, player: int, max_iterations: int = 500
) -> BestResponse:
    """Search for inputs that cost a player less than those of its strategy.

    The player's inputs along the horizon are free. All others play their strategies, feedback
    included, so they react to where it goes. Dynamics and costs are those of the game, not their
    approximations: no linearisation, no Riccati equation and no regularisation takes part.

    The search descends by L-BFGS-B twice, from the inputs of the player's strategy and from next
    to them, and takes the cheaper end. It is local, but nothing keeps it near: where the player
    gains by passing on the other side, it may get there, which `moved` tells.

    Args:
        game: the game.
        x0: state (nx,) at the first step of the strategy's horizon.
        strategy: strategies (of one particle) of all players.
        player: index of the player.
        max_iterations: of each descent.

    Raises:
        ValueError: there is not one particle, or the strategy leads to states or costs that are
            not finite.
    """
    if len(strategy) != 1:
        raise ValueError(f"strategy: has {len(strategy)} particles; 1 is needed")
    response = _Response(game, x0, strategy, player)
    nothing = np.zeros(response.size)
    x_own, u_own = response.play_out(nothing)
    cost = response.cost_of(x_own, u_own)
    if not np.isfinite(cost):
        raise ValueError(f"strategy: costs player {player} {cost}, which is not finite")
    nudge = NUDGE * np.random.default_rng(0).normal(size=response.size)
    ends = [_descend(response, start, max_iterations) for start in (nothing, nudge)]
    end = min(ends, key=lambda end: float(end.fun))
    # A descent that gave up might have come to a cheaper end yet.
    last = next((other for other in ends if other.status != 0), end)
    gained = end.fun < cost
    x, u = response.play_out(end.x) if gained else (x_own, u_own)
    rows = game.players.position_rows(player)
    return BestResponse(
        player,
        cost,
        float(end.fun) if gained else cost,
        x,
        u,
        float(np.linalg.norm((x - x_own)[:, rows], axis=1).max()),
        1 + sum(int(end.nfev) for end in ends),
        _REASONS.get(last.status, str(last.message).lower()),
    )


def _descend(response: _Response, start: np.ndarray, max_iterations: int) -> OptimizeResult:
    from scipy.optimize import minimize  # takes long, and nodes do not need it

    with np.errstate(all="ignore"):  # the line search may try inputs that nobody can play
        return minimize(
            response.cost_and_gradient,
            start,
            jac=True,
            method="L-BFGS-B",
            options={
                "maxiter": max_iterations,
                "maxfun": 4 * max_iterations,
                "ftol": 1e-9,
                "gtol": 1e-6,
                "maxcor": 20,
            },
        )


class _Response:
    """What inputs of one player cost it.

    Its inputs (T, m) are told by what they add (T m,) to those of its strategy in the state it
    gets to. Any inputs can be told so, and a search among them is better conditioned: what is
    added at one step hardly matters to what is best to add at another.
    """

    def __init__(self, game: Game, x0: np.ndarray, strategy: Strategy, player: int) -> None:
        self._game, self._x0, self._player = game, x0, player
        self._first_step, self._P = strategy.first_step, strategy.P[..., 0]
        self._own = game.players.inputs(player)
        self._inputs = (game.horizon, self._own.stop - self._own.start)
        self._block, self._flat = Batch(game, SolverSettings(), 1), strategy.flat

    @property
    def size(self) -> int:
        """Number of inputs T m."""
        return int(np.prod(self._inputs))

    def play_out(self, added: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """States (T + 1, nx) and inputs (T, nu) of all players if this is added (T m,)."""
        lane = np.zeros(1, dtype=int)
        self._block.load(lane, self._flat, lane)
        self._block.u[:, self._own, 0] += added.reshape(self._inputs)
        self._block.play_out(self._x0, lane)
        return self._block.x[..., 0].copy(), self._block.u[..., 0].copy()

    def cost_of(self, x: np.ndarray, u: np.ndarray) -> float:
        """What a trajectory costs the player."""
        return float(self._game.costs(x, u, self._first_step)[self._player].sum())

    def cost_and_gradient(self, added: np.ndarray) -> tuple[float, np.ndarray]:
        """What the player pays if this is added (T m,), and its gradient (T m,)."""
        x, u = self.play_out(added)
        cost = self.cost_of(x, u)
        if not np.isfinite(cost):
            return _LOST, np.zeros(self.size)
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
        """Derivatives of the player's cost per step by x (T + 1, nx) and own inputs (T, m)."""
        nx, m = x.shape[1], self._inputs[1]
        values = np.concatenate([x, np.zeros((len(x), u.shape[1]))], axis=1)
        values[:-1, nx:] = u
        columns = [*range(nx), *range(nx + self._own.start, nx + self._own.stop)]
        varied, h = _varied(values, [[column] for column in columns])
        costs = self._game.costs(varied[:, :nx], varied[:-1, nx:], self._first_step)[self._player]
        slopes = (costs[:, : nx + m] - costs[:, nx + m :]) / (2 * h[:, columns])
        return slopes[:, :nx], slopes[:-1, nx:]

    def _step_derivatives(self, x: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives A (T, nx, nx) and B (T, nx, nu) of each next state by state and input."""
        players, (T, nx), nu = self._game.players, x.shape, u.shape[1]
        # No player drives another, so the j-th numbers of all can be varied at once.
        owned = [
            [*range(*players.states(i).indices(nx)),
             *range(nx + players.inputs(i).start, nx + players.inputs(i).stop)]
            for i in range(len(players))
        ]  # fmt: skip
        longest = max(map(len, owned))
        groups = [[own[j] for own in owned if j < len(own)] for j in range(longest)]
        varied, h = _varied(np.concatenate([x, u], axis=1), groups)
        flat = np.moveaxis(varied, 0, -1).reshape(nx + nu, -1, T)
        particles = np.ascontiguousarray(flat.reshape(nx + nu, -1))
        after = self._game.step(particles[:nx], particles[nx:]).reshape(nx, 2 * longest, T)
        differences = after[:, :longest] - after[:, longest:]
        slopes = np.zeros((T, nx, nx + nu))
        for i, own in enumerate(owned):
            rows = players.states(i)
            for j, column in enumerate(own):
                slopes[:, rows, column] = differences[rows, j].T / (2 * h[:, column, None])
        return slopes[:, :, :nx], slopes[:, :, nx:]


def _varied(values: np.ndarray, groups: list[list[int]]) -> tuple[np.ndarray, np.ndarray]:
    """Rows of numbers (S, n), with those of one group a little larger, or smaller.

    Returns:
        Rows (S, n, 2 G), first G with one group larger each, then G with it smaller; and by how
        much (S, n).
    """
    h = _H * np.maximum(1.0, np.abs(values))
    varied = np.repeat(values[..., None], 2 * len(groups), axis=-1)
    for j, group in enumerate(groups):
        varied[:, group, j] += h[:, group]
        varied[:, group, len(groups) + j] -= h[:, group]
    return varied, h
