"""How long something takes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from time import perf_counter
from typing import TypeVar

import numpy as np

Name = TypeVar("Name")


def milliseconds(work: Callable[[], object]) -> float:
    """How long one call takes, in ms."""
    start = perf_counter()
    work()
    return 1e3 * (perf_counter() - start)


def median_ms(work: Callable[[], object], calls: int) -> float:
    """The median of how long some calls take, in ms."""
    return float(np.median([milliseconds(work) for _ in range(calls)]))


def medians_ms(works: Mapping[Name, Callable[[], object]], repetitions: int) -> dict[Name, float]:
    """The median of how long each of several calls takes, in ms.

    They take turns, so that what else the machine does meets all of them alike.
    """
    rounds = [
        {name: milliseconds(work) for name, work in works.items()} for _ in range(repetitions)
    ]
    return {name: float(np.median([times[name] for times in rounds])) for name in works}


def spread(samples: Sequence[float]) -> dict[str, float]:
    """Median, 99th percentile and maximum."""
    return {
        "median": float(np.median(samples)),
        "p99": float(np.percentile(samples, 99)),
        "max": float(np.max(samples)),
    }
