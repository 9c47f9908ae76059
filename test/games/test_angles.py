"""Angles modulo a turn."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from examples import examples
from gameinfer_ros.games.angles import difference, short_way
from gameinfer_ros.lanes.blocks import block

some_angle = st.floats(-1e6, 1e6, allow_subnormal=False)


@njit
def _in_lanes(values, out):  # type: ignore[no-untyped-def]
    x, short = block(values, 8), block(out, 8)
    for row in range(len(x)):
        short[row] = short_way(x[row])


@settings(max_examples=examples(400), derandomize=True)
@given(some_angle)
def test_the_short_way_is_at_most_half_a_turn_and_off_by_whole_turns(angle: float) -> None:
    short = short_way(angle)
    assert abs(short) <= np.pi * (1 + 1e-12)
    turns = (angle - short) / (2 * np.pi)
    assert turns == pytest.approx(round(turns), abs=1e-9)


@settings(max_examples=examples(400), derandomize=True)
@given(st.floats(-np.pi, np.pi))
def test_up_to_half_a_turn_nothing_changes(angle: float) -> None:
    assert short_way(angle) == angle


def test_neither_way_is_preferred_where_both_are_equally_long() -> None:
    assert (short_way(np.pi), short_way(-np.pi)) == (np.pi, -np.pi)
    for angle in np.random.default_rng(0).uniform(-20, 20, 1000).tolist():
        assert short_way(-angle) == -short_way(angle)


def test_compiled_code_and_arrays_agree_to_the_bit() -> None:
    x = np.random.default_rng(1).uniform(-30, 30, (50, 8))
    x[0, :4] = np.pi, -np.pi, np.inf, np.nan
    out = np.empty_like(x)
    _in_lanes(x, out)
    with np.errstate(invalid="ignore"):
        np.testing.assert_array_equal(out, short_way(x))
    assert np.isnan(out[0, 2:4]).all()
    assert out[3, 3] == short_way(float(x[3, 3])) == short_way.compiled(x[3, 3])


def test_only_differences_of_angles_are_taken_by_the_short_way() -> None:
    assert difference(3.1, -3.1, 1) == pytest.approx(float(Fraction(62, 10)) - 2 * np.pi)
    assert difference(3.1, -3.1, 0) == 6.2
