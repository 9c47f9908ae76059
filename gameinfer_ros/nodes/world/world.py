"""Where all players are, step by step."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gameinfer_ros.games import Vehicles
from gameinfer_ros.nodes.world.external_player import ExternalPlayer
from gameinfer_ros.nodes.world.simulated_player import SimulatedPlayer


class World:
    """Moves the players that are simulated, and looks where the others are.

    Args:
        vehicles: what the players are.
        s: joint state (ns,) at step 0.
        external: the players that somebody else moves, by their index.

    Attributes:
        simulated: all other players, by their index.
        step: the present step.
        s: joint state (ns,) now.
        w: joint input (nw,) of the step before.
        missing: why nobody knows where an external player is, by its index.
        late: indices of the players whose last input came too late.
        late_steps: number of steps that somebody was late for.
        told: step of the newest state that others were told of; -1 if there is none.
        left_out: number of steps before that one whose states nobody was told of.
    """

    def __init__(
        self, vehicles: Vehicles, s: np.ndarray, external: Mapping[int, ExternalPlayer]
    ) -> None:
        self._vehicles, self._external = vehicles, external
        self.simulated = {
            i: SimulatedPlayer(vehicles, i) for i in range(len(vehicles)) if i not in external
        }
        self.step = self.late_steps = 0
        self.s, self.w = s, np.zeros(vehicles.n_inputs)
        self.missing: dict[int, str] = {}
        self.late: list[int] = []
        self.told, self.left_out = -1, 0

    @property
    def ready(self) -> bool:
        """Whether the inputs of all simulated players for the present step have come."""
        return all(player.is_ready(self.step) for player in self.simulated.values())

    def look(self, time: float, timeout: float) -> None:
        """Put each external player to where it is at a time, in s.

        A player that was not measured for longer than `timeout`, in s, is missing.
        """
        self.s, self.missing = self.s.copy(), {}
        for i, player in self._external.items():
            sample = player.at(time, timeout)
            if sample is None:
                self.missing[i] = player.absence(time)
                continue
            own = self._vehicles.states(i)
            self.s[own] = self._vehicles.observed(i, sample.pose, sample.twist, self.s)

    def tell(self) -> None:
        """Take note that others are told of the present state."""
        self.left_out += self.step - self.told - 1
        self.told = self.step

    def skip_to(self, step: int) -> None:
        """Leave out the steps before a step: time went on without them."""
        self.step = step

    def advance(self, time: float, timeout: float) -> None:
        """Go on by one step, which ends at a time; see `look`."""
        vehicles, before = self._vehicles, self.s
        # While somebody is missing, nobody is told of a state, and so nobody is late.
        everyone = {} if self.missing else self.simulated
        self.late = [i for i, player in everyone.items() if not player.is_ready(self.step)]
        self.late_steps += bool(self.late)
        for i in self.late:
            self.simulated[i].late_steps += 1
        w = np.zeros(vehicles.n_inputs)
        for i, player in self.simulated.items():
            w[vehicles.inputs(i)] = player.input(self.step, before[vehicles.states(i)])
        self.s = vehicles.step(before, w)
        self.look(time, timeout)
        for i in self._external.keys() - self.missing.keys():
            w[vehicles.inputs(i)] = vehicles.input_between(i, before, self.s)
        self.w = w
        self.step += 1
