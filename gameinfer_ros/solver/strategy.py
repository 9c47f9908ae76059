"""Affine strategies of all players along a horizon."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gameinfer_ros.games.angles import TURN

FlatArrays = tuple[np.ndarray, np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Strategy:
    """Affine strategies u = u_ref - P (x - x_ref) of K particles at T steps.

    The particle is the last axis of all arrays. For speed, it should be the first one in memory, as
    in `zeros`. Feed-forward terms are part of `u_ref`.

    Attributes:
        first_step: the step at which the horizon starts.
        x_ref: reference states (T + 1, nx, K).
        u_ref: reference inputs (T, nu, K).
        P: gains (T, nu, nx, K).
    """

    first_step: int
    x_ref: np.ndarray
    u_ref: np.ndarray
    P: np.ndarray

    @classmethod
    def from_inputs(cls, first_step: int, x0: np.ndarray, u: np.ndarray) -> Strategy:
        """Create open-loop strategies.

        Args:
            first_step: the step at which the horizon starts.
            x0: reference state (nx,) of all steps.
            u: inputs (T, nu, K).
        """
        T, nu, K = u.shape
        strategy = cls.zeros(first_step, T, len(x0), nu, K)
        strategy.x_ref[:] = x0[:, None]
        strategy.u_ref[:] = u
        return strategy

    @classmethod
    def zeros(cls, first_step: int, horizon: int, nx: int, nu: int, particles: int) -> Strategy:
        """Create strategies of zeros for `horizon` steps, nx states and nu inputs."""
        shapes = ((horizon + 1, nx), (horizon, nu), (horizon, nu, nx))
        arrays = (np.moveaxis(np.zeros((particles, *shape)), 0, -1) for shape in shapes)
        return cls(first_step, *arrays)

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """x_ref, u_ref and P."""
        return self.x_ref, self.u_ref, self.P

    @property
    def flat(self) -> FlatArrays:
        """The arrays x_ref, u_ref and P as (K, rows), with one particle per row.

        They are views if the particle is the first axis in memory, copies if not.
        """
        K = len(self)
        x_ref, u_ref, P = (
            np.moveaxis(a, -1, 0).reshape(K, int(np.prod(a.shape[:-1]))) for a in self.arrays
        )
        return x_ref, u_ref, P

    def __len__(self) -> int:
        """Number of particles K."""
        return self.u_ref.shape[2]

    @property
    def finite(self) -> np.ndarray:
        """Whether all numbers of each particle are finite (K,)."""
        return np.all([np.isfinite(numbers).all(axis=1) for numbers in self.flat], axis=0)

    @property
    def horizon(self) -> int:
        """Number of steps T."""
        return self.u_ref.shape[0]

    @property
    def end(self) -> int:
        """The first step after the horizon."""
        return self.first_step + self.horizon

    def take(self, particles: Sequence[int] | np.ndarray) -> Strategy:
        """Return the strategies of the particles with these indices."""
        taken = (np.moveaxis(array, -1, 0)[np.asarray(particles)] for array in self.arrays)
        return Strategy(self.first_step, *(np.moveaxis(array, 0, -1) for array in taken))

    def of_inputs(self, rows: slice) -> Strategy:
        """Return the strategies of some rows of the joint input, such as those of one player."""
        return Strategy(self.first_step, self.x_ref, self.u_ref[:, rows], self.P[:, rows])

    def assign(
        self, particles: int | np.ndarray, source: Strategy, source_particles: int | slice
    ) -> None:
        """Overwrite particles with particles of `source`."""
        for own, other in zip(self.arrays, source.arrays, strict=True):
            np.moveaxis(own, -1, 0)[particles] = np.moveaxis(other, -1, 0)[source_particles]

    def inputs(self, step: int, x: np.ndarray) -> np.ndarray:
        """Return the inputs (nu, K) of each particle's strategies in the state `x` (nx,).

        Raises:
            IndexError: the horizon does not contain `step`.
        """
        k = self.index(step)
        dx = x[:, None] - self.x_ref[k]
        u = self.u_ref[k].copy()
        # This order makes each input the same to the last bit, whichever rows the strategy has.
        for row in range(len(x)):
            u -= self.P[k, :, row] * dx[row]
        return u

    def near(self, step: int, x: np.ndarray, is_angle: np.ndarray) -> Strategy:
        """Return the same strategies with angles shifted by whole turns next to those of a state.

        Args:
            step: step of `x`.
            x: joint state (nx,).
            is_angle: whether each state is an angle modulo a turn (nx,).

        Raises:
            IndexError: the horizon does not contain `step`.
        """
        turns = np.rint((x[is_angle, None] - self.x_ref[self.index(step), is_angle]) / TURN)
        if not turns.any():
            return self
        x_ref = self.x_ref.copy(order="K")  # in the same order in memory
        x_ref[:, is_angle] += TURN * np.where(np.isfinite(turns), turns, 0.0)
        return replace(self, x_ref=x_ref)

    def advanced(self, step: int) -> Strategy:
        """Return the same strategies for a horizon that starts at the later `step`.

        The steps that are added at its end have inputs and gains of zero.

        Raises:
            IndexError: the horizon does not contain `step`.
        """
        k, (T, nu, nx, K) = self.index(step), self.P.shape
        later = Strategy.zeros(step, T, nx, nu, K)
        later.x_ref[: T - k + 1], later.x_ref[T - k + 1 :] = self.x_ref[k:], self.x_ref[-1]
        later.u_ref[: T - k], later.P[: T - k] = self.u_ref[k:], self.P[k:]
        return later

    def index(self, step: int) -> int:
        """Return the index of a step in the horizon, from 0.

        Raises:
            IndexError: the horizon does not contain `step`.
        """
        k = step - self.first_step
        if not 0 <= k < self.horizon:
            raise IndexError(
                f"step: {step} is not allowed: it must be in the horizon, from {self.first_step} "
                f"to {self.end - 1}"
            )
        return k
