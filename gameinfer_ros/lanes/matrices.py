"""Matrix products and linear equations with lanes, for compiled code."""

from __future__ import annotations

import numpy as np
from numba.extending import overload

from gameinfer_ros.lanes.blocks import adjacent, length, rows
from gameinfer_ros.lanes.compile_cache import njit
from gameinfer_ros.lanes.lanes import Array, fma


def add_transposed_product(left: Array, right: Array, out: Array, triangle: bool) -> None:
    """Add left' right to out.

    Args:
        left: block (k, n).
        right: block (k, m).
        out: block (n, m).
        triangle: whether to compute only the upper triangle. The part below becomes undefined.
    """
    # For Python only; compiled code uses one of the tilings below, depending on the width.
    out += np.einsum("kn...,km...->nm...", left, right)


@overload(add_transposed_product)
def _add_transposed_product(left, right, out, triangle):  # type: ignore[no-untyped-def]
    tiles = _narrow_tiles if out.width == 1 else _wide_tiles

    def add(left, right, out, triangle):  # type: ignore[no-untyped-def]
        tiles(left, right, out, triangle)
        _add_outside_tiles(left, right, out, triangle)

    return add


@njit(error_model="numpy")
def _wide_tiles(left: Array, right: Array, out: Array, triangle: bool) -> None:
    """Compute the part of a product that tiles of 2 by 4 cover; their sums stay in registers."""
    inner, n, m = len(left), length(left, 1), length(right, 1)
    for c in range(0, m - 3, 4):
        stop = c + 4 if triangle else n - n % 2
        for r in range(0, stop, 2):
            a0, a1, a2, a3 = out[r, c], out[r, c + 1], out[r, c + 2], out[r, c + 3]
            b0, b1, b2, b3 = out[r + 1, c], out[r + 1, c + 1], out[r + 1, c + 2], out[r + 1, c + 3]
            for s in range(inner):
                a, b = left[s, r], left[s, r + 1]
                f = right[s, c]
                a0 = fma(a, f, a0)
                b0 = fma(b, f, b0)
                f = right[s, c + 1]
                a1 = fma(a, f, a1)
                b1 = fma(b, f, b1)
                f = right[s, c + 2]
                a2 = fma(a, f, a2)
                b2 = fma(b, f, b2)
                f = right[s, c + 3]
                a3 = fma(a, f, a3)
                b3 = fma(b, f, b3)
            out[r, c], out[r, c + 1], out[r, c + 2], out[r, c + 3] = a0, a1, a2, a3
            out[r + 1, c], out[r + 1, c + 1], out[r + 1, c + 2], out[r + 1, c + 3] = b0, b1, b2, b3


