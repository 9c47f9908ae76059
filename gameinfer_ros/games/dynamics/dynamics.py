"""What a kind of dynamics must provide."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gameinfer_ros.games.registry import Kind

if TYPE_CHECKING:
    from gameinfer_ros.games.dynamics.vehicle import Vehicle


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
