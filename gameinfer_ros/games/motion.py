"""The motion of a single vehicle that applies inputs and then brakes."""

from functools import cache
from typing import Any

import numpy as np
from numba import float64, types

from gameinfer_ros.games.dynamics.dynamics import Vehicle
from gameinfer_ros.games.moving_points import MovingPoints
from gameinfer_ros.lanes.addresses import address, call
from gameinfer_ros.lanes.array import Array
from gameinfer_ros.lanes.blocks import BlockType, block, from_blocks, in_blocks
from gameinfer_ros.lanes.compile_cache import njit
from gameinfer_ros.lanes.numbers import NumbersType, part


class Motion:
    """The motion of a single vehicle that applies inputs and then brakes within its limits.

    Several starts are simulated at once, as K particles.

    Args:
        vehicle: the vehicle.
        dt: length of a time step, in s.
        low: lowest input (m,) when it brakes.
        high: highest input (m,) when it brakes.
    """

    def __init__(self, vehicle: Vehicle, dt: float, low: np.ndarray, high: np.ndarray) -> None:
        self._vehicle, self._dt = vehicle, dt
        params = np.array(vehicle.params, dtype=float)
        self._constants = dt, np.array([0, len(params)]), params, low, high
        self._position = np.array(vehicle.position)

    def states(self, s: np.ndarray, w: np.ndarray, steps: int) -> np.ndarray:
        """Simulate the vehicle.

        Args:
            s: state (n,) at the start, or (n, K) of K particles.
            w: inputs (S, m) or (S, m, K) of the first S steps. In later steps, it brakes.
            steps: number of steps T.

        Returns:
            States (T + 1, n) or (T + 1, n, K).
        """
        if s.ndim == 1:
            return self._simulated(s[:, None], w[..., None], steps)[0, ..., 0]
        return from_blocks(self._simulated(s, w, steps), s.shape[-1])

    def distances(
        self, s: np.ndarray, w: np.ndarray, steps: int, others: MovingPoints, start: np.ndarray
    ) -> np.ndarray:
        """Return the smallest distances to moving points during each step of the motion.

        Positions are interpolated linearly within a step.

        Args:
            s: states (n, K) of K particles at their start.
            w: inputs (S, m, K) of the first S steps. In later steps, the vehicle brakes.
            steps: number of steps T.
            others: J moving points.
            start: step (K,) at which each particle starts.

        Returns:
            Distances (T, J, K) in m.
        """
        states = self._simulated(s, w, steps)
        start_blocks = in_blocks(start)
        out = np.empty((len(states), steps, len(others.positions), states.shape[-1]))
        lanes = (None,) * states.shape[-1]
        _distances(lanes, self._dt, self._position, *others, start_blocks, states, out)
        return from_blocks(out, s.shape[-1])

    def _simulated(self, s: np.ndarray, w: np.ndarray, steps: int) -> np.ndarray:
        """Simulate particles (n, K); return blocks (blocks, T + 1, n, width)."""
        first, given = in_blocks(s), in_blocks(w[:steps])
        blocks, n, width = first.shape
        states = np.empty((blocks, steps + 1, n, width))
        states[:, 0] = first
        inputs = np.zeros((blocks, steps, self._vehicle.n_inputs, width))
        inputs[:, : given.shape[1]] = given
        kernels = _addresses(type(self._vehicle), width)
        _simulate((None,) * width, *kernels, *self._constants, given.shape[1], inputs, states)
        return states


@cache
def _addresses(vehicle: type[Vehicle], width: int) -> tuple[int, int]:
    """Return the addresses of a vehicle's kernels `step` and `brake` for `width` lanes."""
    row, params = BlockType(1, width), NumbersType(float64)
    return (
        address(vehicle.step_kernel.compiled, types.none, (row, row, float64, params, row)),
        address(vehicle.brake_kernel.compiled, types.none, (row, float64, params, row)),
    )


@njit(error_model="numpy")
def _simulate(
    lanes: Any, step: int, brake: int, dt: float, offset: Array, numbers: Array, low: Array,
    high: Array, given: int, inputs: Array, states: Array,
) -> None:  # fmt: skip
    w, s, params = block(inputs, lanes), block(states, lanes), part(numbers, offset, 0)
    for b in range(len(states)):
        for k in range(inputs.shape[1]):
            if k >= given:
                call(brake, (s[b, k], dt, params, w[b, k]))
                for j in range(len(low)):
                    w[b, k, j] = np.minimum(np.maximum(w[b, k, j], low[j]), high[j])
            call(step, (s[b, k], w[b, k], dt, params, s[b, k + 1]))


@njit(error_model="numpy")
def _distances(
    lanes: Any, dt: float, position: Array, positions: Array, velocities: Array, start: Array,
    states: Array, out: Array,
) -> None:  # fmt: skip
    s, first, distances = block(states, lanes), block(start, lanes), block(out, lanes)
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
                distances[b, k, j] = np.sqrt(dx * dx + dy * dy)
