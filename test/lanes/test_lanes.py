"""Lanes and blocks in compiled code, against NumPy."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from numba import njit

from gameinfer_ros.lanes.blocks import WIDE, block, from_blocks, in_blocks, length, reshaped, rows
from gameinfer_ros.lanes.lanes import Array, fma

WIDTHS = (8, 1)
SPECIAL = [0.0, -0.0, 1.0, -1.0, np.inf, -np.inf, np.nan, 1e-300, 1e300, np.pi, 0.5]


@njit(error_model="numpy")
def everything(a: Array, b: Array, out: Array) -> None:
    out[0] = a + b
    out[1] = a - b
    out[2] = a * b
    out[3] = a / b
    out[4] = -a
    out[5] = np.sqrt(a)
    out[6] = np.abs(a)
    out[7] = np.rint(a)
    out[8] = np.floor(a)
    out[9] = np.maximum(a, b)
    out[10] = np.minimum(a, b)
    out[11] = np.where(a < b, a, b)
    out[12] = np.where(a <= b, 1.0, 2.0)
    out[13] = np.where(a > b, a, 0)
    out[14] = np.where(a >= b, 1.0, 2.0)
    out[15] = np.where(a == b, 1.0, 2.0)
    out[16] = np.where(a != b, 1.0, 2.0)
    out[17] = 2 + a
    out[18] = a - 2.5
    out[19] = 3.0 * a
    out[20] = 1.0 / a
    out[21] = np.maximum(a, 0.25)
    out[22] = b
    out[22] += a
    out[22] -= 2.0
    out[22] *= b
    total = 0.0
    for _ in range(3):
        total = total + a
    out[23] = total


NAMES = 24


def expected(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    out = np.empty((len(a), NAMES, a.shape[1]))
    for i in range(len(a)):
        everything.py_func(a[i], b[i], out[i])
    return out


def pairs(width: int) -> tuple[np.ndarray, np.ndarray]:
    a, b = np.meshgrid(SPECIAL, SPECIAL)
    rng = np.random.default_rng(0)
    a, b = (np.concatenate([v.ravel(), rng.normal(0, 3, 71)]) for v in (a, b))
    return a.reshape(-1, width), b.reshape(-1, width)


@pytest.mark.parametrize("width", WIDTHS)
def test_arithmetic_is_that_of_numpy_to_the_bit(width: int) -> None:
    @njit(error_model="numpy")
    def run(a: Array, b: Array, out: Array) -> None:
        a, b, out = block(a, width), block(b, width), block(out, width)
        for i in range(len(a)):
            everything(a[i], b[i], out[i])

    a, b = pairs(width)
    out = np.full((len(a), NAMES, width), np.nan)
    run(a, b, out)
    with np.errstate(all="ignore"):
        np.testing.assert_array_equal(out, expected(a, b))


@njit(error_model="numpy")
def waves(x: Array, out: Array) -> None:
    x, out = block(x, 8), block(out, 8)
    for i in range(len(x)):
        out[i, 0] = np.sin(x[i])
        out[i, 1] = np.cos(x[i])


@pytest.mark.parametrize(("size", "error"), [(1.0, 2e-16), (10.0, 3e-16), (1e5, 4e-16)])
def test_sine_and_cosine_are_accurate(size: float, error: float) -> None:
    x = np.random.default_rng(1).uniform(-size, size, (2000, 8))
    x[0] = np.pi / 4 * np.arange(8)
    out = np.empty((2000, 2, 8))
    waves(x, out)
    np.testing.assert_allclose(out[:, 0], np.sin(x), rtol=0, atol=error)
    np.testing.assert_allclose(out[:, 1], np.cos(x), rtol=0, atol=error)


def test_sine_and_cosine_of_what_is_not_finite_are_not_numbers() -> None:
    x = np.tile([np.nan, np.inf, -np.inf, 0.0], 2).reshape(1, 8)
    out = np.empty((1, 2, 8))
    waves(x, out)
    for wave in (out[:, 0], out[:, 1]):
        np.testing.assert_array_equal(np.isnan(wave), ~np.isfinite(x))


@njit
def fused(a: Array, out: Array) -> None:
    a, out = block(a, 8), block(out, 8)
    out[0] = fma(a[0], a[0], a[1])


def test_fma_is_rounded_once() -> None:
    # (1 + e)^2 - (1 + 2 e) is e^2, which a product that is rounded first loses.
    e = 2.0**-30
    a, out = np.array([[1 + e] * 8, [-(1 + 2 * e)] * 8]), np.empty((1, 8))
    fused(a, out)
    np.testing.assert_array_equal(out, e * e)
    assert fma(2.0, 3.0, 4.0) == 10.0


@njit
def fused_with_numbers(a: Array, number: float, out: Array) -> None:
    out[0] = fma(a[0], a[1], a[2])
    out[1] = fma(number, a[1], a[2])
    out[2] = fma(a[0], number, a[2])
    out[3] = fma(a[0], a[1], number)
    out[4] = fma(number, number, a[2])
    out[5] = fma(number, a[1], number)
    out[6] = fma(a[0], number, number)
    out[7] = fma(a[0], 3, a[2])


@pytest.mark.parametrize("width", WIDTHS)
def test_fma_takes_numbers_beside_lanes_and_is_rounded_once(width: int) -> None:
    @njit
    def run(a: Array, number: float, out: Array) -> None:
        fused_with_numbers(block(a, width), number, block(out, width))

    rng = np.random.default_rng(4)
    for number in (0.1, -7.3, 1.0 + 2.0**-30):
        a, out = rng.normal(size=(3, width)), np.full((8, width), np.nan)
        a[2] = -a[0] * a[1]  # what is left is what rounding lost
        run(a, number, out)
        for lane in range(width):
            x, y, z = a[:, lane].tolist()
            operands = (
                *((x, y, z), (number, y, z), (x, number, z), (x, y, number)),
                *((number, number, z), (number, y, number), (x, number, number), (x, 3, z)),
            )
            exact = [float(Fraction(p) * Fraction(q) + Fraction(r)) for p, q, r in operands]
            assert out[:, lane].tolist() == exact


@njit
def any_of(a: Array, b: Array) -> tuple[bool, bool, bool]:
    greater = False
    if np.any(a > b):
        greater = True
    return greater, np.any(np.abs(a) == b), np.any(a != 1.0)


@pytest.mark.parametrize("width", WIDTHS)
def test_any_says_whether_a_comparison_holds_in_some_lane(width: int) -> None:
    @njit
    def run(a: Array, b: Array, out: Array) -> None:
        a, b = block(a, width), block(b, width)
        for i in range(len(a)):
            out[i, 0], out[i, 1], out[i, 2] = any_of(a[i], b[i])

    a, b = pairs(width)
    # Every pattern of lanes too: each lane alone, and none.
    patterns = (np.arange(2**width)[:, None] >> np.arange(width)) & 1
    a = np.concatenate([a, patterns.astype(float)])
    b = np.concatenate([b, np.full(patterns.shape, 0.5)])
    out = np.zeros((len(a), 3), dtype=bool)
    run(a, b, out)
    expected = np.stack([(a > b).any(1), (np.abs(a) == b).any(1), (a != 1.0).any(1)], axis=1)
    np.testing.assert_array_equal(out, expected)
    np.testing.assert_array_equal(out[0], any_of.py_func(a[0], b[0]))


@njit
def parts(a: Array, out: Array) -> tuple[int, int, int]:
    a, out = block(a, 8), block(out, 8)
    middle = rows(a, 1, 4)
    middle[1, 2] = 5.0
    square = reshaped(rows(a[5], 0, 4), 2, 2)
    out[0] = square[1, 0]
    return len(middle), length(middle, 1), len(square)


def test_parts_of_blocks_share_their_memory() -> None:
    a = np.arange(7 * 6 * 8, dtype=float).reshape(7, 6, 8)
    out = np.empty((1, 8))
    assert parts(a, out) == (3, 6, 2)
    np.testing.assert_array_equal(a[2, 2], 5.0)
    np.testing.assert_array_equal(out[0], a[5, 2])


@pytest.mark.parametrize("particles", [1, 2, WIDE, WIDE + 1, 3 * WIDE - 1])
def test_particles_come_out_of_blocks_as_they_went_in(particles: int) -> None:
    array = np.random.default_rng(2).normal(size=(5, 3, particles))
    blocks = in_blocks(array)
    assert blocks.shape[1:3] == (5, 3) and blocks.flags.c_contiguous
    assert blocks.shape[-1] == (1 if particles == 1 else WIDE)
    np.testing.assert_array_equal(from_blocks(blocks, particles), array)
