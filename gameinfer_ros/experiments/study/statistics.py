"""Means over runs, and how far they can be trusted."""

from __future__ import annotations

import numpy as np
from scipy import stats


def sem(values: np.ndarray) -> np.ndarray:
    """Standard error of the mean over the first axis of `values` (runs, ...); nan for one run."""
    if len(values) < 2:
        return np.full(values.shape[1:], np.nan)
    return np.asarray(values.std(axis=0, ddof=1) / np.sqrt(len(values)))


def half_interval(values: np.ndarray) -> np.ndarray:
    """Half the width of the 95 % confidence interval of the mean of values (runs, ...).

    Student's t, as for normally distributed means; nan for one run.
    """
    if len(values) < 2:
        return np.full(values.shape[1:], np.nan)
    return np.asarray(stats.t.ppf(0.975, len(values) - 1) * sem(values))


def finite(values: np.ndarray) -> list[float | None]:
    """The numbers (n,), fit for JSON: it has neither nan nor infinity, which become None."""
    return [float(value) if np.isfinite(value) else None for value in values]
