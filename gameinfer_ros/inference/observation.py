"""The observation model: the likelihood of a state, given the prediction of a particle."""

from __future__ import annotations

import numpy as np

from gameinfer_ros.games.angles import short_way


class GaussianObservation:
    """A Gaussian observation model p(x | x_hat) with independent errors of the state components.

    Args:
        standard_deviation: standard deviation of each error, in the unit of the component.
        rows: indices of the observed components in the joint state.
        is_angle: whether each component of the joint state is an angle modulo a turn (nx,).
    """

    def __init__(self, standard_deviation: float, rows: np.ndarray, is_angle: np.ndarray) -> None:
        self._standard_deviation = standard_deviation
        self._rows, self._angles = rows, is_angle[rows]

    def log_likelihood(self, x: np.ndarray, x_hat: np.ndarray) -> np.ndarray:
        """Return log p(x | x_hat) (K,); -inf for predictions that are not finite.

        Args:
            x: observed joint state (nx,).
            x_hat: predicted joint states (nx, K).
        """
        error = x[self._rows, None] - x_hat[self._rows]
        with np.errstate(invalid="ignore"):  # an infinite angle has no short way
            error[self._angles] = short_way(error[self._angles])
        error /= self._standard_deviation
        normalisation = len(self._rows) * np.log(self._standard_deviation * np.sqrt(2 * np.pi))
        log_likelihood = -0.5 * np.sum(error**2, axis=0) - normalisation
        return np.where(np.isnan(log_likelihood), -np.inf, log_likelihood)
