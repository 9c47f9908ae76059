"""The data of a run for the pages that show it."""

import math
import time
from collections.abc import Mapping, Sequence
from threading import Lock
from typing import Any, NamedTuple

import numpy as np

from gameinfer_ros.games import goal_positions
from gameinfer_ros.names import colours
from gameinfer_ros.scenario import Scenario

#: Largest number of states in one update; a long history needs several updates.
PIECE = 500

#: Time after the start of a pause, in s, in which delayed states may still arrive.
SETTLING = 1.0

#: Largest number of nodes that report solve times.
MOST_SOLVERS = 100


class Mark(NamedTuple):
    """The part of a run that a page has received; by default, nothing."""

    run: int = -1  # number of the run
    states: int = 0  # number of states
    solves: int = 0  # number of solve times
    beliefs: int = 0  # number of beliefs of the run; a page receives only the newest
    trajectories: int = 0  # number of sets of trajectories; a page receives only the newest


class Trajectory(NamedTuple):
    """The predicted trajectory of a player, by a particle or the MAP equilibrium."""

    player: str  # its name
    number: int  # that of the particle; in the MAP equilibrium, that of the player
    opacity: float  # of the line, from 0 to 1
    points: np.ndarray  # positions (S, 2), in m


class LiveRun:
    """The current run as received so far, with updates for the pages that show it.

    One thread may add data while another one reads. Rows are computed when they are first read.
    """

    def __init__(self, scenario: Scenario, title: str, steps: int) -> None:
        self._scenario, self._game, self._vehicles = scenario, scenario.game, scenario.vehicles
        self._title, self._steps = title, steps
        self._lock = Lock()
        self._run = 0
        self._advanced = self._paused = -math.inf
        self.begin()
        start = scenario.initial_vehicle_state
        self._costs(0, start, np.zeros(self._vehicles.n_inputs))  # loads the kernels

    def begin(self) -> None:
        """Begin a new run: everything added from now on belongs to it."""
        with self._lock:
            self._run += 1
            self._states: list[tuple[int, np.ndarray, np.ndarray]] = []
            self._rows: list[dict[str, Any]] = []
            self._arrival = -math.inf
            self._solves: list[tuple[str, int, float]] = []
            self._belief: dict[str, Any] = {}
            self._beliefs = 0
            self._particles: Sequence[Trajectory] = ()
            self._map: Sequence[Trajectory] = ()
            self._trajectories = 0

    @property
    def newest(self) -> int:
        """Newest step; -1 if there is none."""
        return self._states[-1][0] if self._states else -1

    def add_state(self, step: int, s: np.ndarray, w: np.ndarray) -> None:
        """Add the next state (ns,) of the vehicles, and the input (nw,) that was applied before."""
        with self._lock:
            self._states.append((step, s, w))
            self._arrival = time.monotonic()
            if step > 0:
                self._advanced = self._arrival

    def add_belief(self, step: int, likeliest: int, weights: Mapping[int, float]) -> None:
        """Add the belief at a step: the number of the MAP particle, and all weights by number."""
        with self._lock:
            self._beliefs += 1
            self._belief = {"step": step, "map": likeliest, "weights": sorted(weights.items())}

    def add_solve_time(self, node: str, step: int, ms: float) -> None:
        """Add the time, in ms, that a node took to solve games at a step.

        Raises:
            ValueError: the time is not finite, or there are too many times for `MOST_SOLVERS`.
        """
        if not math.isfinite(ms):
            raise ValueError(f"{ms} ms is not allowed: it must be a finite number")
        with self._lock:
            if len(self._solves) >= MOST_SOLVERS * (self.newest + 2):  # one may precede its state
                raise ValueError(f"{len(self._solves)} solve times are known: more are ignored")
            self._solves.append((node, step, ms))

    def add_trajectories(
        self, particles: Sequence[Trajectory], likeliest: Sequence[Trajectory]
    ) -> None:
        """Set the newest predicted trajectories, of all particles and of the MAP equilibrium."""
        with self._lock:
            self._trajectories += 1
            self._particles, self._map = particles, likeliest

    def set_paused(self, paused: bool) -> None:
        """Record that the run was paused or resumed."""
        with self._lock:
            self._paused = time.monotonic() if paused else -math.inf

    def since(self, mark: Mark) -> tuple[dict[str, Any], Mark]:
        """Return what is new to a page, as a JSON object, and the mark of the page after it.

        Every update has the fields

        - `run`: number of the run;
        - `over`: whether all steps have been played;
        - `paused`: whether the run is paused;
        - `age`: time since the newest state, in s, or None;
        - `more`: whether another update follows at once.

        Only if they are new to the page, it has the fields

        - `scenario`: the run has changed, and the page must forget the earlier one;
        - `states`: rows with `step`, `poses` (x, y, yaw of each player, in m and rad), `clearance`
          (smallest distance in m, from edge to edge, or None), and `costs` (of each player in the
          step before; None if the state before is missing);
        - `solves`: rows of node, step and ms;
        - `belief`: with `step`, `map` and `weights`;
        - `trajectories`: with `particles` and `map`.
        """
        with self._lock:
            update: dict[str, Any] = {"run": self._run}
            if mark.run != self._run:
                mark = Mark(self._run)
                update["scenario"] = self._describe()
            states = min(len(self._states), mark.states + PIECE)
            while len(self._rows) < states:
                self._rows.append(self._row(len(self._rows)))
            if states > mark.states:
                update["states"] = self._rows[mark.states : states]
            if len(self._solves) > mark.solves:
                update["solves"] = self._solves[mark.solves :]
            if self._beliefs > mark.beliefs:
                update["belief"] = self._belief
            if self._trajectories > mark.trajectories:
                update["trajectories"] = {
                    "particles": [_flat(t) for t in self._particles],
                    "map": [_flat(t) for t in self._map],
                }
            now = time.monotonic()
            # Another client may have resumed the run, so its states decide.
            update["paused"] = self._advanced < self._paused + SETTLING < math.inf
            update["over"] = self.newest >= self._steps
            update["age"] = now - self._arrival if self._states else None
            update["more"] = states < len(self._states)
            return update, Mark(
                self._run, states, len(self._solves), self._beliefs, self._trajectories
            )

    def _describe(self) -> dict[str, Any]:
        goals = goal_positions(self._game)
        start = self._vehicles.positions(self._scenario.initial_vehicle_state)
        return {
            "title": self._title,
            "dt": self._game.dt,
            "steps": self._steps,
            "players": [
                {
                    "name": name,
                    "colour": colours.of_player(i),
                    "radius": float(self._vehicles.radii[i]),
                    "start": start[i].tolist(),
                    "goals": goals[i].tolist(),
                }
                for i, name in enumerate(self._game.players.names)
            ],
        }

    def _row(self, index: int) -> dict[str, Any]:
        step, s, w = self._states[index]
        costs = None
        if index > 0 and self._states[index - 1][0] == step - 1:
            costs = self._costs(step - 1, self._states[index - 1][1], w).tolist()
        distances = self._vehicles.distances(s)
        return {
            "step": step,
            "poses": self._vehicles.poses(s)[: len(self._vehicles)].tolist(),
            "clearance": float(distances.min()) if len(distances) else None,
            "costs": costs,
        }

    def _costs(self, step: int, s: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Return the cost of one step to each player (N,)."""
        x, u = self._vehicles.game_state(s), self._vehicles.game_input(s, w)
        return np.asarray(self._game.costs(x[None], u[None], step)[:, 0])


def _flat(trajectory: Trajectory) -> dict[str, Any]:
    """Convert a trajectory for JSON, with its points as x, y, x, y, ..., in mm precision."""
    return {
        "player": trajectory.player,
        "number": trajectory.number,
        "opacity": round(trajectory.opacity, 4),
        "points": np.round(trajectory.points, 3).ravel().tolist(),
    }
