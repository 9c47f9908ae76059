"""The planar double integrator: a player that accelerates in any direction."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

import numpy as np
from typing_extensions import override

from gameinfer_ros.games.dynamics.dynamics import Vehicle
from gameinfer_ros.games.kernels import kernel
from gameinfer_ros.lanes.array import Array


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


@kernel
def _brake(x: Array, dt: float, params: Array, u: Array) -> None:
    u[0] = -x[1] / dt
    u[1] = -x[3] / dt


class DoubleIntegrator(Vehicle):
    """A player that accelerates in any direction.

    d/dt (px, vx, py, vy) = (vx, ax, vy, ay), with the inputs (ax, ay), integrated exactly. The
    player has no heading: its body has the axes of the map, and its yaw is 0. Units: m, m/s; m/s^2.
    """

    kind: Literal["double_integrator"] = "double_integrator"
    state_names: ClassVar[Any] = ("px", "vx", "py", "vy")
    input_names: ClassVar[Any] = ("ax", "ay")
    position: ClassVar[Any] = (0, 2)
    step_kernel: ClassVar[Any] = _step
    linearise_kernel: ClassVar[Any] = _linearise
    brake_kernel: ClassVar[Any] = _brake

    @override
    def poses(self, s: np.ndarray) -> np.ndarray:
        px, py = s[..., None, 0], s[..., None, 2]
        return np.stack([px, py, np.zeros_like(px)], axis=-1)

    @override
    def twists(self, s: np.ndarray, w: np.ndarray) -> np.ndarray:
        vx, vy = s[..., None, 1], s[..., None, 3]
        return np.stack([vx, vy, np.zeros_like(vx)], axis=-1)

    @override
    def accelerations(self, w: np.ndarray) -> np.ndarray:
        ax, ay = w[..., None, 0], w[..., None, 1]
        return np.stack([ax, ay, np.zeros_like(ax)], axis=-1)

    @override
    def state(self, poses: np.ndarray, twists: np.ndarray) -> np.ndarray:
        pose, twist = poses[..., 0, :], twists[..., 0, :]
        return np.stack([pose[..., 0], twist[..., 0], pose[..., 1], twist[..., 1]], axis=-1)

    @override
    def input(self, twists: np.ndarray, accelerations: np.ndarray) -> np.ndarray:
        return accelerations[..., 0, :2].copy()

    @override
    def observed(self, pose: np.ndarray, twist: np.ndarray, near: np.ndarray) -> np.ndarray:
        c, s = np.cos(pose[2]), np.sin(pose[2])
        vx, vy = twist[:2]
        return np.array([pose[0], c * vx - s * vy, pose[1], s * vx + c * vy])