@njit(error_model="numpy")
def _narrow_tiles(left: Array, right: Array, out: Array, triangle: bool) -> None:
    """Compute the same part for one particle, with the columns of a tile side by side."""
    inner, n, m = len(left), length(left, 1), length(right, 1)
    for c in range(m // 4):
        stop = 4 * c + 4 if triangle else n - n % 2
        for r in range(0, stop, 2):
            out_a, out_b = adjacent(out[r], 4), adjacent(out[r + 1], 4)
            a, b = out_a[c], out_b[c]
            for s in range(inner):
                f = adjacent(right[s], 4)[c]
                a = fma(left[s, r], f, a)
                b = fma(left[s, r + 1], f, b)
            out_a[c], out_b[c] = a, b


@njit(error_model="numpy")
def _add_outside_tiles(left: Array, right: Array, out: Array, triangle: bool) -> None:
    """Compute the part of a product that no tile covers."""
    n, m = length(left, 1), length(right, 1)
    for c in range(m):
        start, stop = 0, n
        if c < m - m % 4:
            start = n if triangle else n - n % 2
        if triangle:
            stop = c + 1
        for r in range(start, stop):
            total = out[r, c]
            for s in range(len(left)):
                total = fma(left[s, r], right[s, c], total)
            out[r, c] = total


@njit(error_model="numpy")
def add_transposed_vector(left: Array, vector: Array, out: Array) -> None:
    """Add left' vector to out (n,), with left (k, n) and vector (k,)."""
    n = len(out)
    whole = n - n % 4
    for c in range(0, whole, 4):
        total_0, total_1, total_2, total_3 = out[c], out[c + 1], out[c + 2], out[c + 3]
        for s in range(len(left)):
            value = vector[s]
            total_0 = fma(value, left[s, c], total_0)
            total_1 = fma(value, left[s, c + 1], total_1)
            total_2 = fma(value, left[s, c + 2], total_2)
            total_3 = fma(value, left[s, c + 3], total_3)
        out[c], out[c + 1], out[c + 2], out[c + 3] = total_0, total_1, total_2, total_3
    for c in range(whole, n):
        total = out[c]
        for s in range(len(left)):
            total = fma(vector[s], left[s, c], total)
        out[c] = total


@njit(error_model="numpy")
def sparse_product(
    items: Array, columns: Array, values: Array, right: Array, out: Array, triangle: bool
) -> None:
    """Write M' right' to out, for a sparse matrix M (k, n).

    Args:
        items: for each element of M, its index in `values` and its row; sorted by column.
        columns: the elements of column c are `items[columns[c]:columns[c + 1]]`.
        values: block with the elements of M.
        right: block (m, k).
        out: block (n, m).
        triangle: whether to compute only the upper triangle. The part below becomes undefined.
    """
    m = length(out, 1)
    for c in range(len(out)):
        start = c if triangle else 0
        first, count = columns[c], columns[c + 1] - columns[c]
        # Most columns have one to three elements; their sum is stored only once.
        if count == 0:
            for e in range(start, m):
                out[c, e] = 0.0
            continue
        a, a_row = values[items[first, 0]], items[first, 1]
        if count == 1:
            for e in range(start, m):
                out[c, e] = a * right[e, a_row]
            continue
        b, b_row = values[items[first + 1, 0]], items[first + 1, 1]
        if count == 2:
            for e in range(start, m):
                out[c, e] = fma(b, right[e, b_row], a * right[e, a_row])
            continue
        d, d_row = values[items[first + 2, 0]], items[first + 2, 1]
        for e in range(start, m):
            total = fma(b, right[e, b_row], a * right[e, a_row])
            out[c, e] = fma(d, right[e, d_row], total)
        for item in range(first + 3, columns[c + 1]):
            value, row = values[items[item, 0]], items[item, 1]
            for e in range(start, m):
                out[c, e] = fma(value, right[e, row], out[c, e])


@njit(error_model="numpy")
def mirror(out: Array) -> None:
    """Copy the upper triangle of out (n, n) to the lower triangle."""
    for c in range(len(out)):
        for r in range(c):
            out[c, r] = out[r, c]


@njit(error_model="numpy")
def eliminate(S: Array, S_numbers: Array, Y: Array, Y_numbers: Array) -> None:
    """Replace Y by S^-1 Y, by Gaussian elimination with pivoting in each lane; overwrites S.

    Args:
        S: block (n, n).
        S_numbers: the same memory as an array (n, n, width).
        Y: block (n, m).
        Y_numbers: the same memory as an array (n, m, width).
    """
    n, columns = len(Y), length(Y, 1)
    for c in range(n):
        for row in range(c + 1, n):
            if np.any(np.abs(S[row, c]) > np.abs(S[c, c])):
                _swap_rows(c, S_numbers, Y_numbers)
                break
        inverse = 1.0 / S[c, c]
        for row in range(c + 1, n):
            S[row, c] = -S[row, c] * inverse
            for e in range(c + 1, n):
                S[row, e] = fma(S[row, c], S[c, e], S[row, e])
    for row in range(1, n):
        add_transposed_vector(rows(Y, 0, row), rows(S[row], 0, row), Y[row])
    for row in range(n - 1, -1, -1):
        inverse = 1.0 / S[row, row]
        for c in range(row + 1, n):
            S[row, c] = -S[row, c]
        add_transposed_vector(rows(Y, row + 1, n), rows(S[row], row + 1, n), Y[row])
        for e in range(columns):
            Y[row, e] = Y[row, e] * inverse


@njit(error_model="numpy")
def _swap_rows(c: int, S: Array, Y: Array) -> None:
    """Swap row c with the row below that has the largest |S[row, c]|, in each lane."""
    n = len(S)
    for lane in range(S.shape[2]):
        pivot = c
        for row in range(c + 1, n):
            if np.abs(S[row, c, lane]) > np.abs(S[pivot, c, lane]):
                pivot = row
        if pivot != c:
            for e in range(n):
                S[c, e, lane], S[pivot, e, lane] = S[pivot, e, lane], S[c, e, lane]
            for e in range(Y.shape[1]):
                Y[c, e, lane], Y[pivot, e, lane] = Y[pivot, e, lane], Y[c, e, lane]
