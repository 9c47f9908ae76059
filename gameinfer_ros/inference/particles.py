"""The particles of a belief."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from typing_extensions import Self

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
