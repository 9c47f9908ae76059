"""Creates the tables of a game for compiled code."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import float64, int64, types

from gameinfer_ros.games import derivatives
from gameinfer_ros.games.costs.cost_term import BoundTerm
from gameinfer_ros.games.dynamics.dynamics import Dynamics
from gameinfer_ros.games.kernels import GameKernels
from gameinfer_ros.lanes.addresses import addresses
from gameinfer_ros.lanes.array import Array
from gameinfer_ros.lanes.blocks import BlockType
from gameinfer_ros.lanes.lanes import LanesType
from gameinfer_ros.lanes.numbers import NumbersType


def tabulate(
    dt: float,
    dynamics: Sequence[Dynamics],
    terms: Sequence[Sequence[BoundTerm]],
    width: int,
    exact: bool = False,
) -> GameKernels:
    """Create the tables of a game, and compile the kernels that the disk cache does not contain.

    Args:
        dt: length of a time step, in s.
        dynamics: dynamics of each player.
        terms: cost terms of each player.
        width: number of lanes.
        exact: whether the derivatives of the dynamics are those of the kernel `step`, including
            the second ones. If not, `linearise_kernel` gives the first ones, and there are no
            others.
    """
    row, matrix, params = BlockType(1, width), BlockType(2, width), NumbersType(float64)
    of_dynamics = (row, row, float64, params)
    of_term = (float64, row, row, NumbersType(int64), params)
    out = (matrix, row, matrix, row)
    flat = [term for of_player in terms for term in of_player]
    by_hand = [not exact and type(d).linearise_kernel is not None for d in dynamics]
    linear = [
        derivatives.by_hand(d, width) if hand else derivatives.exact(d, width)
        for d, hand in zip(dynamics, by_hand, strict=True)
    ]
    curved = [derivatives.curved(d, width) if exact else (0, 0) for d in dynamics]
    written = [
        written_items(d) if hand else derivatives.dependences(d, dt)
        for d, hand in zip(dynamics, by_hand, strict=True)
    ]
    return GameKernels(
        (None,) * width,
        dt,
        _offsets([d.n_states for d in dynamics]),
        _offsets([d.n_inputs for d in dynamics]),
        _addresses([type(d).step_kernel for d in dynamics], types.none, (*of_dynamics, row)),
        *_columns(linear),
        *_columns(curved),
        _offsets([len(d.params) for d in dynamics]),
        _flat([d.params for d in dynamics], float),
        _offsets([d.n_states**2 for d in dynamics]),
        _offsets([d.n_states * d.n_inputs for d in dynamics]),
        *_items([A for A, _ in written]),
        *_items([B for _, B in written]),
        _offsets([len(of_player) for of_player in terms]),
        _addresses([type(t.term).cost_kernel for t in flat], LanesType(width), of_term),
        _addresses(
            [type(t.term).quadraticise_kernel for t in flat],
            types.none,
            (*of_term, *out),
        ),
        _addresses([type(t.term).gauss_newton() for t in flat], types.none, (*of_term, *out)),
        _offsets([len(t.index) for t in flat]),
        _flat([t.index for t in flat], np.int64),
        _offsets([len(t.params) for t in flat]),
        _flat([t.params for t in flat], float),
    )


def _columns(pairs: Sequence[tuple[int, int]]) -> tuple[Array, Array]:
    first, second = np.array(pairs, dtype=np.int64).T
    return first.copy(), second.copy()


def _addresses(
    kernels: Sequence[Any], result: types.Type, arguments: tuple[types.Type, ...]
) -> Array:
    return addresses([kernel.compiled for kernel in kernels], result, arguments)


def written_items(dynamics: Dynamics) -> tuple[np.ndarray, np.ndarray]:
    """Return which elements of A (n, n) and B (n, m) the kernel `linearise` writes, as booleans."""
    n, m = dynamics.n_states, dynamics.n_inputs
    written = np.zeros((n, n), dtype=bool), np.zeros((n, m), dtype=bool)
    rng = np.random.default_rng(0)
    for untouched in (np.nan, 0.0):  # an element that is added to stays nan, but not 0
        for scale in (0.0, 1.0, 10.0):
            x, u = scale * rng.normal(size=n), scale * rng.normal(size=m)
            A, B = np.full((n, n), untouched), np.full((n, m), untouched)
            params = np.array(dynamics.params, dtype=float)
            with np.errstate(all="ignore"):  # the kernel may overflow at arbitrary states
                type(dynamics).linearise_kernel.py_func(x, u, 0.1, params, A, B)
            for was_written, now in zip(written, (A, B), strict=True):
                was_written |= ~np.isnan(now) if np.isnan(untouched) else now != 0.0
    return written


def _items(written: Sequence[np.ndarray]) -> tuple[Array, Array]:
    """Create the tables `A_items` and `A_columns`, or those of B."""
    items, counts, stored, row = [], [], 0, 0
    for of_player in written:
        c, s = np.nonzero(of_player.T)
        items.append(np.stack([stored + s * of_player.shape[1] + c, row + s], axis=1))
        counts += of_player.sum(axis=0).tolist()
        stored, row = stored + of_player.size, row + len(of_player)
    return np.concatenate(items), _offsets(counts)


def _offsets(lengths: Sequence[int]) -> Array:
    return np.concatenate(([0], np.cumsum(lengths))).astype(np.int64)


def _flat(parts: Sequence[Sequence[float]], dtype: Any) -> Array:
    return np.array([value for values in parts for value in values], dtype=dtype)
