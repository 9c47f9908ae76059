"""Affine strategies: what all players do, and how they react, along a horizon."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

FlatArrays = tuple[np.ndarray, np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Strategy:
    """Strategies of K particles, u = u_ref - P (x - x_ref) at each step of a horizon of T steps.

    The particle is the last axis of all arrays; in memory it is best the first one, as
    `particles_first` makes it. A feed-forward term alpha has no place here: it moves u_ref.

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
        strategy = cls.zeros(first_step, T, len(x0), nu, K)
        strategy.x_ref[:] = x0[:, None]
        strategy.u_ref[:] = u
        return strategy

    @classmethod
    def zeros(cls, first_step: int, horizon: int, nx: int, nu: int, particles: int) -> Strategy:
        """Strategies of zeros for `horizon` steps, nx states and nu inputs."""
        return cls(
            first_step,
            particles_first(horizon + 1, nx, particles=particles),
            particles_first(horizon, nu, particles=particles),
            particles_first(horizon, nu, nx, particles=particles),
        )

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """x_ref, u_ref and P."""
        return self.x_ref, self.u_ref, self.P

    @property
    def flat(self) -> FlatArrays:
        """The arrays as (K, rows): all numbers of a particle in a row.

        These are views, unless the strategies came from arrays in another order.
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
        """Which particles have finite numbers only (K,)."""
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
        """The strategies of the particles with these indices."""
        taken = (np.moveaxis(array, -1, 0)[np.asarray(particles)] for array in self.arrays)
        return Strategy(self.first_step, *(np.moveaxis(array, 0, -1) for array in taken))

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
        k = self.index(step)
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
        self.index(step)
        _, nu, nx, K = self.P.shape
        later = Strategy.zeros(step, self.horizon, nx, nu, K)
        for particle in range(K):
            self.advance_into(later, particle)
        return later

    def advance_into(self, later: Strategy, particle: int) -> None:
        """Write one particle of `advanced` to the zeros of `later`, for the step it starts at."""
        k, T = self.index(later.first_step), self.horizon
        x, x_later = self.x_ref[..., particle], later.x_ref[..., particle]
        x_later[: T - k + 1], x_later[T - k + 1 :] = x[k:], x[-1]
        later.u_ref[: T - k, :, particle] = self.u_ref[k:, :, particle]
        later.P[: T - k, ..., particle] = self.P[k:, ..., particle]

    def index(self, step: int) -> int:
        """Where a step stands in the horizon, from 0 on.

        Raises:
            IndexError: the horizon does not contain the step.
        """
        k = step - self.first_step
        if not 0 <= k < self.horizon:
            raise IndexError(
                f"step {step} is not in the horizon of steps {self.first_step} to {self.end - 1}"
            )
        return k


def particles_first(*shape: int, particles: int) -> np.ndarray:
    """Zeros (*shape, K) for K particles, with the numbers of each particle next to one another."""
    return np.moveaxis(np.zeros((particles, *shape)), 0, -1)
