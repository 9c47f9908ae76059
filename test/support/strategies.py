"""How strategies are compared."""

from __future__ import annotations

import numpy as np

from gameinfer_ros.solver import Strategy


def assert_same(one: Strategy, other: Strategy) -> None:
    """To the bit."""
    assert one.first_step == other.first_step
    for a, b in zip(one.arrays, other.arrays, strict=True):
        np.testing.assert_array_equal(a, b)


def assert_same_particle(one: Strategy, k: int, other: Strategy, k_other: int) -> None:
    assert_same(one.take([k]), other.take([k_other]))
