"""The record of a run."""

import json
import sys
from dataclasses import dataclass, field
from itertools import chain, repeat
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from typing_extensions import Self

from gameinfer_ros.games import Game, Vehicles
from gameinfer_ros.names.text import json_text

#: Files of a run: its figures, and its arrays.
RUN_JSON, RUN_NPZ = "run.json", "run.npz"

#: Largest number of missing states of a run: 28 hours at ten steps per second.
MOST_MISSING = 1_000_000


@dataclass
class RunRecord:
    """States, inputs and beliefs of one run.

    Attributes:
        vehicles: the vehicles of the players.
        states: joint state (ns,) of the vehicles at each step, from 0 on; NaN if it is missing.
        inputs: joint input (nw,) of the vehicles at each step but the last.
        beliefs: weight of each particle by its number, at each step with a belief.
        maps: number of the MAP particle at each of these steps.
        late_steps: number of steps for which an input came too late.
        step_ms: time that the robot computed for each step, in ms; empty if it was not measured.
        safety_braked: number of steps in which the safety layer braked the robot; None if the robot
            has no safety layer or the number is unknown.
        safety_limited: number of steps in which the safety layer limited the robot's input; None
            like `safety_braked`.
    """

    vehicles: Vehicles
    states: list[np.ndarray] = field(default_factory=list)
    inputs: list[np.ndarray] = field(default_factory=list)
    beliefs: dict[int, dict[int, float]] = field(default_factory=dict)
    maps: dict[int, int] = field(default_factory=dict)
    late_steps: int = 0
    step_ms: list[float] = field(default_factory=list)
    safety_braked: int | None = None
    safety_limited: int | None = None
    _left_out: int = field(default=0, init=False, repr=False, compare=False)

    @property
    def game(self) -> Game:
        """Game that the players play."""
        return self.vehicles.game

    def add_state(self, step: int, s: np.ndarray, w: np.ndarray) -> None:
        """Add the next state; the states of skipped steps are missing.

        Args:
            step: the step, later than all steps before.
            s: joint state (ns,) of the vehicles at the step.
            w: joint input (nw,) of the vehicles that led to this state.

        Raises:
            ValueError: the step is not later, or more than `MOST_MISSING` states would be missing.
        """
        gap = step - len(self.states)
        if gap < 0:
            raise ValueError(
                f"step {step} is not allowed: it must be later than step {len(self.states) - 1}"
            )
        if self._left_out + gap > MOST_MISSING:
            raise ValueError(
                f"step {step} is not allowed: {self._left_out + gap} states would be missing, but "
                f"at most {MOST_MISSING} may be missing"
            )
        self._left_out += gap
        missing = np.full_like(s, np.nan), np.full_like(w, np.nan)  # shared, to save memory
        for state, applied in chain(repeat(missing, gap), [(s, w)]):
            if self.states:
                self.inputs.append(applied)
            self.states.append(state)

    @property
    def _known(self) -> np.ndarray:
        """Whether the state of each step is known (S,)."""
        return np.fromiter((isfinite(s[0]) for s in self.states), bool, len(self.states))

    @property
    def missing_steps(self) -> int:
        """Number of steps whose state is missing."""
        return int((~self._known).sum())

    @property
    def steps(self) -> int:
        """Number of steps played."""
        return len(self.inputs)

    @property
    def costs(self) -> np.ndarray:
        """Cost of the game to each player (N,), summed over the known steps.

        A step is known if both its state and the next one are.
        """
        # Both give the same to the last bit. Who only reads a record needs no compiler.
        evaluate = self.game.costs if "numba" in sys.modules else self.game.plain_costs
        known = self._known
        edges = np.flatnonzero(np.diff(known, prepend=False, append=False))
        found = [np.zeros((0, len(self.vehicles)))]
        for begin, end in edges.reshape(-1, 2):  # each stretch without missing states
            s, w = np.array(self.states[begin:end]), self.inputs[begin : end - 1]
            if w:
                x = self.vehicles.game_state(s[:-1])
                u = self.vehicles.game_input(s[:-1], np.array(w))
                found.append(evaluate(x, u, int(begin)).T)
        return np.asarray(np.concatenate(found).sum(axis=0))

    @property
    def smallest_distance(self) -> float:
        """Smallest distance between two players, in m; infinite if there is one player.

        It is measured from edge to edge, and negative if they overlapped.
        """
        known = [self.states[step] for step in np.flatnonzero(self._known)]
        distances = self.vehicles.distances(np.array(known))
        return float(distances.min(initial=np.inf))

    @property
    def map_probability(self) -> float | None:
        """Probability of the MAP equilibrium in the last belief; None if there is no belief."""
        if not self.beliefs:
            return None
        newest = max(self.beliefs)
        return self.beliefs[newest].get(self.maps[newest], 0.0)

    def summary(self) -> dict[str, Any]:
        """Compute the figures of the run, as a JSON object."""
        distance = self.smallest_distance
        return {
            "cost": [float(cost) for cost in self.costs],
            "smallest_distance": distance if np.isfinite(distance) else None,
            "steps": self.steps,
            "late_steps": self.late_steps,
            "missing_steps": self.missing_steps,
            "map_probability": self.map_probability,
            "safety_braked": self.safety_braked,
            "safety_limited": self.safety_limited,
        }

    def save(self, folder: Path) -> None:
        """Write the figures to `run.json` and the arrays to `run.npz`.

        Rows of the array `beliefs` are step, particle, weight; rows of `maps` are step, particle.
        """
        (folder / RUN_JSON).write_text(json_text(self.summary(), indent=2) + "\n")
        rows = [
            (step, number, weight)
            for step, weights in sorted(self.beliefs.items())
            for number, weight in weights.items()
        ]
        np.savez_compressed(
            folder / RUN_NPZ,
            states=np.array(self.states),
            inputs=np.array(self.inputs),
            beliefs=np.array(rows, dtype=float).reshape(-1, 3),
            maps=np.array(sorted(self.maps.items()), dtype=int).reshape(-1, 2),
            step_ms=np.array(self.step_ms),
        )

    @classmethod
    def load(cls, folder: Path, vehicles: Vehicles) -> Self:
        """Read what `save` wrote about a run of these vehicles.

        The counts of the safety layer are unknown in files of older versions.

        Raises:
            OSError: a file cannot be read.
            KeyError: a field is missing, because another version of this package wrote the files.
        """
        summary = json.loads((folder / RUN_JSON).read_text())
        with np.load(folder / RUN_NPZ) as arrays:
            beliefs: dict[int, dict[int, float]] = {}
            for step, number, weight in arrays["beliefs"].tolist():
                beliefs.setdefault(int(step), {})[int(number)] = weight
            return cls(
                vehicles,
                list(arrays["states"]),
                list(arrays["inputs"]),
                beliefs,
                dict(arrays["maps"].tolist()),
                summary["late_steps"],
                arrays["step_ms"].tolist(),
                summary.get("safety_braked"),
                summary.get("safety_limited"),
            )
