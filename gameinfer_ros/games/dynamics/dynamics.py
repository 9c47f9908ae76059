"""What a kind of dynamics, and a kind of vehicle, must provide."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

import numpy as np
from typing_extensions import Self, override

from gameinfer_ros.games.registry import Kind


class Dynamics(Kind):
    """How one player moves in the game: x_next = f(x, u), held over one time step.

    Most players are modelled as the vehicle that they really are: their dynamics are a `Vehicle`.
    A game may also be written in other coordinates. Then a subclass is one file with a default
    for `kind`, the class variables below, two kernels (see `gameinfer_ros.games.kernels`), the
    vehicle, and what the states x and inputs u of the game have to do with the states s and inputs
    w of the vehicle.
    """

    family: ClassVar[dict[str, type[Kind]]] = {}
    kind: str
    state_names: ClassVar[tuple[str, ...]]
    input_names: ClassVar[tuple[str, ...]]
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

    @property
    @abstractmethod
    def vehicle(self) -> Vehicle:
        """What the player really is."""

    @abstractmethod
    def game_state(self, s: np.ndarray) -> np.ndarray:
        """State (..., n) in the game of a vehicle in the states `s` (..., ns)."""

    @abstractmethod
    def vehicle_state(self, x: np.ndarray, near: np.ndarray) -> np.ndarray:
        """State (..., ns) of a vehicle that the game says is in the states `x` (..., n).

        What the game does not say is as in the state `near` (..., ns) of a moment ago.
        """

    @abstractmethod
    def game_input(self, s: np.ndarray, w: np.ndarray, dt: float) -> np.ndarray:
        """Input (..., m) that does in the game what `w` (..., mw) does to a vehicle in `s`.

        Both are held for `dt` seconds.
        """

    @abstractmethod
    def vehicle_input(self, s: np.ndarray, u: np.ndarray, dt: float) -> np.ndarray:
        """Input (..., mw) that does to a vehicle in `s` (..., ns) what `u` does in the game.

        Both are held for `dt` seconds.
        """


class Vehicle(Dynamics):
    """Dynamics of something that really moves about, and not only in the game.

    A subclass is one file with a default for `kind`, the class variables of `Dynamics`, two
    kernels and six methods, which tell how it brakes and what a state and an input look like to
    the outside. That sees its body, and then its joints if it has some, L parts together. Each has
    a pose (x, y, yaw), the body's in the map frame and the joints' against the body, and rates
    along the axes of its own frame (x forward, y left, yaw counter-clockwise), in SI units and
    radians.
    """

    #: Which states are angles: they are known only up to whole turns when they are observed.
    angles: ClassVar[tuple[int, ...]] = ()
    #: Names of the joints, such as a steered wheel: what the pose and the rates of the body alone
    #: do not tell.
    joints: ClassVar[tuple[str, ...]] = ()

    @abstractmethod
    def poses(self, s: np.ndarray) -> np.ndarray:
        """Poses (..., L, 3) in the states `s` (..., n)."""

    @abstractmethod
    def twists(self, s: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Rates (..., L, 3) in the states `s` (..., n) after the inputs `w` (..., m)."""

    @abstractmethod
    def accelerations(self, w: np.ndarray) -> np.ndarray:
        """Accelerations (..., L, 3) that the inputs `w` (..., m) command."""

    @abstractmethod
    def state(self, poses: np.ndarray, twists: np.ndarray) -> np.ndarray:
        """State (..., n) with these poses and rates (..., L, 3)."""

    @abstractmethod
    def input(self, twists: np.ndarray, accelerations: np.ndarray) -> np.ndarray:
        """Input (..., m) that commands these rates and accelerations (..., L, 3)."""

    @abstractmethod
    def braking_input(self, s: np.ndarray, dt: float) -> np.ndarray:
        """Input (m,) that brings a vehicle in the state `s` (n,) to rest within `dt` seconds."""

    def observed(self, pose: np.ndarray, twist: np.ndarray, near: np.ndarray) -> np.ndarray:
        """State (n,) of a vehicle whose body is seen at a pose (3,) with some rates (3,).

        What the body does not tell, as the position of joints, is as in the state `near` (n,) of
        a moment ago. Vehicles with joints, or whose body has other axes, say here what they make
        of a body.
        """
        return self.state(pose[None], twist[None])

    def unwrap(self, s: np.ndarray, near: np.ndarray) -> np.ndarray:
        """The state `s` (..., n) with each angle moved by whole turns next to that in `near`."""
        s = np.array(s, dtype=float)
        for i in self.angles:
            s[..., i] += 2 * np.pi * np.round((near[..., i] - s[..., i]) / (2 * np.pi))
        return s

    # In a game, a vehicle is what it is.

    @property
    @override
    def vehicle(self) -> Self:
        return self

    @override
    def game_state(self, s: np.ndarray) -> np.ndarray:
        return s

    @override
    def vehicle_state(self, x: np.ndarray, near: np.ndarray) -> np.ndarray:
        return x

    @override
    def game_input(self, s: np.ndarray, w: np.ndarray, dt: float) -> np.ndarray:
        return w

    @override
    def vehicle_input(self, s: np.ndarray, u: np.ndarray, dt: float) -> np.ndarray:
        return u
