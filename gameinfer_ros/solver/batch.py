"""A batch: a few particles side by side, on which the compiled passes work."""

from __future__ import annotations

import numpy as np

from gameinfer_ros.games import Game
from gameinfer_ros.lanes.array import Array
from gameinfer_ros.lanes.blocks import aligned_zeros
from gameinfer_ros.lanes.compile_cache import njit
from gameinfer_ros.solver.kernels import Workspace, lq_pass, rollout
from gameinfer_ros.solver.settings import SolverSettings
from gameinfer_ros.solver.strategy import FlatArrays


class Batch:
    """Trajectories and strategies of W particles, one in each lane.

    Args:
        game: the game to solve.
        settings: settings of the solver.
        width: number of lanes W.
        exact: whether to differentiate the dynamics themselves; see `Game.kernels`.

    Attributes:
        x: states (T + 1, nx, W).
        u: inputs (T, nu, W).
        P: gains (T, nu, nx, W).
        scale: scale of the feed-forward terms in the last line search (W,).
        moved: largest change of a state component in the last rollout (W,).
    """

    def __init__(
        self, game: Game, settings: SolverSettings, width: int, exact: bool = False
    ) -> None:
        T, nx, nu = game.horizon, game.players.n_states, game.players.n_inputs
        self._settings = settings
        self._kernels = game.kernels(width, exact)
        self._workspace = Workspace.of(self._kernels)
        self.x, self._x_new = aligned_zeros(2, T + 1, nx, width)
        self.u, self._u_new = aligned_zeros(2, T, nu, width)
        self.P = aligned_zeros(T, nu, nx, width)
        self._alpha, self._dx = aligned_zeros(T, nu, width), aligned_zeros(nx, width)
        self._per_unit = np.ones(nx)
        self.scale, self.moved = np.zeros(width), np.zeros(width)

    def play_out(self, x0: np.ndarray, lanes: np.ndarray) -> None:
        """Replace x and u by the trajectories that the strategies around them lead to from `x0`.

        Args:
            x0: state (nx,).
            lanes: lanes to replace; the others do not change.
        """
        self._alpha[:] = 0.0
        self._x_new[0] = x0[:, None]
        self.rollout()
        accepted = np.zeros(len(self.moved), dtype=bool)
        accepted[lanes] = True
        self._replace(accepted)

    def warm_up(self) -> None:
        """Execute once all that solving needs, whatever the contents of the lanes."""
        self.iterate(0, np.arange(len(self.moved)))

    def iterate(self, first_step: int, lanes: np.ndarray) -> None:
        """Solve the LQ games along x and u, and roll out their strategies.

        The line search halves the feed-forward terms until the new trajectories are close enough
        to the old ones, and replaces these. Where no scale is small enough, x and u do not change.

        Args:
            first_step: the step at which the horizon starts.
            lanes: lanes in use; the contents of the others become undefined.
        """
        settings = self._settings
        self.lq_pass(first_step)
        self.scale[:] = settings.first_step_size
        self._x_new[0] = self.x[0]
        for halvings in range(settings.max_halvings + 1):
            self.rollout()
            too_far = ~(self.moved <= settings.max_movement)
            if not too_far[lanes].any() or halvings == settings.max_halvings:
                break
            self.scale[too_far] *= 0.5
        self._replace(~too_far)

    def load(
        self, lanes: np.ndarray, source: FlatArrays, particles: np.ndarray, skipped: int = 0
    ) -> None:
        """Copy particles of `source` into lanes.

        Args:
            lanes: lanes to write.
            source: arrays of strategies; see `Strategy.flat`.
            particles: indices of the particles, one for each lane.
            skipped: number of steps to leave out at the start of the horizon. As many are added at
                its end, with inputs and gains of zero.
        """
        for own, rows in zip((self.x, self.u, self.P), source, strict=True):
            first = skipped * (own[0].size // own.shape[-1])
            _gather(rows, particles, first, own.reshape(-1, own.shape[-1]), lanes)

    def store(self, lanes: np.ndarray, target: FlatArrays, particles: np.ndarray) -> None:
        """Copy lanes to particles of `target`, one for each lane."""
        for own, rows in zip((self.x, self.u, self.P), target, strict=True):
            _scatter(own.reshape(-1, own.shape[-1]), lanes, rows, particles)

    def solvable(self) -> np.ndarray:
        """Return whether the last LQ game of each lane has a finite solution (W,)."""
        # A number that is not finite spreads to the first step, where the recursion ends.
        finite = np.isfinite(self.P[0]).all(axis=(0, 1)) & np.isfinite(self._alpha[0]).all(axis=0)
        return np.asarray(finite)

    def lq_pass(self, first_step: int) -> None:
        """Compute P and the feed-forward terms, which solve the LQ games along x and u."""
        lq_pass(
            self._kernels,
            self._kernels.quadraticise,
            self.x,
            self.u,
            first_step,
            self._settings.state_regularisation,
            self._settings.input_regularisation,
            self.P,
            self._alpha,
            self._workspace,
        )

    def rollout(self) -> None:
        """Roll out P and the feed-forward terms times `scale` into new trajectories.

        Updates `moved`.
        """
        rollout(
            self._kernels,
            self.x,
            self.u,
            self.P,
            self._alpha,
            self.scale[None],
            self._per_unit,
            self._x_new,
            self._u_new,
            self.moved[None],
            self._dx,
        )

    def _replace(self, accepted: np.ndarray) -> None:
        """Replace x and u by the new trajectories in the accepted lanes (W,)."""
        self.x, self._x_new = self._x_new, self.x
        self.u, self._u_new = self._u_new, self.u
        rejected = np.flatnonzero(~accepted)
        if len(rejected):
            self.x[..., rejected] = self._x_new[..., rejected]
            self.u[..., rejected] = self._u_new[..., rejected]


#: Number of rows to copy lane by lane before the next ones; they fit into the fastest cache.
_ROWS = 256


@njit(nogil=True)
def _gather(source: Array, particles: Array, first: int, target: Array, lanes: Array) -> None:
    """Copy particles, from the row `first` on, into lanes, and fill the end with zeros."""
    kept = len(target) - first
    for start in range(0, kept, _ROWS):
        for j in range(len(lanes)):
            particle, lane = particles[j], lanes[j]
            for row in range(start, min(start + _ROWS, kept)):
                target[row, lane] = source[particle, first + row]
    for row in range(kept, len(target)):
        for j in range(len(lanes)):
            target[row, lanes[j]] = 0.0


@njit(nogil=True)
def _scatter(source: Array, lanes: Array, target: Array, particles: Array) -> None:
    """Copy lanes to particles."""
    for start in range(0, len(source), _ROWS):
        for j in range(len(lanes)):
            particle, lane = particles[j], lanes[j]
            for row in range(start, min(start + _ROWS, len(source))):
                target[particle, row] = source[row, lane]
