"""The observation model: the likelihood of a state, given the prediction of a particle."""

from __future__ import annotations

import numpy as np


class GaussianObservation:
    """A Gaussian observation model p(x | x_hat) with independent errors of the state components.

    Args:
        standard_deviation: standard deviation of each error, in the unit of the component.
        rows: indices of the observed components in the joint state.
    """

    def __init__(self, standard_deviation: float, rows: np.ndarray) -> None:
        self._standard_deviation = standard_deviation
        self._rows = rows

    def log_likelihood(self, x: np.ndarray, x_hat: np.ndarray) -> np.ndarray:
        """Return log p(x | x_hat) (K,); -inf for predictions that are not finite.

        Args:
            x: observed joint state (nx,).
            x_hat: predicted joint states (nx, K).
        """
        error = (x[self._rows, None] - x_hat[self._rows]) / self._standard_deviation
        normalisation = len(self._rows) * np.log(self._standard_deviation * np.sqrt(2 * np.pi))
        log_likelihood = -0.5 * np.sum(error**2, axis=0) - normalisation
        return np.where(np.isnan(log_likelihood), -np.inf, log_likelihood)
