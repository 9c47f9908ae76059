"""A game: players, their cost terms, and a grid of time steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gameinfer_ros.games.costs.cost_term import BoundTerm, CostTerm
from gameinfer_ros.games.dynamics.dynamics import Dynamics
from gameinfer_ros.games.kernels import GameKernels
from gameinfer_ros.games.players import Players


class Game:
    """A general-sum differential game on a grid of time steps.

    Over a horizon of T steps from step k0, player i minimises the sum of its cost terms at
    (x_k, u_k) for k = k0, ..., k0 + T - 1, plus its cost at the last state x_{k0 + T} without
    input. The time of step k is k dt since the start of the run.

    Args:
        dynamics: dynamics of each player by its name; the first player is the robot.
        costs: cost terms; each applies to the players it names.
        dt: length of a time step, in s.
        horizon: number of steps T.
        radii: radius of players by their names, in m; that of the others is 0.

    Attributes:
        players: the players.
        dt: length of a time step, in s.
        horizon: number of steps T.
        terms: the cost terms of each player, bound to this game.

    Raises:
        ValueError: there is no player, `dt` or `horizon` is not positive, a radius is invalid, or a
            cost term does not fit the players. The message starts with the field, such as
            `costs[1].weights`.
    """

    def __init__(
        self,
        dynamics: Mapping[str, Dynamics],
        costs: Sequence[CostTerm],
        dt: float,
        horizon: int,
        radii: Mapping[str, float] | None = None,
    ) -> None:
        if not dt > 0:
            raise ValueError(f"dt: {dt} is not allowed: it must be above 0")
        if not horizon >= 1:
            raise ValueError(f"horizon: {horizon} is not allowed: it must be at least 1")
        self.players = Players(dynamics, radii)
        self.dt = dt
        self.horizon = horizon
        self._kernels: dict[tuple[int, bool], GameKernels] = {}
        self.terms: list[list[BoundTerm]] = [[] for _ in dynamics]
        for j, term in enumerate(costs):
            try:
                for i in term.players_in(self.players):
                    self.terms[i] += term.bind(self.players, i)
            except ValueError as error:
                raise ValueError(f"costs[{j}].{error}") from None

    def kernels(self, width: int, exact: bool = False) -> GameKernels:
        """Return the compiled game for `width` lanes.

        The first call compiles the kernels that Numba's disk cache does not contain.

        Args:
            width: number of lanes.
            exact: whether it contains all derivatives of the kernels `step`, of first and second
                order, instead of the kernels `linearise`.
        """
        if (width, exact) not in self._kernels:
            dynamics = self.players.dynamics
            from gameinfer_ros.games.tables import tabulate

            self._kernels[width, exact] = tabulate(self.dt, dynamics, self.terms, width, exact)
        return self._kernels[width, exact]

    def costs(self, x: np.ndarray, u: np.ndarray, first_step: int = 0) -> np.ndarray:
        """Compute the cost of each player at each step of a trajectory.

        Args:
            x: states (S, nx), or (S, nx, K) for K particles.
            u: inputs (S, nu) or (S, nu, K). It may be one step shorter; the last state then has no
                input, as at the end of a horizon.
            first_step: step of x[0].

        Returns:
            Costs (N, S) or (N, S, K).
        """
        padded = np.zeros((len(x), *u.shape[1:]))
        padded[: len(u)] = u
        from gameinfer_ros.games import evaluation

        shape = (len(self.players), len(x))
        return evaluation.in_blocks(self.kernels, evaluation.costs, shape, x, padded, first_step)

    def plain_costs(self, x: np.ndarray, u: np.ndarray, first_step: int = 0) -> np.ndarray:
        """Compute the same as `costs` for one trajectory, without compiling anything.

        Args:
            x: states (S, nx).
            u: inputs (S, nu).
            first_step: step of x[0].

        Returns:
            Costs (N, S).
        """
        out = np.zeros((len(self.players), len(x)))
        for i, terms in enumerate(self.terms):
            own = u[:, self.players.inputs(i)]
            for term in terms:
                cost = type(term.term).cost_kernel
                index, params = np.array(term.index, np.int64), np.array(term.params, float)
                for k in range(len(x)):
                    out[i, k] += cost((first_step + k) * self.dt, x[k], own[k], index, params)
        return out

    def step(self, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Simulate one time step.

        Args:
            x: joint state (nx,), or (nx, K) for K particles.
            u: joint input (nu,) or (nu, K).

        Returns:
            The joint state (nx,) or (nx, K) one step later.
        """
        from gameinfer_ros.games import evaluation

        return evaluation.in_blocks(self.kernels, evaluation.step, (self.players.n_states,), x, u)
