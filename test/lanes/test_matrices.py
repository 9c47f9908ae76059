"""Products and equations of matrices of lanes, against NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit

from gameinfer_ros.lanes.blocks import block
from gameinfer_ros.lanes.lanes import Array
from gameinfer_ros.lanes.matrices import (
    add_transposed_product,
    add_transposed_vector,
    eliminate,
    mirror,
    sparse_product,
)

SIZES = (1, 2, 3, 4, 5, 6, 7, 12, 20)


@njit
def product(left: Array, right: Array, out: Array, triangle: bool) -> None:
    add_transposed_product(block(left, 8), block(right, 8), block(out, 8), triangle)


@njit
def narrow_product(left: Array, right: Array, out: Array, triangle: bool) -> None:
    add_transposed_product(block(left, 1), block(right, 1), block(out, 1), triangle)


@njit
def vector_product(left: Array, vector: Array, out: Array) -> None:
    add_transposed_vector(block(left, 8), block(vector, 8), block(out, 8))


@njit
def by_sparse(
    items: Array, columns: Array, values: Array, right: Array, out: Array, triangle: bool
) -> None:
    sparse_product(items, columns, block(values, 8), block(right, 8), block(out, 8), triangle)


@njit
def mirrored(out: Array) -> None:
    mirror(block(out, 8))


@njit
def solved(S: Array, Y: Array) -> None:
    eliminate(block(S, 8), S, block(Y, 8), Y)


@pytest.mark.parametrize("triangle", [False, True])
@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 6, 7, 8, 11, 12, 20])
def test_products_of_any_size_also_of_a_particle_alone(n: int, triangle: bool) -> None:
    rng = np.random.default_rng(n)
    wanted = np.triu_indices(n) if triangle else (...,)
    for k in (1, 3, 4, 7, 8, n):
        for m in (n,) if triangle else (1, 2, 3, 4, 5, 6, 7, 9, 12, n):
            left, right = rng.normal(size=(k, n, 8)), rng.normal(size=(k, m, 8))
            out = rng.normal(size=(n, m, 8))
            expected = out + np.einsum("knl,kml->nml", left, right)
            alone = out[..., 5:6].copy()
            columns = (np.ascontiguousarray(a[..., 5:6]) for a in (left, right))
            narrow_product(*columns, alone, triangle)
            product(left, right, out, triangle)
            np.testing.assert_allclose(out[wanted], expected[wanted], rtol=0, atol=1e-13)
            np.testing.assert_array_equal(alone[..., 0][wanted], out[..., 5][wanted])


def assert_solved(S: np.ndarray, Y: np.ndarray) -> None:
    expected = np.stack([np.linalg.solve(S[..., k], Y[..., k]) for k in range(8)], axis=-1)
    solved(S, Y)
    np.testing.assert_allclose(Y, expected, rtol=0, atol=1e-13)


@pytest.mark.parametrize("n", range(2, 11))
def test_equations_that_need_a_swap_in_every_column_are_solved(n: int) -> None:
    rng = np.random.default_rng(n)
    S, Y = np.empty((n, n, 8)), rng.normal(size=(n, n + 1, 8))
    for lane in range(8):
        # By far the largest item of each column stands in another row than its own. In half of
        # the lanes it is the next one, so that the first row is carried down by every swap.
        order = np.roll(np.arange(n), 1) if lane < 4 else rng.permutation(n)
        S[..., lane] = (np.diag(10.0 + rng.random(n)) + 0.1 * rng.normal(size=(n, n)))[order]
    S[np.arange(n), np.arange(n), 0] = 0.0
    assert_solved(S, Y)


@pytest.mark.parametrize("n", range(2, 11))
def test_the_pivot_may_be_in_any_row_below(n: int) -> None:
    # In all lanes it is as far down. The item on the diagonal is larger than all others between,
    # and as a pivot it would cost six digits.
    rng = np.random.default_rng(n)
    for shift in range(1, n):
        S, Y = 1e-9 * rng.normal(size=(n, n, 8)), rng.normal(size=(n, 3, 8))
        S[(np.arange(n) + shift) % n, np.arange(n)] += 1.0 + rng.random((n, 8))
        S[np.arange(n), np.arange(n)] = 1e-6
        assert_solved(S, Y)


@pytest.mark.parametrize("n", range(1, 11))
def test_the_pivot_is_the_largest_so_that_no_multiplier_exceeds_one(n: int) -> None:
    # With items over many orders of magnitude, wrong pivots would cost all digits.
    rng = np.random.default_rng(n)
    S = rng.normal(size=(n, n, 8)) * 10.0 ** rng.integers(-12, 1, (n, 1, 8))
    x = rng.normal(size=(n, 5, 8))
    Y = np.einsum("abl,bcl->acl", S, x)
    left, right = S.copy(), Y.copy()
    solved(left, right)
    # What elimination leaves of S below the diagonal are the negative multipliers.
    below = np.tril_indices(n, -1)
    assert (np.abs(left[below]) <= 1.0).all()
    residual = np.abs(np.einsum("abl,bcl->acl", S, right) - Y)
    size = np.einsum("abl,bcl->acl", np.abs(S), np.abs(right))
    assert (residual.max(axis=(0, 1)) <= 1e-12 * size.max(axis=(0, 1))).all()


def test_a_lane_without_a_solution_leaves_the_others_alone() -> None:
    rng = np.random.default_rng(0)
    S, Y = rng.normal(size=(5, 5, 8)), rng.normal(size=(5, 6, 8))
    S_spoilt, Y_spoilt = S.copy(), Y.copy()
    S_spoilt[..., 2], S_spoilt[1, 3, 5], S_spoilt[..., 7] = 0.0, np.nan, np.inf
    solved(S, Y)
    solved(S_spoilt, Y_spoilt)
    others = [0, 1, 3, 4, 6]
    np.testing.assert_array_equal(Y_spoilt[..., others], Y[..., others])
    assert not np.isfinite(Y_spoilt[..., [2, 5, 7]]).all(axis=(0, 1)).any()


@pytest.mark.parametrize("k", [1, 2, 5, 12])
@pytest.mark.parametrize("n", SIZES)
def test_products_with_a_vector_of_any_size(k: int, n: int) -> None:
    rng = np.random.default_rng(k + 10 * n)
    left, vector, out = (rng.normal(size=(*size, 8)) for size in ((k, n), (k,), (n,)))
    expected = out + np.einsum("knl,kl->nl", left, vector)
    vector_product(left, vector, out)
    np.testing.assert_allclose(out, expected, rtol=0, atol=1e-13)


@pytest.mark.parametrize("n", SIZES)
def test_the_lower_triangle_mirrors_the_upper_one(n: int) -> None:
    out = np.random.default_rng(n).normal(size=(n, n, 8))
    upper = np.triu(np.moveaxis(out, -1, 0))
    expected = np.moveaxis(upper + np.swapaxes(np.triu(upper, 1), 1, 2), 0, -1)
    mirrored(out)
    np.testing.assert_array_equal(out, expected)


def sparse(
    k: int, n: int, density: float, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A sparse matrix (k, n, 8): dense, and as items, columns and values.

    The values are stored in any order, and between them are places that belong to no item.
    """
    where = rng.random((k, n)) < density
    where[:, rng.integers(n)] = False  # a column may be empty
    M = np.where(where[..., None], rng.normal(size=(k, n, 8)), 0.0)
    values = np.full((2 * k * n, 8), np.nan)
    places = iter(rng.permutation(len(values)).tolist())
    items, columns = [], [0]
    for c in range(n):
        for row in np.flatnonzero(where[:, c]).tolist():
            items.append((next(places), row))
            values[items[-1][0]] = M[row, c]
        columns.append(len(items))
    return M, np.array(items, np.int64).reshape(-1, 2), np.array(columns), values


@pytest.mark.parametrize("triangle", [False, True])
@pytest.mark.parametrize("density", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("n", SIZES)
def test_products_with_sparse_matrices(n: int, density: float, triangle: bool) -> None:
    rng = np.random.default_rng(n)
    wanted = np.triu_indices(n) if triangle else (...,)
    for k in (1, 3, n):
        M, *tables = sparse(k, n, density, rng)
        for m in (n,) if triangle else (1, 2, 3, 4, 5, 7, 8, n):
            right, out = rng.normal(size=(m, k, 8)), np.full((n, m, 8), np.nan)
            by_sparse(*tables, right, out, triangle)
            expected = np.einsum("kcl,mkl->cml", M, right)
            np.testing.assert_allclose(out[wanted], expected[wanted], rtol=0, atol=1e-13)
