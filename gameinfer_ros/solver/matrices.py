"""Products and equations of matrices of lanes, in compiled code."""

from __future__ import annotations

import numpy as np
from numba import njit

from gameinfer_ros.games.blocks import length
from gameinfer_ros.games.kernels import Array
from gameinfer_ros.games.lanes import fma


@njit(cache=True, error_model="numpy")
def add_transposed_product(left: Array, right: Array, out: Array, triangle: bool) -> None:
    """Add left' right to out (n, m), or to the upper triangle of out (n, n) only.

    Works in tiles of 2 by 4, whose 8 sums stay in registers.

    Args:
        left: block (k, n).
        right: block (k, m).
        out: block (n, m).
        triangle: whether only the upper triangle is wanted; what is below it is undefined.
    """
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
    for c in range(m):
        start, stop = 0, n
        if c < m - m % 4:
            start = n if triangle else n - n % 2
        if triangle:
            stop = c + 1
        for r in range(start, stop):
            total = out[r, c]
            for s in range(inner):
                total = fma(left[s, r], right[s, c], total)
            out[r, c] = total


@njit(cache=True, error_model="numpy")
def eliminate(S: Array, S_numbers: Array, Y: Array, Y_numbers: Array) -> None:
    """Gaussian elimination with a pivot row for each lane: Y <- S^-1 Y; S is lost.

    Args:
        S: block (n, n).
        S_numbers: the same memory as an array (n, n, width).
        Y: block (n, m).
        Y_numbers: the same memory as an array (n, m, width).
    """
    n, columns = len(Y), length(Y, 1)
    for c in range(n):
        for lane in range(S_numbers.shape[2]):
            pivot = c
            for row in range(c + 1, n):
                if np.abs(S_numbers[row, c, lane]) > np.abs(S_numbers[pivot, c, lane]):
                    pivot = row
            if pivot != c:
                for e in range(c, n):
                    kept = S_numbers[c, e, lane]
                    S_numbers[c, e, lane] = S_numbers[pivot, e, lane]
                    S_numbers[pivot, e, lane] = kept
                for e in range(columns):
                    kept = Y_numbers[c, e, lane]
                    Y_numbers[c, e, lane] = Y_numbers[pivot, e, lane]
                    Y_numbers[pivot, e, lane] = kept
        inverse = 1.0 / S[c, c]
        for row in range(c + 1, n):
            factor = -S[row, c] * inverse
            for e in range(c + 1, n):
                S[row, e] = fma(factor, S[c, e], S[row, e])
            for e in range(columns):
                Y[row, e] = fma(factor, Y[c, e], Y[row, e])
    for c in range(n - 1, -1, -1):
        inverse = 1.0 / S[c, c]
        for e in range(columns):
            total = Y[c, e]
            for row in range(c + 1, n):
                total = fma(-S[c, row], Y[row, e], total)
            Y[c, e] = total * inverse
