"""The planar double integrator: a player that accelerates in any direction."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

import numpy as np
from typing_extensions import override

from gameinfer_ros.games.kernels import Array, kernel
from gameinfer_ros.games.vehicle import Vehicle


@kernel
def _step(x: Array, u: Array, dt: float, params: Array, x_next: Array) -> None:
    for axis in range(2):
        p, v = 2 * axis, 2 * axis + 1
        x_next[p] = x[p] + dt * x[v] + 0.5 * dt * dt * u[axis]
        x_next[v] = x[v] + dt * u[axis]


@kernel
def _linearise(x: Array, u: Array, dt: float, params: Array, A: Array, B: Array) -> None:
    for axis in range(2):
        p, v = 2 * axis, 2 * axis + 1
        A[p, p] = 1.0
        A[v, v] = 1.0
        A[p, v] = dt
        B[p, axis] = 0.5 * dt * dt
        B[v, axis] = dt


class DoubleIntegrator(Vehicle):
    """d/dt (px, vx, py, vy) = (vx, ax, vy, ay), with inputs (ax, ay); stepped exactly.

    The player has no heading: its body axes are those of the map, its yaw is 0.
    Units: m, m/s; m/s^2.
    """

    kind: Literal["double_integrator"] = "double_integrator"
    state_names: ClassVar[Any] = ("px", "vx", "py", "vy")
    input_names: ClassVar[Any] = ("ax", "ay")
    position: ClassVar[Any] = (0, 2)
    step_kernel: ClassVar[Any] = _step
    linearise_kernel: ClassVar[Any] = _linearise

    @override
    def pose(self, s: np.ndarray) -> np.ndarray:
        return np.stack([s[..., 0], s[..., 2], np.zeros_like(s[..., 0])], axis=-1)

    @override
    def twist(self, s: np.ndarray, w: np.ndarray) -> np.ndarray:
        return np.stack([s[..., 1], s[..., 3], np.zeros_like(s[..., 1])], axis=-1)

    @override
    def acceleration(self, w: np.ndarray) -> np.ndarray:
        return np.stack([w[..., 0], w[..., 1], np.zeros_like(w[..., 0])], axis=-1)

    @override
    def state(self, pose: np.ndarray, twist: np.ndarray) -> np.ndarray:
        return np.stack([pose[..., 0], twist[..., 0], pose[..., 1], twist[..., 1]], axis=-1)

    @override
    def input(self, twist: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
        return acceleration[..., :2].copy()

    @override
    def braking_input(self, s: np.ndarray, dt: float) -> np.ndarray:
        return -s[[1, 3]] / dt
