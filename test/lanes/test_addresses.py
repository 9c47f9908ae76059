"""Compiled functions that are called by their address."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from numba import float64, njit, types

from gameinfer_ros.lanes.addresses import address, addresses, call, call_for_lanes
from gameinfer_ros.lanes.blocks import BlockType, block
from gameinfer_ros.lanes.lanes import Array, LanesType

WIDTHS = (1, 8)


@njit(error_model="numpy")
def scale(x: Array, factor: float, out: Array) -> None:
    if factor < 0.0:
        raise ValueError("factor is negative")
    for row in range(len(x)):
        out[row] = factor * x[row]


@njit(error_model="numpy")
def reverse(x: Array, factor: float, out: Array) -> None:
    if factor > 100.0:
        raise IndexError("factor is large")
    for row in range(len(x)):
        out[row] = x[len(x) - 1 - row] + factor


@njit(error_model="numpy")
def total(x: Array, factor: float, out: Array) -> Array:
    if factor < 0.0:
        raise ValueError("factor is negative")
    result = factor * x[0]
    for row in range(1, len(x)):
        result = result + factor * x[row]
    return result


@njit(error_model="numpy")
def largest(x: Array, factor: float, out: Array) -> Array:
    result = x[0]
    for row in range(1, len(x)):
        result = np.maximum(result, x[row])
    return result + factor


def arguments(width: int) -> tuple[types.Type, ...]:
    return BlockType(1, width), float64, BlockType(1, width)


@cache
def callers(width: int) -> tuple[Any, Any]:
    """Code that knows the functions it calls by a table of addresses only."""

    @njit(error_model="numpy")
    def run(table: Array, which: int, x: Array, factor: float, out: Array) -> None:
        call(table[which], (block(x, width), factor, block(out, width)))

    @njit(error_model="numpy")
    def run_for_lanes(table: Array, which: int, x: Array, factor: float, out: Array) -> None:
        out_lanes = block(out, width)
        out_lanes[0] = call_for_lanes(table[which], (block(x, width), factor, out_lanes))

    return run, run_for_lanes


def numbers(width: int) -> np.ndarray:
    return np.random.default_rng(width).normal(size=(5, width))


@pytest.mark.parametrize("width", WIDTHS)
def test_the_function_at_an_address_is_called(width: int) -> None:
    table = addresses([scale, reverse], types.none, arguments(width))
    run, x = callers(width)[0], numbers(width)
    assert table.shape == (2,) and table.dtype == np.int64
    for which, expected in ((0, 2.5 * x), (1, x[::-1] + 2.5), (0, 2.5 * x)):
        out = np.full_like(x, np.nan)
        run(table, which, x, 2.5, out)
        np.testing.assert_array_equal(out, expected)


@pytest.mark.parametrize("width", WIDTHS)
def test_the_lanes_that_a_function_returns_come_back(width: int) -> None:
    table = addresses([total, largest], LanesType(width), arguments(width))
    run, x = callers(width)[1], numbers(width)
    for which, expected in ((0, (2.5 * x).sum(axis=0)), (1, x.max(axis=0) + 2.5)):
        out = np.full_like(x, np.nan)
        run(table, which, x, 2.5, out)
        np.testing.assert_allclose(out[0], expected, rtol=1e-14, atol=1e-14)
        assert np.isnan(out[1:]).all()


@pytest.mark.parametrize("width", WIDTHS)
def test_an_exception_comes_out_of_a_function_that_is_called(width: int) -> None:
    run, run_for_lanes = callers(width)
    x = numbers(width)
    table = addresses([scale, reverse], types.none, arguments(width))
    with pytest.raises(ValueError, match="factor is negative"):
        run(table, 0, x, -1.0, np.zeros_like(x))
    with pytest.raises(IndexError, match="factor is large"):
        run(table, 1, x, 101.0, np.zeros_like(x))
    table, out = addresses([total], LanesType(width), arguments(width)), np.zeros_like(x)
    with pytest.raises(ValueError, match="factor is negative"):
        run_for_lanes(table, 0, x, -1.0, out)
    np.testing.assert_array_equal(out, 0.0, "what was not returned is not stored")
    # Nothing is left of it in the next call.
    run_for_lanes(table, 0, x, 1.0, out)
    np.testing.assert_allclose(out[0], x.sum(axis=0), rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize(
    ("function", "result"),
    [
        (total, types.none),
        (scale, LanesType(8)),
        (total, LanesType(1)),
        (total, float64),
        (scale, float64),
    ],
)
def test_a_function_that_returns_something_else_is_refused(
    function: Any, result: types.Type
) -> None:
    with pytest.raises(TypeError) as caught:
        address(function, result, arguments(8))
    for word in (function.__name__, "returns", str(result)):
        assert word in str(caught.value)
    with pytest.raises(TypeError):
        addresses([function], result, arguments(8))


def test_a_function_has_one_address_for_one_width() -> None:
    first = [address(scale, types.none, arguments(width)) for width in WIDTHS]
    compiled = len(scale.overloads)
    assert first == [address(scale, types.none, arguments(width)) for width in WIDTHS]
    assert len(set(first)) == len(WIDTHS)
    assert len(scale.overloads) == compiled, "nothing is compiled twice"
