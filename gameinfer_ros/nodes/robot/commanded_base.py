"""A real base that is told how fast to move."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gameinfer_ros.games import Vehicles

#: Rates below this, in m/s or rad/s, are what rounding leaves of a standstill.
_ROUNDING = 1e-9


class CommandedBase:
    """Turns inputs of a vehicle into velocities for a base that stands in for it.

    Args:
        vehicles: the vehicles of all players.
        i: index of the player.
        send: gets each velocity (3,), in the frame of the body.
    """

    def __init__(self, vehicles: Vehicles, i: int, send: Callable[[np.ndarray], None]) -> None:
        self._vehicles, self._i, self._send = vehicles, i, send
        self._s: np.ndarray | None = None

    @property
    def commanded(self) -> bool:
        """Whether it has been told anything yet."""
        return self._s is not None

    def move(self, s: np.ndarray, w: np.ndarray) -> None:
        """Be as fast as the vehicle in the state `s` (n,) is after a step with the input `w`."""
        self._s = self._vehicles.step_alone(self._i, s, w)
        velocity = self._vehicles.dynamics[self._i].twists(self._s, w)[0]
        self._send(np.where(np.abs(velocity) > _ROUNDING, velocity, 0.0))

    def brake(self) -> None:
        """Be slower than last commanded, by what the vehicle can do in a step, down to rest."""
        if self._s is not None:
            self.move(self._s, self._vehicles.braking_input(self._i, self._s))
