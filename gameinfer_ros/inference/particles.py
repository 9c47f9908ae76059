"""The particles of a belief."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from typing_extensions import Self

from gameinfer_ros.lanes.compile_cache import njit
from gameinfer_ros.lanes.lanes import Array
from gameinfer_ros.solver import Equilibria


@dataclass(frozen=True, kw_only=True)
class Particles(Equilibria):
    """K weighted equilibria.

    `take` merges, resamples or removes particles, depending on the indices.

    Attributes:
        ids: number of the seed that each particle represents (K,).
        log_weights: normalised logarithm of each particle's probability (K,).
    """

    ids: np.ndarray
    log_weights: np.ndarray

    @classmethod
    def equally_probable(cls, seeds: np.ndarray) -> Self:
        """Create a particle with the weight 1 / K for each of the seeds (T, nu, K)."""
        K = seeds.shape[-1]
        return cls.from_seeds(seeds, ids=np.arange(K), log_weights=np.full(K, -np.log(K)))

    @property
    def weights(self) -> np.ndarray:
        """Probability of each particle (K,)."""
        return np.exp(self.log_weights)


@njit
def first_duplicate(trajectories: Array, candidates: Array, k: int, tolerance: float) -> int:
    """Return the first candidate whose trajectory equals the k-th one; -1 if there is none.

    Args:
        trajectories: trajectories (K, rows).
        candidates: indices of the trajectories to compare.
        k: index of the trajectory to compare them with.
        tolerance: largest difference of a number between equal trajectories.
    """
    rows = trajectories.shape[1]
    for candidate in candidates:
        equal = True
        # Start in the middle, where trajectories differ most: all start from the same state, and
        # many end at a goal.
        for j in range(rows):
            row = (j + rows // 2) % rows
            if not abs(trajectories[candidate, row] - trajectories[k, row]) <= tolerance:
                equal = False
                break
        if equal:
            return candidate
    return -1
