"""Velocity commands for a real base."""

from collections.abc import Callable

import numpy as np

from gameinfer_ros.games import Vehicles

#: Rates up to this, in m/s or rad/s, are rounding errors and count as zero.
_ROUNDING = 1e-9


class CommandedBase:
    """Converts the inputs of vehicle `i` to velocity commands for a real base.

    `send` gets each velocity (3,) in the frame of the body, in m/s and rad/s.
    """

    def __init__(self, vehicles: Vehicles, i: int, send: Callable[[np.ndarray], None]) -> None:
        self._vehicles, self._i, self._send = vehicles, i, send
        self._s: np.ndarray | None = None

    @property
    def commanded(self) -> bool:
        """Whether a velocity has been commanded."""
        return self._s is not None

    def move(self, s: np.ndarray, w: np.ndarray) -> None:
        """Command the vehicle's velocity after a step from `s` (n,) with the input `w` (m,)."""
        self._s = self._vehicles.step_alone(self._i, s, w)
        velocity = self._vehicles.dynamics[self._i].twists(self._s, w)[0]
        self._send(np.where(np.abs(velocity) > _ROUNDING, velocity, 0.0))

    def brake(self) -> None:
        """Slow down from the last command, as much as the vehicle can in a step, until at rest."""
        if self._s is not None:
            self.move(self._s, self._vehicles.braking_input(self._i, self._s))
