"""Standard errors and confidence intervals of means over runs."""

import numpy as np
from scipy.special import stdtrit


def sem(values: np.ndarray) -> np.ndarray:
    """Compute the standard error of the mean of `values` (runs, ...) over runs; nan for one run."""
    if len(values) < 2:
        return np.full(values.shape[1:], np.nan)
    return np.asarray(values.std(axis=0, ddof=1) / np.sqrt(len(values)))


def half_interval(values: np.ndarray) -> np.ndarray:
    """Compute half the 95 % confidence interval (Student's t) of the mean over runs; see `sem`."""
    return np.asarray(stdtrit(len(values) - 1, 0.975) * sem(values))


def finite(values: np.ndarray) -> list[float | None]:
    """Convert numbers (n,) for JSON: nan and infinity become None."""
    return [float(value) if np.isfinite(value) else None for value in values]
