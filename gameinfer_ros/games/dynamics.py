"""What a kind of dynamics must provide."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

import numpy as np

from gameinfer_ros.games.registry import Kind


class Dynamics(Kind):
    """How one player moves: x_next = f(x, u), held over one time step.

    A subclass is one file with a default for `kind`, the class variables below, two kernels
    (see `gameinfer_ros.games.kernels`) and six methods, which tell how it brakes and what a state
    and an input look like to the outside: a pose (x, y, yaw) in the map frame and rates along the
    axes of the body frame (x forward, y left, yaw counter-clockwise), in SI units and radians.
    """

    family: ClassVar[dict[str, type[Kind]]] = {}
    kind: str
    state_names: ClassVar[tuple[str, ...]]
    input_names: ClassVar[tuple[str, ...]]
    #: Which states are angles: they are known only up to whole turns when they are observed.
    angles: ClassVar[tuple[int, ...]] = ()
    #: Which two states are the position (x, y) in the map frame, in m.
    position: ClassVar[tuple[int, int]] = (0, 1)
    step_kernel: ClassVar[Any]
    linearise_kernel: ClassVar[Any]

    @property
    def n_states(self) -> int:
        """Number of states n."""
        return len(self.state_names)

    @property
    def n_inputs(self) -> int:
        """Number of inputs m."""
        return len(self.input_names)

    @property
    def params(self) -> tuple[float, ...]:
        """The numbers that the kernels get as `params`."""
        return ()

    @abstractmethod
    def pose(self, x: np.ndarray) -> np.ndarray:
        """Pose (..., 3) of the states `x` (..., n)."""

    @abstractmethod
    def twist(self, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Body rates (..., 3) in the states `x` (..., n) after the inputs `u` (..., m)."""

    @abstractmethod
    def acceleration(self, u: np.ndarray) -> np.ndarray:
        """Body accelerations (..., 3) that the inputs `u` (..., m) command."""

    @abstractmethod
    def state(self, pose: np.ndarray, twist: np.ndarray) -> np.ndarray:
        """State (..., n) with this `pose` (..., 3) and these body rates `twist` (..., 3)."""

    @abstractmethod
    def input(self, twist: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
        """Input (..., m) that commands these body rates and accelerations (..., 3)."""

    @abstractmethod
    def braking_input(self, x: np.ndarray, dt: float) -> np.ndarray:
        """Input (m,) that brings a player in the state `x` (n,) to rest within `dt` seconds."""

    def unwrap(self, x: np.ndarray, near: np.ndarray) -> np.ndarray:
        """The state `x` (..., n) with each angle moved by whole turns next to that in `near`."""
        x = np.array(x, dtype=float)
        for i in self.angles:
            x[..., i] += 2 * np.pi * np.round((near[..., i] - x[..., i]) / (2 * np.pi))
        return x
