"""The observation model: how probable a state is, given what a particle predicted."""

from __future__ import annotations

import numpy as np


class GaussianObservation:
    """p(x | x_hat): independent normal errors of the same size in some of the state components.

    Args:
        standard_deviation: of each component's error, in the component's unit.
        rows: which components of the joint state are weighed.
    """

    def __init__(self, standard_deviation: float, rows: np.ndarray) -> None:
        self._standard_deviation = standard_deviation
        self._rows = rows

    def log_likelihood(self, x: np.ndarray, x_hat: np.ndarray) -> np.ndarray:
        """Log p(x | x_hat) of the state `x` (nx,) for the predictions `x_hat` (nx, K): (K,).

        It is -inf for a prediction that is not finite.
        """
        error = (x[self._rows, None] - x_hat[self._rows]) / self._standard_deviation
        normalisation = len(self._rows) * np.log(self._standard_deviation * np.sqrt(2 * np.pi))
        log_likelihood = -0.5 * np.sum(error**2, axis=0) - normalisation
        return np.where(np.isnan(log_likelihood), -np.inf, log_likelihood)
