"""The unicycle in flat coordinates, where it is a double integrator."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

import numpy as np
from typing_extensions import override

from gameinfer_ros.games.dynamics.double_integrator import DoubleIntegrator
from gameinfer_ros.games.dynamics.dynamics import Dynamics
from gameinfer_ros.games.dynamics.unicycle import Unicycle
from gameinfer_ros.games.kernels import kernel
from gameinfer_ros.lanes.array import Array

#: Speed, in m/s, below which a velocity counts as zero: it may be due to rounding.
STANDSTILL = 1e-9


@kernel
def _linearise(x: Array, u: Array, dt: float, params: Array, A: Array, B: Array) -> None:
    for axis in range(2):
        p, v = 2 * axis, 2 * axis + 1
        A[p, p] = 1.0
        A[v, v] = 1.0
        A[p, v] = dt
        B[v, axis] = dt


class FlatUnicycle(Dynamics):
    """A unicycle that the game describes in flat coordinates.

    d/dt (px, vx, py, vy) = (vx, ax, vy, ay), with the inputs (ax, ay), integrated exactly and
    linearised by Euler's method: A = I + dt df/dx, B = dt df/du. Units: m, m/s; m/s^2.

    At the end of each step, the velocity of the unicycle is exactly that of the game. Two headings
    lead along a velocity; the unicycle takes the nearer one, so it turns by at most a quarter turn
    and may drive in reverse. As dt goes to 0, its inputs tend to
    omega = (-sin(theta) ax + cos(theta) ay) / v and a = cos(theta) ax + sin(theta) ay
    (Fridovich-Keil et al. 2019, arXiv 1910.00681), which are undefined at a standstill. A unicycle
    that starts from a standstill therefore turns within one step to its direction of motion, and
    one that comes to a standstill keeps its heading.

    The position of the unicycle deviates from that of the game by an amount of order dt^3 in each
    step, or dt^2 in a step that starts at or passes through a standstill. The next observed state
    corrects it.
    """

    kind: Literal["flat_unicycle"] = "flat_unicycle"
    state_names: ClassVar[Any] = DoubleIntegrator.state_names
    input_names: ClassVar[Any] = DoubleIntegrator.input_names
    position: ClassVar[Any] = DoubleIntegrator.position
    step_kernel: ClassVar[Any] = DoubleIntegrator.step_kernel
    linearise_kernel: ClassVar[Any] = _linearise

    @property
    @override
    def vehicle(self) -> Unicycle:
        return Unicycle()

    @override
    def game_state(self, s: np.ndarray) -> np.ndarray:
        v = _velocity(s)
        return np.stack([s[..., 0], v[..., 0], s[..., 1], v[..., 1]], axis=-1)

    @override
    def vehicle_state(self, x: np.ndarray, near: np.ndarray) -> np.ndarray:
        motion = _motion(x[..., [1, 3]], near[..., 2])
        return np.concatenate([x[..., [0, 2]], motion], axis=-1)

    @override
    def game_input(self, s: np.ndarray, w: np.ndarray, dt: float) -> np.ndarray:
        after = np.concatenate([s[..., :2], s[..., 2:] + dt * w], axis=-1)
        return (_velocity(after) - _velocity(s)) / dt

    @override
    def vehicle_input(self, s: np.ndarray, u: np.ndarray, dt: float) -> np.ndarray:
        return (_motion(_velocity(s) + dt * u, s[..., 2]) - s[..., 2:]) / dt


def _velocity(s: np.ndarray) -> np.ndarray:
    """Return the velocity (..., 2), in the map frame, of a unicycle in states (..., 4)."""
    return s[..., 3:] * np.stack([np.cos(s[..., 2]), np.sin(s[..., 2])], axis=-1)


def _motion(velocity: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Return the heading and speed (..., 2) of a `velocity` (..., 2) in the map frame.

    The heading is the one next to `near` (...,). At a standstill, it is `near` itself.
    """
    vx, vy = velocity[..., 0], velocity[..., 1]
    turn = np.arctan2(vy, vx) - near
    turn = turn - np.pi * np.round(turn / np.pi)
    heading = near + np.where(np.hypot(vx, vy) > STANDSTILL, turn, 0.0)
    return np.stack([heading, vx * np.cos(heading) + vy * np.sin(heading)], axis=-1)
