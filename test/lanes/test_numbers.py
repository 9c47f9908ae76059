"""Parts of longer arrays in compiled code, against NumPy's slices."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit

from gameinfer_ros.lanes.lanes import Array
from gameinfer_ros.lanes.numbers import part


@njit
def weighted_sum(values: Array, offset: Array, i: int, first: int, last: int) -> float:
    whole = part(values, offset, i)
    some = whole[first:last]
    total = 1000.0 * len(some) + 1e6 * len(whole)
    for j in range(len(some)):
        total += (j + 1) * some[j]
    return total


@pytest.mark.parametrize("dtype", [np.int64, np.float64])
@pytest.mark.parametrize("bounds", [(0, 3), (1, 2), (0, 100), (2, 1), (-2, 3), (5, 9)])
def test_a_part_and_its_slices_are_those_of_the_array(dtype: type, bounds: tuple[int, int]) -> None:
    values, offset = np.arange(10, 22).astype(dtype), np.array([0, 3, 3, 8, 12])
    for i in range(4):
        expected = values[offset[i] : offset[i + 1]]
        some = expected[bounds[0] : bounds[1]]
        total = (
            1e6 * len(expected) + 1000.0 * len(some) + np.sum(some * np.arange(1, len(some) + 1))
        )
        assert weighted_sum(values, offset, i, *bounds) == total
