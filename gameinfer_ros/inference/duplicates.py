"""Compiled comparison of trajectories."""

from __future__ import annotations

from gameinfer_ros.lanes.array import Array
from gameinfer_ros.lanes.compile_cache import njit


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
