"""Compiled motion of a single vehicle; see `gameinfer_ros.games.motion`."""

from functools import cache
from typing import Any

import numpy as np
from numba import float64, types

from gameinfer_ros.games.dynamics.dynamics import Vehicle
from gameinfer_ros.lanes.addresses import address, call
from gameinfer_ros.lanes.array import Array
from gameinfer_ros.lanes.blocks import BlockType, block
from gameinfer_ros.lanes.compile_cache import njit
from gameinfer_ros.lanes.numbers import NumbersType, part


@cache
def kernels(vehicle: type[Vehicle], width: int) -> tuple[int, int]:
    """Return the addresses of a vehicle's kernels `step` and `brake` for `width` lanes."""
    row, params = BlockType(1, width), NumbersType(float64)
    return (
        address(vehicle.step_kernel.compiled, types.none, (row, row, float64, params, row)),
        address(vehicle.brake_kernel.compiled, types.none, (row, float64, params, row)),
    )


@njit(error_model="numpy")
def simulate(
    lanes: Any, step: int, brake: int, dt: float, offset: Array, numbers: Array, low: Array,
    high: Array, given: int, inputs: Array, states: Array,
) -> None:  # fmt: skip
    """Write the states from the second one on, and the inputs with which the vehicle brakes.

    The shapes are those of blocks: states (blocks, T + 1, n, width), inputs (blocks, T, m, width).
    The first `given` inputs are given.
    """
    w, s, params = block(inputs, lanes), block(states, lanes), part(numbers, offset, 0)
    for b in range(len(states)):
        for k in range(inputs.shape[1]):
            if k >= given:
                call(brake, (s[b, k], dt, params, w[b, k]))
                for j in range(len(low)):
                    w[b, k, j] = np.minimum(np.maximum(w[b, k, j], low[j]), high[j])
            call(step, (s[b, k], w[b, k], dt, params, s[b, k + 1]))


@njit(error_model="numpy")
def distances(
    lanes: Any, dt: float, position: Array, positions: Array, velocities: Array, start: Array,
    states: Array, out: Array,
) -> None:  # fmt: skip
    """Write the smallest distances (blocks, T, J, width) to moving points during each step."""
    s, first, found = block(states, lanes), block(start, lanes), block(out, lanes)
    x, y = position[0], position[1]
    for b in range(len(states)):
        for k in range(states.shape[1] - 1):
            t0, t1 = dt * (first[b] + k), dt * (first[b] + (k + 1))
            for j in range(len(positions)):
                px, py, vx, vy = (
                    positions[j, 0],
                    positions[j, 1],
                    velocities[j, 0],
                    velocities[j, 1],
                )
                dx, dy = px + t0 * vx - s[b, k, x], py + t0 * vy - s[b, k, y]
                mx = px + t1 * vx - s[b, k + 1, x] - dx
                my = py + t1 * vy - s[b, k + 1, y] - dy
                squares = mx * mx + my * my
                moves = squares > 0.0
                when = np.where(moves, -(dx * mx + dy * my) / np.where(moves, squares, 1.0), 0.0)
                when = np.minimum(np.maximum(when, 0.0), 1.0)
                dx, dy = dx + when * mx, dy + when * my
                found[b, k, j] = np.sqrt(dx * dx + dy * dy)
