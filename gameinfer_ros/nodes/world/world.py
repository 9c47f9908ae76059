"""The state of all players, step by step."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gameinfer_ros.games import Vehicles
from gameinfer_ros.nodes.world.external_player import ExternalPlayer
from gameinfer_ros.nodes.world.simulated_player import SimulatedPlayer


class World:
    """The state of all players: simulates some, and takes the others from odometry.

    Args:
        vehicles: the vehicles of all players.
        s: joint state (ns,) at step 0.
        external: the external players by index.

    Attributes:
        external: the external players by index.
        simulated: the simulated players by index.
        step: the present step.
        s: joint state (ns,) at the present step.
        w: joint input (nw,) of the previous step.
        missing: why the position of an external player is unknown, by index; empty if all are
            known.
        late: indices of the players whose input for the previous step was late.
        late_steps: number of steps in which an input was late.
        published: step of the last published state; -1 if there is none.
        unpublished: number of steps before `published` whose states were not published.
    """

    def __init__(
        self, vehicles: Vehicles, s: np.ndarray, external: Mapping[int, ExternalPlayer]
    ) -> None:
        self._vehicles, self.external = vehicles, external
        self.simulated = {
            i: SimulatedPlayer(vehicles, i) for i in range(len(vehicles)) if i not in external
        }
        self.step = self.late_steps = 0
        self.s, self.w = s, np.zeros(vehicles.n_inputs)
        self.missing: dict[int, str] = {}
        self.late: list[int] = []
        self.published, self.unpublished = -1, 0

    @property
    def ready(self) -> bool:
        """Whether the inputs of all simulated players for the present step have arrived."""
        return all(player.is_ready(self.step) for player in self.simulated.values())

    def look(self, time: float, timeout: float) -> None:
        """Update the states of the external players, and which of them are missing.

        Args:
            time: time of the states, in s.
            timeout: a player is missing if its newest measurement is older than this, in s.
        """
        self.s, self.missing = self.s.copy(), {}
        for i, player in self.external.items():
            sample = player.at(time, timeout)
            if sample is None:
                self.missing[i] = player.absence(time)
                continue
            own = self._vehicles.states(i)
            self.s[own] = self._vehicles.observed(i, sample.pose, sample.twist, self.s)

    def mark_published(self) -> None:
        """Record that the present state is published."""
        self.unpublished += self.step - self.published - 1
        self.published = self.step

    def skip_to(self, step: int) -> None:
        """Skip to a later step without simulating those in between."""
        self.step = step

    def advance(self, time: float, timeout: float) -> None:
        """Advance by one step. Its end is at `time`, in s; for `timeout`, see `look`."""
        vehicles, before = self._vehicles, self.s
        # While a player is missing, no states are published, so no input can be late.
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
        for i in self.external.keys() - self.missing.keys():
            w[vehicles.inputs(i)] = vehicles.input_between(i, before, self.s)
        self.w = w
        self.step += 1
