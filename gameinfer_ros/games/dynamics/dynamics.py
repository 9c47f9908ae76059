"""The interfaces of dynamics and vehicles."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar, final

import numpy as np
from typing_extensions import Self, override

from gameinfer_ros.games.angles import TURN
from gameinfer_ros.games.registry import Kind


class Dynamics(Kind):
    """Base class of the dynamics x_next = f(x, u) of a player in the game.

    Inputs are constant during a time step. The dynamics of most players are a `Vehicle`. A game
    can also use other coordinates; a subclass of `Dynamics` then converts between the states x and
    inputs u of the game and the states s and inputs w of the vehicle.

    A subclass is one file. It defines a default for `kind`, the class variables below, two kernels
    (see `gameinfer_ros.games.kernels`), the vehicle, and the four conversions.
    """

    family: ClassVar[dict[str, type[Kind]]] = {}
    kind: str
    state_names: ClassVar[tuple[str, ...]]
    input_names: ClassVar[tuple[str, ...]]
    #: Indices of the two states that are the position (x, y) in the map frame, in m.
    position: ClassVar[tuple[int, int]] = (0, 1)
    #: Indices of the states that are angles modulo a turn, in rad, such as headings. States that
    #: differ by whole turns of them are the same to costs, observations and comparisons.
    angles: ClassVar[tuple[int, ...]] = ()
    step_kernel: ClassVar[Any]
    #: Kernel `linearise`, if that is not to be found by differentiating `step_kernel`.
    linearise_kernel: ClassVar[Any] = None

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
        """The argument `params` of the kernels."""
        return ()

    @property
    @abstractmethod
    def vehicle(self) -> Vehicle:
        """The vehicle of the player."""

    @abstractmethod
    def game_state(self, s: np.ndarray) -> np.ndarray:
        """Convert states (..., ns) of the vehicle to states (..., n) of the game."""

    @abstractmethod
    def vehicle_state(self, x: np.ndarray, near: np.ndarray) -> np.ndarray:
        """Convert states of the game to states of the vehicle.

        Args:
            x: states (..., n) of the game.
            near: states (..., ns) of the vehicle just before. They determine what the game leaves
                open, such as the heading at a standstill.

        Returns:
            States (..., ns) of the vehicle.
        """

    @abstractmethod
    def game_input(self, s: np.ndarray, w: np.ndarray, dt: float) -> np.ndarray:
        """Convert inputs of the vehicle to inputs of the game.

        Args:
            s: states (..., ns) of the vehicle.
            w: inputs (..., mw) of the vehicle, constant for `dt`.
            dt: length of a time step, in s.

        Returns:
            Inputs (..., m) of the game with the same effect.
        """

    @abstractmethod
    def vehicle_input(self, s: np.ndarray, u: np.ndarray, dt: float) -> np.ndarray:
        """Convert inputs of the game to inputs of the vehicle.

        Args:
            s: states (..., ns) of the vehicle.
            u: inputs (..., m) of the game, constant for `dt`.
            dt: length of a time step, in s.

        Returns:
            Inputs (..., mw) of the vehicle with the same effect.
        """


class Vehicle(Dynamics):
    """Base class of vehicles, whose states and inputs are those that messages describe.

    A vehicle consists of L parts: a body, and joints such as a steered wheel. Each part has a pose
    (x, y, yaw) and rates. The pose of the body is in the map frame, that of a joint in the frame of
    the body. Rates are along the axes of the part (x forward, y left, yaw counter-clockwise), in
    SI units and radians.

    A subclass is one file. It defines a default for `kind`, the class variables of `Dynamics`,
    three kernels, and five methods that convert states and inputs to and from poses, rates and
    accelerations.
    """

    brake_kernel: ClassVar[Any]
    #: Names of the joints, whose states the pose and the rates of the body do not determine.
    joints: ClassVar[tuple[str, ...]] = ()
    #: Indices of the states that are angles of joints with a limited range, such as a steering
    #: angle. Messages determine them only up to whole turns, but they are not modulo a turn.
    joint_angles: ClassVar[tuple[int, ...]] = ()

    @abstractmethod
    def poses(self, s: np.ndarray) -> np.ndarray:
        """Return the poses (..., L, 3) in the states `s` (..., n)."""

    @abstractmethod
    def twists(self, s: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Return the rates (..., L, 3) in the states `s` (..., n) after the inputs `w` (..., m)."""

    @abstractmethod
    def accelerations(self, w: np.ndarray) -> np.ndarray:
        """Return the accelerations (..., L, 3) that the inputs `w` (..., m) command."""

    @abstractmethod
    def state(self, poses: np.ndarray, twists: np.ndarray) -> np.ndarray:
        """Return the states (..., n) with these poses and rates (..., L, 3)."""

    @abstractmethod
    def input(self, twists: np.ndarray, accelerations: np.ndarray) -> np.ndarray:
        """Return the inputs (..., m) that command these rates and accelerations (..., L, 3)."""

    @final
    def braking_input(self, s: np.ndarray, dt: float) -> np.ndarray:
        """Return the input (m,) that brings the vehicle from `s` (n,) to rest in `dt` seconds."""
        w = np.zeros(self.n_inputs)
        type(self).brake_kernel.py_func(s, dt, np.array(self.params), w)
        return w

    def observed(self, pose: np.ndarray, twist: np.ndarray, near: np.ndarray) -> np.ndarray:
        """Return the state (n,) of the vehicle from a measurement of its body.

        Override this for a vehicle with joints, or whose body axes are not those of its motion.

        Args:
            pose: pose (3,) of the body in the map frame.
            twist: rates (3,) of the body along its own axes.
            near: state (n,) just before. It determines what the body does not show, such as the
                angles of joints.
        """
        return self.state(pose[None], twist[None])

    def unwrap(self, s: np.ndarray, near: np.ndarray) -> np.ndarray:
        """Shift each angle of the states `s` (..., n) by whole turns next to that of `near`."""
        s = np.array(s, dtype=float)
        for i in (*self.angles, *self.joint_angles):
            s[..., i] += TURN * np.round((near[..., i] - s[..., i]) / TURN)
        return s

    # The coordinates of the game are those of the vehicle.

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
