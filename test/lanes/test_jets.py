"""Jets in compiled code, against complex steps in NumPy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numba import njit

from gameinfer_ros.lanes.blocks import block
from gameinfer_ros.lanes.jets import alike, as_variables, components
from gameinfer_ros.lanes.lanes import Array, fma

OUTPUTS = 27


@njit(error_model="numpy")
def smooth(x: Array, out: Array) -> None:
    a, b, c = x[0], x[1], x[2]
    out[0] = a + b
    out[1] = a - b
    out[2] = a * b * c
    out[3] = a / (b * b + 1.0)
    out[4] = -a * a
    out[5] = np.sqrt(a * a + b * b)
    out[6] = np.sin(a * b)
    out[7] = np.cos(c - a)
    out[8] = fma(a, b, c * c)
    out[9] = 2.0 + a * c
    out[10] = 3 - b * b
    out[11] = a / 4.0
    out[12] = 1.0 / (c * c + 2.0)
    out[13] = 2.5
    total = 0.0
    for j in range(3):
        total = total + x[j] * x[j] * a
    out[14] = total
    out[15] = a
    out[15] += b * c
    out[15] -= 0.5
    out[15] *= b
    out[16] = np.sin(a) / np.cos(a)
    out[17] = fma(a, 2.0, b)
    out[18] = fma(2.0, 3.0, a)


@njit(error_model="numpy")
def piecewise(x: Array, out: Array) -> None:
    smooth(x, out)
    a, b, c = x[0], x[1], x[2]
    out[19] = np.where(a < b, a * b, c * c)
    out[20] = np.where(a >= 0.1, 1.0, b * b)
    out[21] = np.maximum(a * a, b)
    out[22] = np.minimum(c, 0.2) * a
    out[23] = np.abs(a) * b
    out[24] = np.floor(3.0 * a) * b
    out[25] = np.rint(3.0 * a) + b * b
    out[26] = np.where(a == b, a, np.where(a != c, b * c, 0.0))


def plain(z: np.ndarray) -> np.ndarray:
    """The same for complex numbers, which NumPy compares by their real parts first."""
    a, b, c = z
    out = np.zeros((OUTPUTS, z.shape[1]), dtype=complex)
    smooth.py_func(z, out)
    out[19] = np.where(a.real < b.real, a * b, c * c)
    out[20] = np.where(a.real >= 0.1, 1.0, b * b)
    out[21] = np.where((a * a).real > b.real, a * a, b)
    out[22] = np.where(c.real < 0.2, c, 0.2) * a
    out[23] = np.where(a.real < 0.0, -a, a) * b
    out[24] = np.floor(3.0 * a.real) * b
    out[25] = np.rint(3.0 * a.real) + b * b
    out[26] = b * c
    return out


def slopes(z: np.ndarray) -> np.ndarray:
    """First derivatives (outputs, 3, width) by complex steps, exact to rounding."""
    steps = 1e-30j * np.eye(3)
    return np.stack([plain(z + step[:, None]).imag / 1e-30 for step in steps], axis=1)


def curvatures(z: np.ndarray) -> np.ndarray:
    """Second derivatives (outputs, 3, 3, width)."""
    steps = 1e-5 * np.eye(3)
    both = [slopes(z + s[:, None]) - slopes(z - s[:, None]) for s in steps]
    return np.stack(both, axis=1) / 2e-5


@pytest.fixture(params=[1, 8], ids=["1 lane", "8 lanes"])
def width(request: pytest.FixtureRequest) -> int:
    return int(request.param)


def differentiate(width: int, order: int) -> Callable[[np.ndarray], np.ndarray]:
    @njit(error_model="numpy")
    def run(x: Array, out: Array) -> None:
        x, out = block(x, width), block(out, width)
        variables = as_variables(x, 3, 0, 3, order)
        jets = alike(variables, OUTPUTS)
        piecewise(variables, jets)
        parts = components(jets)
        for row in range(len(parts)):
            for j in range(len(parts[row])):
                out[row, j] = parts[row, j]

    def call(x: np.ndarray) -> np.ndarray:
        out = np.full((OUTPUTS, 4 if order == 1 else 10, width), np.nan)
        run(x, out)
        return out

    return call


@pytest.mark.parametrize("order", [1, 2])
def test_jets_are_the_values_and_derivatives(width: int, order: int) -> None:
    rng = np.random.default_rng(0)
    call = differentiate(width, order)
    for _ in range(20):
        x = rng.normal(size=(3, width))
        parts = call(x)
        np.testing.assert_allclose(parts[:, 0], plain(x.astype(complex)).real, atol=1e-13)
        np.testing.assert_allclose(parts[:, 1:4], slopes(x.astype(complex)), atol=1e-12)
        if order == 2:
            second = curvatures(x.astype(complex))
            pairs = [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)]
            for j, (a, b) in enumerate(pairs):
                np.testing.assert_allclose(parts[:, 4 + j], second[:, a, b], atol=1e-7)


def test_a_lane_does_not_depend_on_the_others() -> None:
    x = np.random.default_rng(1).normal(size=(3, 8))
    together, alone = differentiate(8, 2)(x), differentiate(1, 2)
    for lane in range(8):
        np.testing.assert_array_equal(
            alone(np.ascontiguousarray(x[:, [lane]]))[..., 0], together[..., lane]
        )


def test_a_variable_keeps_its_place_among_all_variables() -> None:
    @njit(error_model="numpy")
    def run(x: Array, u: Array, out: Array) -> None:
        x, u, out = block(x, 8), block(u, 8), block(out, 8)
        states, inputs = as_variables(x, 2, 0, 3, 1), as_variables(u, 1, 2, 3, 1)
        product = alike(states, 1)
        product[0] = states[0] * states[1] * inputs[0]
        for j in range(4):
            out[j] = components(product)[0, j]

    x, u, out = np.random.default_rng(2).normal(size=(2, 8)), np.full((1, 8), 3.0), np.zeros((4, 8))
    run(x, u, out)
    np.testing.assert_allclose(out, [3 * x[0] * x[1], 3 * x[1], 3 * x[0], x[0] * x[1]], atol=1e-14)
