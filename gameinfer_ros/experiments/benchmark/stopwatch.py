"""Measuring times."""

from collections.abc import Callable, Mapping, Sequence
from time import perf_counter
from typing import TypeVar

import numpy as np

Name = TypeVar("Name")


def milliseconds(work: Callable[[], object]) -> float:
    """Measure one call, in ms."""
    start = perf_counter()
    work()
    return 1e3 * (perf_counter() - start)


def median_ms(work: Callable[[], object], calls: int) -> float:
    """Measure the median time of some calls, in ms."""
    return float(np.median([milliseconds(work) for _ in range(calls)]))


def medians_ms(works: Mapping[Name, Callable[[], object]], repetitions: int) -> dict[Name, float]:
    """Measure the median times of several functions, in ms.

    The functions take turns, so that other load on the machine affects all of them alike.
    """
    rounds = [
        {name: milliseconds(work) for name, work in works.items()} for _ in range(repetitions)
    ]
    return {name: float(np.median([times[name] for times in rounds])) for name in works}


def spread(samples: Sequence[float]) -> dict[str, float]:
    """Return the median, the 99th percentile and the maximum of samples."""
    values = np.percentile(samples, [50, 99, 100]).tolist()
    return dict(zip(("median", "p99", "max"), values, strict=True))
