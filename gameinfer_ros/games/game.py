"""A game: players, their cost terms, and a grid of time steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gameinfer_ros.games.costs.cost_term import BoundTerm, CostTerm
from gameinfer_ros.games.dynamics.dynamics import Dynamics
from gameinfer_ros.games.kernels import GameKernels, tabulate
from gameinfer_ros.games.players import Players
from gameinfer_ros.lanes.addresses import call, call_for_lanes
from gameinfer_ros.lanes.blocks import block, from_blocks, in_blocks, rows
from gameinfer_ros.lanes.compile_cache import njit
from gameinfer_ros.lanes.lanes import Array
from gameinfer_ros.lanes.numbers import part


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

    Attributes:
        players: the players.
        dt: length of a time step, in s.
        horizon: number of steps T.
        terms: the cost terms of each player, bound to this game.

    Raises:
        ValueError: there is no player, `dt` or `horizon` is not positive, or a cost term does not
            fit the players. The message starts with the field, such as `costs[1].weights`.
    """

    def __init__(
        self,
        dynamics: Mapping[str, Dynamics],
        costs: Sequence[CostTerm],
        dt: float,
        horizon: int,
    ) -> None:
        if not dt > 0:
            raise ValueError(f"dt: {dt} is not allowed: it must be above 0")
        if not horizon >= 1:
            raise ValueError(f"horizon: {horizon} is not allowed: it must be at least 1")
        self.players = Players(dynamics)
        self.dt = dt
        self.horizon = horizon
        self._kernels: dict[int, GameKernels] = {}
        self.terms: list[list[BoundTerm]] = [[] for _ in dynamics]
        for j, term in enumerate(costs):
            try:
                for i in term.players_in(self.players):
                    self.terms[i] += term.bind(self.players, i)
            except ValueError as error:
                raise ValueError(f"costs[{j}].{error}") from None

    def kernels(self, width: int) -> GameKernels:
        """Return the compiled game for `width` lanes.

        The first call compiles the kernels that Numba's disk cache does not contain.
        """
        if width not in self._kernels:
            dynamics = self.players.dynamics
            self._kernels[width] = tabulate(self.dt, dynamics, self.terms, width)
        return self._kernels[width]

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
        return self._in_blocks(_costs, (len(self.players), len(x)), x, padded, first_step)

    def step(self, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Simulate one time step.

        Args:
            x: joint state (nx,), or (nx, K) for K particles.
            u: joint input (nu,) or (nu, K).

        Returns:
            The joint state (nx,) or (nx, K) one step later.
        """
        return self._in_blocks(_step, (self.players.n_states,), x, u)

    def _in_blocks(
        self, function: Any, shape: tuple[int, ...], x: np.ndarray, u: np.ndarray, *others: int
    ) -> np.ndarray:
        """Return what a compiled function adds to zeros (*shape) or (*shape, K)."""
        single = x.ndim == len(shape)
        x_blocks, u_blocks = (in_blocks(a[..., None] if single else a) for a in (x, u))
        width = x_blocks.shape[-1]
        out = np.zeros((len(x_blocks), *shape, width))
        for b in range(len(out)):
            function(self.kernels(width), x_blocks[b], u_blocks[b], *others, out[b])
        return from_blocks(out, 1)[..., 0] if single else from_blocks(out, x.shape[-1])


@njit(error_model="numpy")
def _costs(game: GameKernels, x: Array, u: Array, first_step: int, out: Array) -> None:
    x, u, out = block(x, game.lanes), block(u, game.lanes), block(out, game.lanes)
    for k in range(len(x)):
        t = (first_step + k) * game.dt
        for i in range(len(out)):
            own = rows(u[k], game.input_offset[i], game.input_offset[i + 1])
            for j in range(game.term_offset[i], game.term_offset[i + 1]):
                index = part(game.term_index, game.term_index_offset, j)
                params = part(game.term_params, game.term_params_offset, j)
                out[i, k] += call_for_lanes(game.cost[j], (t, x[k], own, index, params))


@njit(error_model="numpy")
def _step(game: GameKernels, x: Array, u: Array, x_next: Array) -> None:
    x, u, x_next = block(x, game.lanes), block(u, game.lanes), block(x_next, game.lanes)
    for i in range(len(game.step)):
        first, last = game.state_offset[i], game.state_offset[i + 1]
        own = rows(u, game.input_offset[i], game.input_offset[i + 1])
        params = part(game.dynamics_params, game.dynamics_params_offset, i)
        x_i, x_next_i = rows(x, first, last), rows(x_next, first, last)
        call(game.step[i], (x_i, own, game.dt, params, x_next_i))
