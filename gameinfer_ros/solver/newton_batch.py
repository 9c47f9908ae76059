"""A batch whose particles approach equilibria by LQ games and by Newton's method."""

from __future__ import annotations

import numpy as np
from typing_extensions import override

from gameinfer_ros.games import Game, Players
from gameinfer_ros.lanes.blocks import aligned_zeros
from gameinfer_ros.solver.batch import Batch
from gameinfer_ros.solver.kernels import lq_pass
from gameinfer_ros.solver.newton import (
    NewtonWorkspace,
    agreement,
    curvature_pass,
    newton_pass,
    offsets_pass,
    stationarity,
)
from gameinfer_ros.solver.settings import SolverSettings

#: Largest change of an angle in one iteration, in rad. Other states may change by any amount,
#: because there is no amount that suits all units.
_LARGEST_TURN = 0.5

#: Step size towards the solution of the first LQ game, and the smallest one. It grows while the
#: feed-forward terms of successive iterations point the same way (cosine of their angle), and
#: shrinks if they oppose each other.
_FIRST_STEP, _SMALLEST_STEP = 0.5, 0.05
_AGREE, _GROWTH = 0.3, 1.3
_OPPOSE, _SHRINKAGE = -0.1, 0.6

#: Share of the decrease of the residual that its linear model predicts that a Newton step must
#: reach, and the number of earlier residuals of which it may decrease the largest one (Grippo,
#: Lampariello and Lucidi 1986).
_DECREASE, _MEMORY = 0.1, 6

#: Factor by which a Newton step that is rejected is shortened, and how often at most.
_CUT, _CUTS = 0.3, 3

#: Maximum number of times that the step towards an LQ game is halved.
_HALVINGS = 13


