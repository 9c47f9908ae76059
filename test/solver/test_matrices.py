"""Products and equations of matrices of lanes, against NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit

from gameinfer_ros.games.blocks import block
from gameinfer_ros.games.kernels import Array
from gameinfer_ros.solver.matrices import add_transposed_product, eliminate


@njit
def product(left: Array, right: Array, out: Array, triangle: bool) -> None:
    add_transposed_product(block(left, 8), block(right, 8), block(out, 8), triangle)


@njit
def solved(S: Array, Y: Array) -> None:
    eliminate(block(S, 8), S, block(Y, 8), Y)


@pytest.mark.parametrize("k", [1, 3, 8])
@pytest.mark.parametrize("n", [1, 2, 3, 5, 8, 12])
@pytest.mark.parametrize("m", [1, 2, 3, 4, 5, 7, 12])
def test_products_of_any_size(k: int, n: int, m: int) -> None:
    rng = np.random.default_rng(k + 10 * n + 100 * m)
    left, right = rng.normal(size=(k, n, 8)), rng.normal(size=(k, m, 8))
    out = rng.normal(size=(n, m, 8))
    expected = out + np.einsum("knl,kml->nml", left, right)
    product(left, right, out, False)
    np.testing.assert_allclose(out, expected, rtol=0, atol=1e-13)


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 6, 7, 8, 11, 12, 20])
def test_upper_triangles_of_any_size(n: int) -> None:
    rng = np.random.default_rng(n)
    left, right, out = (rng.normal(size=(n, n, 8)) for _ in range(3))
    expected = out + np.einsum("knl,kml->nml", left, right)
    product(left, right, out, True)
    upper = np.triu_indices(n)
    np.testing.assert_allclose(out[upper], expected[upper], rtol=0, atol=1e-12)


@pytest.mark.parametrize("n", [1, 2, 6])
def test_equations_are_solved_with_pivots_for_each_lane(n: int) -> None:
    rng = np.random.default_rng(n)
    S, Y = rng.normal(size=(n, n, 8)), rng.normal(size=(n, 5, 8))
    if n > 1:
        S[0, 0, :4] = 0.0  # no elimination without a swap in these lanes
    expected = np.stack([np.linalg.solve(S[..., k], Y[..., k]) for k in range(8)], axis=-1)
    solved(S, Y)
    np.testing.assert_allclose(Y, expected, rtol=1e-9, atol=1e-9)
