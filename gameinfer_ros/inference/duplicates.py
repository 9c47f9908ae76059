"""Compiled comparison of trajectories."""

from __future__ import annotations

from gameinfer_ros.games.angles import short_way
from gameinfer_ros.lanes.array import Array
from gameinfer_ros.lanes.compile_cache import njit


@njit
def first_duplicate(
    trajectories: Array, candidates: Array, k: int, tolerance: float, is_angle: Array
) -> int:
    """Return the first candidate whose trajectory equals the k-th one; -1 if there is none.

    Args:
        trajectories: trajectories (K, S nx), state after state.
        candidates: indices of the trajectories to compare.
        k: index of the trajectory to compare them with.
        tolerance: largest difference of a number between equal trajectories.
        is_angle: whether each state is an angle modulo a turn (nx,).
    """
    rows = trajectories.shape[1]
    for candidate in candidates:
        equal = True
        # Start in the middle, where trajectories differ most: all start from the same state, and
        # many end at a goal.
        for j in range(rows):
            row = (j + rows // 2) % rows
            difference = trajectories[candidate, row] - trajectories[k, row]
            if not abs(difference) <= tolerance and not (
                is_angle[row % len(is_angle)] and abs(short_way(difference)) <= tolerance
            ):
                equal = False
                break
        if equal:
            return candidate
    return -1
