"""Derivatives of dynamics, from the kernel `step` itself: exact, and not written by hand.

Compiled code calls `step` with jets (see `gameinfer_ros.lanes.jets`), by address. The functions
below are compiled once for each number of states n and inputs m.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numba import float64, int64, types

from gameinfer_ros.games.dynamics.dynamics import Dynamics
from gameinfer_ros.lanes.addresses import address, call
from gameinfer_ros.lanes.array import Array
from gameinfer_ros.lanes.blocks import BlockType
from gameinfer_ros.lanes.compile_cache import njit
from gameinfer_ros.lanes.jets import JetBlockType, JetType, alike, as_variables, components
from gameinfer_ros.lanes.numbers import NumbersType


def exact(dynamics: Dynamics, width: int) -> tuple[int, int]:
    """Return two addresses: of `linearise(step, x, u, dt, params, A, B)`, and of `step`.

    The function writes the elements of A (n, n) and B (n, m) in x_next = A x + B u.
    """
    row, matrix, params = _types(width)
    arguments = (int64, row, row, float64, params, matrix, matrix)
    function = _linearise(dynamics.n_states, dynamics.n_inputs)
    return address(function, types.none, arguments), _step(dynamics, width, 1)


def by_hand(dynamics: Dynamics, width: int) -> tuple[int, int]:
    """Return the same as `exact`, with the kernel `linearise` of the dynamics instead of `step`."""
    row, matrix, params = _types(width)
    arguments = (row, row, float64, params, matrix, matrix)
    kernel = type(dynamics).linearise_kernel.compiled
    return (
        address(_linearise_by_hand, types.none, (int64, *arguments)),
        address(kernel, types.none, arguments),
    )


def curved(dynamics: Dynamics, width: int) -> tuple[int, int]:
    """Return two addresses: of `curve(step, x, u, dt, params, costates, H)`, and of `step`.

    For each costate of `costates` (N, n), the function writes the second derivatives of
    costate' x_next by x and u to a row of H (N, (n + m)^2).
    """
    row, matrix, params = _types(width)
    arguments = (int64, row, row, float64, params, matrix, matrix)
    function = _curve(dynamics.n_states, dynamics.n_inputs)
    return address(function, types.none, arguments), _step(dynamics, width, 2)


def _types(width: int) -> tuple[types.Type, ...]:
    return BlockType(1, width), BlockType(2, width), NumbersType(float64)


def _step(dynamics: Dynamics, width: int, order: int) -> int:
    """Return the address of the kernel `step` for jets by all states and inputs."""
    jets = JetBlockType(JetType(width, dynamics.n_states + dynamics.n_inputs, order))
    arguments = (jets, jets, float64, NumbersType(float64), jets)
    return address(type(dynamics).step_kernel.compiled, types.none, arguments)


@njit(error_model="numpy")
def _linearise_by_hand(
    kernel: int, x: Array, u: Array, dt: float, params: Array, A: Array, B: Array
) -> None:
    call(kernel, (x, u, dt, params, A, B))


@cache
def _linearise(n: int, m: int) -> Any:
    variables = n + m

    def linearise(
        step: int, x: Array, u: Array, dt: float, params: Array, A: Array, B: Array
    ) -> None:
        states, inputs = as_variables(x, n, 0, variables, 1), as_variables(u, m, n, variables, 1)
        after = alike(states, n)
        call(step, (states, inputs, dt, params, after))
        parts = components(after)
        for row in range(n):
            for c in range(n):
                A[row, c] = parts[row, 1 + c]
            for c in range(m):
                B[row, c] = parts[row, 1 + n + c]

    return _compiled(linearise, n, m)


@cache
def _curve(n: int, m: int) -> Any:
    variables = n + m

    def curve(
        step: int, x: Array, u: Array, dt: float, params: Array, costates: Array, H: Array
    ) -> None:
        states, inputs = as_variables(x, n, 0, variables, 2), as_variables(u, m, n, variables, 2)
        after = alike(states, n)
        call(step, (states, inputs, dt, params, after))
        parts = components(after)
        pair = 1 + variables
        for b in range(variables):
            for a in range(b + 1):
                for i in range(len(costates)):
                    total = costates[i, 0] * parts[0, pair]
                    for row in range(1, n):
                        total = total + costates[i, row] * parts[row, pair]
                    H[i, a * variables + b] = total
                    H[i, b * variables + a] = total
                pair += 1

    return _compiled(curve, n, m)


def _compiled(function: Any, n: int, m: int) -> Any:
    # The name must be unique: functions with the same name and signature that come from the disk
    # cache, where different processes have put them, would replace each other.
    function.__qualname__ = f"{function.__name__}_{n}_{m}"
    return njit(function, error_model="numpy")


def dependences(dynamics: Dynamics, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Return which elements of A (n, n) and B (n, m) can differ from 0, as booleans.

    An element is 0 if the state after the step is a number although the state or input before is
    none, wherever that is tried.
    """
    n, m = dynamics.n_states, dynamics.n_inputs
    depends = np.zeros((n, n + m), dtype=bool)
    rng, params = np.random.default_rng(0), np.array(dynamics.params, dtype=float)
    for scale in (0.0, 0.1, 1.0, 10.0):
        for column in range(n + m):
            before, after = scale * rng.normal(size=n + m), np.zeros(n)
            before[column] = np.nan
            with np.errstate(all="ignore"):  # the kernel may overflow at arbitrary states
                type(dynamics).step_kernel(before[:n], before[n:], dt, params, after)
            depends[:, column] |= np.isnan(after)
    return depends[:, :n], depends[:, n:]
