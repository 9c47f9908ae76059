"""The state of all players, step by step."""

from collections.abc import Mapping

import numpy as np

from gameinfer_ros.games import Vehicles
from gameinfer_ros.nodes.world.external_player import ExternalPlayer
from gameinfer_ros.nodes.world.simulated_player import SimulatedPlayer
from msg_adapters import diagnostics


class World:
    """The state of all players: simulates some, and takes the others from odometry.

    Attributes:
        external: the external players by index.
        simulated: the simulated players by index.
        step: the present step; a later one skips those in between.
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
    def absences(self) -> list[str]:
        """The missing external players, each with the reason."""
        return [f"{self._vehicles.names[i]} ({why})" for i, why in self.missing.items()]

    @property
    def missing_odometry(self) -> str:
        """The external players whose odometry is missing, in words; empty if there are none."""
        names = ", ".join(self._vehicles.names[i] for i in self.missing)
        return f"no odometry of {names}" if names else ""

    @property
    def silent(self) -> list[str]:
        """Names of the simulated players whose input for the present step has not arrived."""
        players = self.simulated.items()
        return [self._vehicles.names[i] for i, p in players if not p.is_ready(self.step)]

    def look(self, time: float) -> None:
        """Update which external players are missing, and the states of the others, at `time`."""
        self.s, self.missing = self.s.copy(), {}
        for i, player in self.external.items():
            sample = player.at(time)
            if sample is None:
                self.missing[i] = player.absence(time)
                continue
            own = self._vehicles.states(i)
            self.s[own] = self._vehicles.observed(i, sample.pose, sample.twist, self.s)

    def mark_published(self) -> None:
        """Record that the present state is published."""
        self.unpublished += self.step - self.published - 1
        self.published = self.step

    def advance(self, time: float) -> None:
        """Advance by one step. Its end is at `time`, in s."""
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
        self.look(time)
        for i in self.external.keys() - self.missing.keys():
            w[vehicles.inputs(i)] = vehicles.input_between(i, before, self.s)
        self.w = w
        self.step += 1

    def status(self, now: float) -> tuple[str, dict[str, object], bytes]:
        """Message, values and level of the status after a step, at the time `now`, in s."""
        names = self._vehicles.names
        figures: dict[str, object] = {"step": self.step - 1, "late_steps": self.late_steps}
        if self.missing:
            figures["idle"] = self.missing_odometry
        for i, player in self.simulated.items():
            figures[f"{names[i]}/late_steps"] = player.late_steps
            if player.latency_ms is not None:
                figures[f"{names[i]}/latency_ms"] = f"{player.latency_ms:.2f}"
        for i, external in self.external.items():
            age = external.age(now)
            figures[f"{names[i]}/odom_age_s"] = "none" if age is None else f"{age:.3f}"
        troubles = []
        if self.missing:
            troubles.append(f"missing: {'; '.join(self.absences)}")
        if self.late:
            troubles.append(f"late: {', '.join(names[i] for i in self.late)}")
        level = diagnostics.WARN if troubles else diagnostics.OK
        return "; ".join(troubles) or "all controls in time", figures, level
