"""The 4D unicycle: a wheeled robot, or a walking person, with inertia along its heading."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from typing_extensions import override

from gameinfer_ros.games.dynamics import Dynamics
from gameinfer_ros.games.kernels import Array, kernel


@kernel
def _step(x: Array, u: Array, dt: float, params: Array, x_next: Array) -> None:
    # The inputs are held, so heading and speed are linear in time, and the Runge-Kutta rule of
    # order 4 with two sub-steps is Simpson's rule on v cos(theta) and v sin(theta). The four
    # quarter steps turn the heading by the same angle: two pairs of sine and cosine do for all.
    for lane in range(x.shape[1]):
        theta, v = x[2, lane], x[3, lane]
        turn = 0.25 * dt * u[0, lane]
        gain = 0.25 * dt * u[1, lane]
        c, s = np.cos(theta), np.sin(theta)
        ct, st = np.cos(turn), np.sin(turn)
        along_x, along_y = v * c, v * s
        for weight, speed in (
            (4.0, v + gain),
            (2.0, v + 2.0 * gain),
            (4.0, v + 3.0 * gain),
            (1.0, v + 4.0 * gain),
        ):
            c, s = c * ct - s * st, s * ct + c * st
            along_x += weight * speed * c
            along_y += weight * speed * s
        x_next[0, lane] = x[0, lane] + dt / 12.0 * along_x
        x_next[1, lane] = x[1, lane] + dt / 12.0 * along_y
        x_next[2, lane] = theta + dt * u[0, lane]
        x_next[3, lane] = v + dt * u[1, lane]


@kernel
def _linearise(x: Array, u: Array, dt: float, params: Array, A: Array, B: Array) -> None:
    A[:] = 0.0
    B[:] = 0.0
    for lane in range(x.shape[1]):
        theta, v = x[2, lane], x[3, lane]
        c, s = np.cos(theta), np.sin(theta)
        for i in range(4):
            A[i, i, lane] = 1.0
        A[0, 2, lane] = -dt * v * s
        A[0, 3, lane] = dt * c
        A[1, 2, lane] = dt * v * c
        A[1, 3, lane] = dt * s
        B[2, 0, lane] = dt
        B[3, 1, lane] = dt


class Unicycle(Dynamics):
    """d/dt (px, py, theta, v) = (v cos(theta), v sin(theta), omega, a), with inputs (omega, a).

    Stepped by the Runge-Kutta rule of order 4 with two sub-steps, linearised by Euler's rule:
    A = I + dt df/dx, B = dt df/du. Units: m, rad, m/s; rad/s, m/s^2.
    """

    kind: Literal["unicycle"] = "unicycle"
    state_names: ClassVar = ("px", "py", "theta", "v")
    input_names: ClassVar = ("omega", "a")
    angles: ClassVar = (2,)
    step_kernel: ClassVar = _step
    linearise_kernel: ClassVar = _linearise

    @override
    def pose(self, x: np.ndarray) -> np.ndarray:
        return x[..., :3]

    @override
    def twist(self, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        return np.stack([x[..., 3], np.zeros_like(x[..., 3]), u[..., 0]], axis=-1)

    @override
    def acceleration(self, u: np.ndarray) -> np.ndarray:
        return np.stack([u[..., 1], np.zeros_like(u[..., 1]), np.zeros_like(u[..., 1])], axis=-1)

    @override
    def state(self, pose: np.ndarray, twist: np.ndarray) -> np.ndarray:
        return np.concatenate([pose, twist[..., :1]], axis=-1)

    @override
    def input(self, twist: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
        return np.stack([twist[..., 2], acceleration[..., 0]], axis=-1)

    @override
    def braking_input(self, x: np.ndarray, dt: float) -> np.ndarray:
        return np.array([0.0, -x[3] / dt])
