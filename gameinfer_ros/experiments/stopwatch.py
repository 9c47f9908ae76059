"""How long something takes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from time import perf_counter

import numpy as np


def milliseconds(work: Callable[[], object]) -> float:
    """How long one call takes, in ms."""
    start = perf_counter()
    work()
    return 1e3 * (perf_counter() - start)


def median_ms(work: Callable[[], object], calls: int) -> float:
    """The median of how long some calls take, in ms."""
    return float(np.median([milliseconds(work) for _ in range(calls)]))


def spread(samples: Sequence[float]) -> dict[str, float]:
    """Median, 99th percentile and maximum."""
    return {
        "median": float(np.median(samples)),
        "p99": float(np.percentile(samples, 99)),
        "max": float(np.max(samples)),
    }