class NewtonBatch(Batch):
    """Trajectories and strategies of W particles, with their residuals of stationarity.

    Attributes:
        residual: largest residual of a player, relative to the size of its terms (W,); see
            `gameinfer_ros.solver.newton`.
        pivot: curvatures of each player's own problem (N, W); see `curvature_pass`.
        pivot_step: their steps (N, W).
    """

    def __init__(self, game: Game, settings: SolverSettings, width: int) -> None:
        super().__init__(game, settings, width, exact=True)
        T, nx, nu = game.horizon, game.players.n_states, game.players.n_inputs
        N = len(game.players)
        self._game = game
        self._per_unit = _angles(game.players) / _LARGEST_TURN
        self._newton = NewtonWorkspace.of(self._kernels)
        self._g, self._unit, self._last = aligned_zeros(3, T, nu, width)
        self._costate, self._K = aligned_zeros(T, N, nx, width), aligned_zeros(T, nu, nx, width)
        self._size, self._largest, self._squares = aligned_zeros(3, N, width)
        self.pivot, self.pivot_step = aligned_zeros(2, N, width)
        self.residual, self._cosine = np.zeros(width), aligned_zeros(1, width)
        self._step, self._begun = np.zeros(width), np.zeros(width, dtype=bool)
        self._merits, self._next_merit = np.zeros((_MEMORY, width)), 0

    @override
    def warm_up(self) -> None:
        every = np.arange(len(self.moved))
        self.begin(every)
        self.solve_lq_games(0)
        self.step_towards_lq_games(every)
        self.find_residuals(0)
        self.step_by_newton(0, every)
        self.find_residuals(0)
        self.find_curvatures(0)

    def begin(self, lanes: np.ndarray) -> None:
        """Forget earlier iterations of these lanes, which contain other particles now."""
        self._step[lanes], self._begun[lanes], self._merits[:, lanes] = _FIRST_STEP, False, 0.0

    def solve_lq_games(self, first_step: int) -> None:
        """Compute P and the feed-forward terms of the LQ games along x and u, and the residuals.

        The Hessians of their costs are positive semidefinite (`gauss_newton`).
        """
        lq_pass(
            self._kernels, self._kernels.gauss_newton, self.x, self.u, first_step, 0.0, 0.0,
            self.P, self._alpha, self._workspace,
        )  # fmt: skip
        self.find_residuals(first_step)

    def find_residuals(self, first_step: int) -> None:
        """Update the residuals of x and u, with the gains P."""
        self._differentiate(first_step, self.x, self.u)
        self.residual[:] = _ratio(self._largest, self._size).max(axis=0)

    def step_towards_lq_games(self, lanes: np.ndarray) -> np.ndarray:
        """Move x and u towards the solutions of the last LQ games.

        Args:
            lanes: lanes to move. Others do not change.

        Returns:
            Whether a step was small enough (W,); the lane does not change if not.
        """
        agreement(self._kernels.lanes, self._alpha, self._last, self._unit, self._cosine)
        self._step[self._begun & (self._cosine[0] > _AGREE)] *= _GROWTH
        self._step[self._begun & (self._cosine[0] < _OPPOSE)] *= _SHRINKAGE
        np.clip(self._step, _SMALLEST_STEP, 1.0, out=self._step)
        self._last[:] = self._alpha
        self._begun[:] = True
        self.scale[:] = self._step
        moving = self._mask(lanes)
        self._x_new[0] = self.x[0]
        for halvings in range(_HALVINGS + 1):
            self.rollout()
            too_far = moving & ~(self.moved <= 1.0)
            if not too_far.any() or halvings == _HALVINGS:
                break
            self.scale[too_far] *= 0.5
        self._replace(moving & ~too_far)
        return ~too_far

    def step_by_newton(self, first_step: int, lanes: np.ndarray) -> np.ndarray:
        """Replace x and u, with constant gains, by trajectories with smaller residuals.

        The residuals of these lanes must be known, from `find_residuals` or the last step.

        Args:
            first_step: the step at which the horizon starts.
            lanes: lanes to move. Others do not change, but their residuals become undefined.

        Returns:
            Whether the residual decreased enough (W,). If not, the lane does not change, and its
            residual becomes undefined.
        """
        moving = self._mask(lanes)
        newton_pass(
            self._kernels, self.x, self.u, self.P, first_step, self._g, self._costate,
            self._K, self._alpha, self._newton,
        )  # fmt: skip
        offsets_pass(self._kernels, self.x, self.u, self.P, self._K, self._alpha, self._newton)
        size = self._size.copy()
        merit = self._merit(size)
        self._merits[self._next_merit % _MEMORY] = merit
        self._next_merit += 1
        bound = self._merits.max(axis=0)
        self.scale[:] = 1.0
        self._x_new[0] = self.x[0]
        accepted = np.zeros(len(moving), dtype=bool)
        for cuts in range(_CUTS + 1):
            self.rollout()
            self._differentiate(first_step, self._x_new, self._u_new)
            with np.errstate(all="ignore"):
                enough = self._merit(size) <= bound - _DECREASE * self.scale * merit
            accepted |= moving & (self.moved <= 1.0) & enough
            rejected = moving & ~accepted
            if not rejected.any() or cuts == _CUTS:
                break
            self.scale[rejected] *= _CUT  # the next rollout repeats those that were accepted
        self._replace(accepted)
        self.residual[:] = _ratio(self._largest, self._size).max(axis=0)
        return accepted

    def find_curvatures(self, first_step: int) -> None:
        """Update `pivot` and `pivot_step` where the residuals are known."""
        curvature_pass(
            self._kernels, self.x, self.u, self.P, first_step, self._costate,
            self._K, self._alpha, self.pivot[:, None], self.pivot_step[:, None], self._newton,
        )  # fmt: skip

    def leave_saddles(self, first_step: int, lanes: np.ndarray, share: np.ndarray) -> None:
        """Move players without a minimum along the directions that `find_curvatures` has found.

        Args:
            first_step: the step at which the horizon starts.
            lanes: lanes to move. Others do not change.
            share: decrease of the player's cost, to second order, as a share of it (W,); negative
                for the opposite direction.
        """
        # Sums in order, whatever the number of lanes.
        costs = np.cumsum(self._game.costs(self.x, self.u, first_step), axis=1)[:, -1]
        for i, cost in enumerate(costs):
            own = self._game.players.inputs(i)
            self._alpha[:, own] *= -np.sign(share) * np.sqrt(2.0 * np.abs(share * cost))
            saddle = self._mask(lanes) & ~(self.pivot[i] > 0.0)
            self.P[:, own, :, saddle] = self._K[:, own, :, saddle]
        self.scale[:] = 1.0
        self._x_new[0] = self.x[0]
        self.rollout()
        self._replace(self._mask(lanes) & np.isfinite(self.moved))

    def _mask(self, lanes: np.ndarray) -> np.ndarray:
        mask = np.zeros(len(self.scale), dtype=bool)
        mask[lanes] = True
        return mask

    def _differentiate(self, first_step: int, x: np.ndarray, u: np.ndarray) -> None:
        stationarity(
            self._kernels, x, u, self.P, first_step, self._g, self._unit, self._costate,
            self._size, self._largest, self._squares, self._newton,
        )  # fmt: skip

    def _merit(self, size: np.ndarray) -> np.ndarray:
        """Return the norm of the residuals (W,), relative to the sizes (N, W) of their terms."""
        with np.errstate(all="ignore"):
            return np.asarray(np.sqrt(sum(_ratio(self._squares, size * size))))


def _angles(players: Players) -> np.ndarray:
    """Return 1 for each state that is an angle, and 0 for the others (nx,)."""
    angles = np.zeros(players.n_states)
    for i, dynamics in enumerate(players.dynamics):
        own = angles[players.states(i)]
        own[[*dynamics.angles, *getattr(dynamics, "joint_angles", ())]] = 1.0
    return angles


def _ratio(part: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """Divide, with 0 / 0 = 0."""
    with np.errstate(all="ignore"):
        return np.where(part == 0.0, 0.0, part / whole)
