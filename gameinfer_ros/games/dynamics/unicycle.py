"""The 4D unicycle: a wheeled robot, or a walking person, with inertia along its heading."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

import numpy as np
from typing_extensions import override

from gameinfer_ros.games.dynamics.dynamics import Vehicle
from gameinfer_ros.games.kernels import kernel
from gameinfer_ros.lanes.array import Array


@kernel
def _step(x: Array, u: Array, dt: float, params: Array, x_next: Array) -> None:
    # The inputs are constant, so heading and speed are linear in time, and the Runge-Kutta method
    # of order 4 with two sub-steps is Simpson's rule on v cos(theta) and v sin(theta). The four
    # quarter steps turn the heading by the same angle, so two pairs of sine and cosine suffice.
    theta, v = x[2], x[3]
    turn, gain = 0.25 * dt * u[0], 0.25 * dt * u[1]
    c, s = np.cos(theta), np.sin(theta)
    ct, st = np.cos(turn), np.sin(turn)
    along_x, along_y = v * c, v * s
    for weight in (4.0, 2.0, 4.0, 1.0):
        v = v + gain
        c, s = c * ct - s * st, s * ct + c * st
        along_x += weight * v * c
        along_y += weight * v * s
    x_next[0] = x[0] + dt / 12.0 * along_x
    x_next[1] = x[1] + dt / 12.0 * along_y
    x_next[2] = theta + dt * u[0]
    x_next[3] = x[3] + dt * u[1]


@kernel
def _linearise(x: Array, u: Array, dt: float, params: Array, A: Array, B: Array) -> None:
    theta, v = x[2], x[3]
    c, s = np.cos(theta), np.sin(theta)
    for i in range(4):
        A[i, i] = 1.0
    A[0, 2] = -dt * v * s
    A[0, 3] = dt * c
    A[1, 2] = dt * v * c
    A[1, 3] = dt * s
    B[2, 0] = dt
    B[3, 1] = dt


@kernel
def _brake(x: Array, dt: float, params: Array, u: Array) -> None:
    u[0] = 0.0
    u[1] = -x[3] / dt


class Unicycle(Vehicle):
    """A unicycle with acceleration input.

    d/dt (px, py, theta, v) = (v cos(theta), v sin(theta), omega, a), with the inputs (omega, a).
    Integrated by the Runge-Kutta method of order 4 with two sub-steps, linearised by Euler's
    method: A = I + dt df/dx, B = dt df/du. Units: m, rad, m/s; rad/s, m/s^2.
    """

    kind: Literal["unicycle"] = "unicycle"
    state_names: ClassVar[Any] = ("px", "py", "theta", "v")
    input_names: ClassVar[Any] = ("omega", "a")
    angles: ClassVar[Any] = (2,)
    step_kernel: ClassVar[Any] = _step
    linearise_kernel: ClassVar[Any] = _linearise
    brake_kernel: ClassVar[Any] = _brake

    @override
    def poses(self, s: np.ndarray) -> np.ndarray:
        return s[..., None, :3]

    @override
    def twists(self, s: np.ndarray, w: np.ndarray) -> np.ndarray:
        v, omega = s[..., None, 3], w[..., None, 0]
        return np.stack([v, np.zeros_like(v), omega], axis=-1)

    @override
    def accelerations(self, w: np.ndarray) -> np.ndarray:
        a = w[..., None, 1]
        return np.stack([a, np.zeros_like(a), np.zeros_like(a)], axis=-1)

    @override
    def state(self, poses: np.ndarray, twists: np.ndarray) -> np.ndarray:
        return np.concatenate([poses[..., 0, :], twists[..., 0, :1]], axis=-1)

    @override
    def input(self, twists: np.ndarray, accelerations: np.ndarray) -> np.ndarray:
        return np.stack([twists[..., 0, 2], accelerations[..., 0, 0]], axis=-1)
