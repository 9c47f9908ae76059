"""Affine strategies: what all players do, and how they react, along a horizon."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Strategy:
    """Strategies of K particles, u = u_ref - P (x - x_ref) at each step of a horizon of T steps.

    The particle is the last axis. A feed-forward term alpha has no place here: it moves u_ref.

    Attributes:
        first_step: the step that the horizon starts at.
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
        """Open-loop strategies with inputs `u` (T, nu, K) around a standstill at `x0` (nx,)."""
        T, nu, K = u.shape
        x_ref = np.tile(x0[:, None], (T + 1, 1, K))
        return cls(first_step, x_ref, u.copy(), np.zeros((T, nu, len(x0), K)))

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """x_ref, u_ref and P."""
        return self.x_ref, self.u_ref, self.P

    def __len__(self) -> int:
        """Number of particles K."""
        return self.u_ref.shape[2]

    @property
    def horizon(self) -> int:
        """Number of steps T."""
        return self.u_ref.shape[0]

    @property
    def end(self) -> int:
        """The first step after the horizon."""
        return self.first_step + self.horizon

    def take(self, particles: Sequence[int] | np.ndarray) -> Strategy:
        """The strategies of the particles with these indices."""
        return Strategy(
            self.first_step, *(np.take(array, particles, axis=-1) for array in self.arrays)
        )

    def of_inputs(self, rows: slice) -> Strategy:
        """The strategies of some rows of the joint input only, such as those of one player."""
        return Strategy(self.first_step, self.x_ref, self.u_ref[:, rows], self.P[:, rows])

    def assign(self, particle: int, source: Strategy, source_particle: int) -> None:
        """Overwrite one particle by one of `source`."""
        for own, other in zip(self.arrays, source.arrays, strict=True):
            own[..., particle] = other[..., source_particle]

    def inputs(self, step: int, x: np.ndarray) -> np.ndarray:
        """Inputs (nu, K) that each particle's strategies give in the state `x` (nx,) at `step`.

        Raises:
            IndexError: the horizon does not contain the step.
        """
        k = self._index(step)
        dx = x[:, None] - self.x_ref[k]
        u = self.u_ref[k].copy()
        # In this order, an input is the same to the bit whichever others are computed with it.
        for row in range(len(x)):
            u -= self.P[k, :, row] * dx[row]
        return u

    def advanced(self, step: int) -> Strategy:
        """The same strategies for a horizon that starts at the later `step`.

        The steps it gains at its end have no inputs and no reaction.

        Raises:
            IndexError: the horizon does not contain the step.
        """
        k = self._index(step)
        x_ref, u_ref, P = (
            np.empty_like(self.x_ref),
            np.zeros_like(self.u_ref),
            np.zeros_like(self.P),
        )
        kept = self.horizon - k
        x_ref[: kept + 1], x_ref[kept + 1 :] = self.x_ref[k:], self.x_ref[-1]
        u_ref[:kept], P[:kept] = self.u_ref[k:], self.P[k:]
        return Strategy(step, x_ref, u_ref, P)

    def _index(self, step: int) -> int:
        k = step - self.first_step
        if not 0 <= k < self.horizon:
            raise IndexError(
                f"step {step} is not in the horizon of steps {self.first_step} to {self.end - 1}"
            )
        return k
