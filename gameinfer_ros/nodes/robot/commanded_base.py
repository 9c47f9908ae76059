"""Velocity commands for a real base."""

from collections.abc import Callable
from time import sleep

import numpy as np

from gameinfer_ros.games import Vehicles

#: Rates up to this, in m/s or rad/s, are rounding errors and count as zero.
_ROUNDING = 1e-9

#: Longest time that `CommandedBase.stop` takes to slow the base down, in s. Whoever ends a process
#: waits longer than this before it kills the process.
STOPPING = 4.0


class CommandedBase:
    """Converts the inputs of a vehicle to velocity commands for a real base.

    Args:
        vehicles: the vehicles of all players.
        i: index of the player.
        send: callback. It gets each velocity (3,) in the frame of the body, in m/s and rad/s.
    """

    def __init__(self, vehicles: Vehicles, i: int, send: Callable[[np.ndarray], None]) -> None:
        self._vehicles, self._i, self._send = vehicles, i, send
        self._s: np.ndarray | None = None
        self._velocity = np.zeros(3)

    @property
    def commanded(self) -> bool:
        """Whether a velocity has been commanded."""
        return self._s is not None

    @property
    def velocity(self) -> np.ndarray:
        """The last command (3,), in m/s and rad/s."""
        return self._velocity

    @property
    def moving(self) -> bool:
        """Whether the last command was not zero."""
        return bool(self._velocity.any())

    def move(self, s: np.ndarray, w: np.ndarray) -> None:
        """Command the vehicle's velocity after a step from `s` (n,) with the input `w` (m,)."""
        self._s, self._velocity = self._after(s, w)
        self._send(self._velocity)

    def brake(self) -> None:
        """Slow down from the last command, as much as the vehicle can in a step, until at rest."""
        if self._s is not None:
            self.move(self._s, self._vehicles.braking_input(self._i, self._s))

    def stop(self, send: Callable[[np.ndarray], None] | None = None, paced: bool = True) -> None:
        """Slow down to rest, and end with a command of zeros.

        Nothing is sent to a base at rest. A base that cannot come to rest within `STOPPING` seconds
        gets zeros then.

        Args:
            send: sends the commands from now on; by default, as before.
            paced: whether to wait for a time step after each command.
        """
        self._send = send or self._send
        for s, velocity in self._ramp():
            # If sending fails, another publisher repeats this command, and the next call resumes.
            self._s, self._velocity = s, velocity
            self._send(velocity)
            if paced and self.moving:
                sleep(self._vehicles.game.dt)

    @property
    def stopping_time(self) -> float:
        """Time that `stop` takes, in s."""
        return (len(self._ramp()) - 1) * self._vehicles.game.dt if self.moving else 0.0

    def _ramp(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """States and commands from the last one to rest, one for each time step."""
        s, velocity = self._s, self._velocity
        ramp: list[tuple[np.ndarray, np.ndarray]] = []
        while s is not None and velocity.any():
            if (len(ramp) + 1) * self._vehicles.game.dt > STOPPING:
                return [*ramp, (s, np.zeros(3))]
            s, velocity = self._after(s, self._vehicles.braking_input(self._i, s))
            ramp.append((s, velocity))
        return ramp

    def _after(self, s: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """State and velocity after a step from `s` with the input `w`."""
        s = self._vehicles.step_alone(self._i, s, w)
        velocity = self._vehicles.dynamics[self._i].twists(s, w)[0]
        return s, np.where(np.abs(velocity) > _ROUNDING, velocity, 0.0)
