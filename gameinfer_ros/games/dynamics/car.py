"""The car: a kinematic bicycle, which turns only while it drives."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field
from typing_extensions import override

from gameinfer_ros.games.dynamics.dynamics import Vehicle
from gameinfer_ros.games.kernels import kernel
from gameinfer_ros.games.registry import Positive
from gameinfer_ros.lanes.array import Array

#: Speed, in m/s, below which the steering angle cannot be estimated from the yaw rate.
CRAWL = 0.1

# params: wheelbase. The tangent is written as sine / cosine, because lanes do not support np.tan.


@kernel
def _step(x: Array, u: Array, dt: float, params: Array, x_next: Array) -> None:
    # The inputs are constant, so speed and steering are linear in time, and both inner stages of a
    # sub-step have the same yaw rate.
    h = 0.5 * dt
    px, py, theta, v, steering = x[0], x[1], x[2], x[3], x[4]
    rate = v * np.sin(steering) / (params[0] * np.cos(steering))
    for _ in range(2):
        v_mid, v_end = v + 0.5 * h * u[1], v + h * u[1]
        mid, end = steering + 0.5 * h * u[0], steering + h * u[0]
        rate_mid = v_mid * np.sin(mid) / (params[0] * np.cos(mid))
        rate_end = v_end * np.sin(end) / (params[0] * np.cos(end))
        theta_2, theta_3 = theta + 0.5 * h * rate, theta + 0.5 * h * rate_mid
        theta_4 = theta + h * rate_mid
        along_x = v_mid * (np.cos(theta_2) + np.cos(theta_3))
        along_y = v_mid * (np.sin(theta_2) + np.sin(theta_3))
        px = px + h / 6.0 * (v * np.cos(theta) + 2.0 * along_x + v_end * np.cos(theta_4))
        py = py + h / 6.0 * (v * np.sin(theta) + 2.0 * along_y + v_end * np.sin(theta_4))
        theta = theta + h / 6.0 * (rate + 4.0 * rate_mid + rate_end)
        v, steering, rate = v_end, end, rate_end
    x_next[0] = px
    x_next[1] = py
    x_next[2] = theta
    x_next[3] = x[3] + dt * u[1]
    x_next[4] = x[4] + dt * u[0]


@kernel
def _linearise(x: Array, u: Array, dt: float, params: Array, A: Array, B: Array) -> None:
    theta, v = x[2], x[3]
    c, s = np.cos(theta), np.sin(theta)
    c_steering, s_steering = np.cos(x[4]), np.sin(x[4])
    for i in range(5):
        A[i, i] = 1.0
    A[0, 2] = -dt * v * s
    A[0, 3] = dt * c
    A[1, 2] = dt * v * c
    A[1, 3] = dt * s
    A[2, 3] = dt * s_steering / (params[0] * c_steering)
    A[2, 4] = dt * v / (params[0] * c_steering * c_steering)
    B[4, 0] = dt
    B[3, 1] = dt


@kernel
def _brake(x: Array, dt: float, params: Array, u: Array) -> None:
    u[0] = 0.0
    u[1] = -x[3] / dt


class Car(Vehicle):
    """A car, modelled as a kinematic bicycle.

    d/dt (px, py, theta, v, steering) = (v cos(theta), v sin(theta), omega, a, steering_rate), with
    the yaw rate omega = v tan(steering) / wheelbase and the inputs (steering_rate, a). The position
    is the centre of the rear axle. `steering` is the angle of the front wheels relative to the
    body. It must stay between -pi/2 and pi/2; add a soft bound that keeps it there.

    Integrated by the Runge-Kutta method of order 4 with two sub-steps, linearised by Euler's
    method: A = I + dt df/dx, B = dt df/du. Units: m, rad, m/s, rad; rad/s, m/s^2.
    """

    kind: Literal["car"] = "car"
    wheelbase: Positive = Field(description="distance between the axles, in m")
    state_names: ClassVar[Any] = ("px", "py", "theta", "v", "steering")
    input_names: ClassVar[Any] = ("steering_rate", "a")
    angles: ClassVar[Any] = (2,)
    joints: ClassVar[Any] = ("steering",)
    joint_angles: ClassVar[Any] = (4,)
    step_kernel: ClassVar[Any] = _step
    linearise_kernel: ClassVar[Any] = _linearise
    brake_kernel: ClassVar[Any] = _brake

    @property
    @override
    def params(self) -> tuple[float, ...]:
        return (self.wheelbase,)

    @override
    def poses(self, s: np.ndarray) -> np.ndarray:
        wheel = np.zeros_like(s[..., :3])
        wheel[..., 0], wheel[..., 2] = self.wheelbase, s[..., 4]
        return np.stack([s[..., :3], wheel], axis=-2)

    @override
    def twists(self, s: np.ndarray, w: np.ndarray) -> np.ndarray:
        body, wheel = np.zeros_like(s[..., :3]), np.zeros_like(s[..., :3])
        body[..., 0], body[..., 2] = s[..., 3], s[..., 3] * np.tan(s[..., 4]) / self.wheelbase
        wheel[..., 2] = w[..., 0]
        return np.stack([body, wheel], axis=-2)

    @override
    def accelerations(self, w: np.ndarray) -> np.ndarray:
        accelerations = np.zeros((*w.shape[:-1], 2, 3))
        accelerations[..., 0, 0] = w[..., 1]
        return accelerations

    @override
    def state(self, poses: np.ndarray, twists: np.ndarray) -> np.ndarray:
        return np.concatenate([poses[..., 0, :], twists[..., 0, :1], poses[..., 1, 2:]], axis=-1)

    @override
    def input(self, twists: np.ndarray, accelerations: np.ndarray) -> np.ndarray:
        return np.stack([twists[..., 1, 2], accelerations[..., 0, 0]], axis=-1)

    @override
    def observed(self, pose: np.ndarray, twist: np.ndarray, near: np.ndarray) -> np.ndarray:
        v, omega = twist[0], twist[2]
        steering = near[4] if abs(v) < CRAWL else np.arctan(self.wheelbase * omega / v)
        return np.array([*pose, v, steering])
