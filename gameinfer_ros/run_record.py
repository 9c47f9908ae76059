"""What happened in one run."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from gameinfer_ros.games import Game


@dataclass
class RunRecord:
    """States, inputs and beliefs of one run, step by step.

    Attributes:
        game: the game that was played.
        states: joint state (nx,) of each step, from 0 on.
        inputs: joint input (nu,) applied at each step; one fewer than states.
        beliefs: weight of each particle by its number, at each step that has a belief.
        maps: number of the MAP particle at each of these steps.
        late_steps: number of steps that somebody's input came too late for.
    """

    game: Game
    states: list[np.ndarray] = field(default_factory=list)
    inputs: list[np.ndarray] = field(default_factory=list)
    beliefs: dict[int, dict[int, float]] = field(default_factory=dict)
    maps: dict[int, int] = field(default_factory=dict)
    late_steps: int = 0

    @property
    def steps(self) -> int:
        """Number of steps that were played."""
        return len(self.inputs)

    @property
    def costs(self) -> np.ndarray:
        """Cost of each player (N,): the sum over the steps that were played."""
        if not self.steps:
            return np.zeros(len(self.game.players))
        x, u = np.array(self.states[: self.steps]), np.array(self.inputs)
        return np.asarray(self.game.costs(x, u).sum(axis=1))

    @property
    def smallest_distance(self) -> float:
        """Smallest distance between two players, in m; infinite if there is one player."""
        distances = self.game.players.distances(np.array(self.states))
        return float(distances.min(initial=np.inf))

    @property
    def map_probability(self) -> float | None:
        """Probability of the MAP equilibrium at the end; None if nobody kept a belief."""
        if not self.beliefs:
            return None
        newest = max(self.beliefs)
        return self.beliefs[newest][self.maps[newest]]

    def summary(self) -> dict[str, Any]:
        """The figures of the run, fit for JSON."""
        distance = self.smallest_distance
        return {
            "cost": [float(cost) for cost in self.costs],
            "smallest_distance": distance if np.isfinite(distance) else None,
            "steps": self.steps,
            "late_steps": self.late_steps,
            "map_probability": self.map_probability,
        }

    def save(self, folder: Path) -> None:
        """Write `run.json` (the figures) and `run.npz` (all else).

        The rows of `beliefs` are step, particle, weight; those of `maps` are step, particle.
        """
        (folder / "run.json").write_text(json.dumps(self.summary(), indent=2) + "\n")
        rows = [
            (step, number, weight)
            for step, weights in sorted(self.beliefs.items())
            for number, weight in weights.items()
        ]
        np.savez_compressed(
            folder / "run.npz",
            states=np.array(self.states),
            inputs=np.array(self.inputs),
            beliefs=np.array(rows, dtype=float).reshape(-1, 3),
            maps=np.array(sorted(self.maps.items()), dtype=int).reshape(-1, 2),
        )
