"""The study of planning: a robot that aligns against the baseline."""

import argparse
import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from typing_extensions import override

from gameinfer_ros.experiments.planning.ros_run import run_on_ros
from gameinfer_ros.experiments.study import (
    Key,
    Row,
    Rows,
    Study,
    Table,
    command,
    metres,
    milliseconds,
    numbers,
    statistics,
)
from gameinfer_ros.names.choices import BASELINE, MAP
from gameinfer_ros.runs import closed_loop
from gameinfer_ros.runs.record import RunRecord
from gameinfer_ros.solver import GameSolver

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Columns with the number of steps in which the safety layer braked and limited the robot.
SAFETY_COLUMNS = ("safety_braked", "safety_limited")

#: Distance, in m, below which two players collide if no player has a radius.
COLLISION = 0.5


@dataclass(frozen=True)
class PlanningStudy(Study):
    """A study that compares a robot that aligns with one that keeps a random equilibrium.

    Runs with the same seed have the same humans.

    Attributes:
        on_ros: whether the nodes play the runs, in lockstep; the results are the same.
        safety: whether the robot has a safety layer.
    """

    on_ros: bool = False
    safety: bool = False

    name: ClassVar[str] = "planning"
    description: ClassVar[str] = (
        "The humans of each run meet two robots in the closed loop: one aligns with the most "
        "likely equilibrium, the other keeps an equilibrium drawn at random (the baseline). "
        "Differences are taken run by run."
    )
    key_columns: ClassVar[tuple[str, ...]] = ("seed", "planner")
    time_columns: ClassVar[tuple[str, ...]] = ("mean_step_ms", "median_step_ms", "max_step_ms")

    @property
    @override
    def made_by(self) -> str:
        return ("nodes" if self.on_ros else "core") + ", with a safety layer" * self.safety

    @property
    @override
    def irrelevant(self) -> dict[str, Any]:
        return {"solver": {"threads"}} if self.safety else super().irrelevant

    @property
    @override
    def columns(self) -> tuple[str, ...]:
        safety = SAFETY_COLUMNS if self.safety else ()
        return (*self.cost_columns, "smallest_distance", "steps", *safety, "trajectory_sha256")

    @property
    def collision_distance(self) -> float:
        """Distance, in m, below which two players collide: that of contact if any has a radius."""
        return 0.0 if self.scenario.game.players.radii.any() else COLLISION

    @override
    def keys(self, seeds: Iterable[int]) -> list[Key]:
        return [(seed, planner) for seed in seeds for planner in (MAP, BASELINE)]

    @override
    def play(self, key: Key) -> Row:
        seed, planner = int(key[0]), str(key[1])
        if self.on_ros:
            record = run_on_ros(self.scenario, planner, seed, self.safety)
        else:
            # The measured times must not include the loading of compiled code.
            GameSolver(self.scenario.game, self.scenario.solver).warm_up()
            record = closed_loop.run(self.scenario, planner, seed, self.safety)
        step_ms = np.array(record.step_ms or [np.nan])
        return {
            **dict(zip(self.cost_columns, record.costs.tolist(), strict=True)),
            "smallest_distance": record.smallest_distance,
            "steps": record.steps,
            "safety_braked": record.safety_braked or 0,
            "safety_limited": record.safety_limited or 0,
            "trajectory_sha256": _digest(record),
            "mean_step_ms": round(float(step_ms.mean()), 3),
            "median_step_ms": round(float(np.median(step_ms)), 3),
            "max_step_ms": round(float(step_ms.max()), 3),
        }

    def costs(self, rows: Rows, planner: str) -> np.ndarray:
        """Return the cost (runs, N) of the runs with a planner to each player, by seed."""
        return numbers(_of(rows, planner), self.cost_columns)

    @override
    def figures(self, rows: Rows) -> dict[str, Any]:
        figures = {planner: self._figures_of(_of(rows, planner)) for planner in (MAP, BASELINE)}
        extra = self.costs(rows, BASELINE) - self.costs(rows, MAP)
        figures[BASELINE] |= {
            "paired_extra_cost": extra.mean(axis=0).tolist(),
            "paired_half_interval_95": statistics.finite(statistics.half_interval(extra)),
        }
        return figures

    def _figures_of(self, rows: Rows) -> dict[str, Any]:
        """Summarise the runs with one planner."""
        costs = numbers(rows, self.cost_columns)
        distances = numbers(rows, ["smallest_distance"])[:, 0]
        smallest, median = statistics.finite(np.quantile(distances, [0.0, 0.5]))
        mean_ms, median_ms, max_ms = numbers(rows, self.time_columns).T
        mean_step, median_step, longest_step = statistics.finite(
            np.array([mean_ms.mean(), np.median(median_ms), max_ms.max()])
        )
        figures = {
            "mean_cost": costs.mean(axis=0).tolist(),
            "sem": statistics.finite(statistics.sem(costs)),
            "half_interval_95": statistics.finite(statistics.half_interval(costs)),
            "median_cost": np.median(costs, axis=0).tolist(),
            "smallest_distance": smallest,
            "median_smallest_distance": median,
            "collision_share": float(np.mean(distances < self.collision_distance)),
            "step_ms": mean_step,
            "median_step_ms": median_step,
            "max_step_ms": longest_step,
            "runs": len(rows),
        }
        if self.safety:
            braked, limited = numbers(rows, SAFETY_COLUMNS).T
            figures |= {
                "safety_steps": {"braked": float(braked.mean()), "limited": float(limited.mean())},
                "safety_braked_share": float(np.mean(braked > 0)),
            }
        return figures

    @override
    def tables(self, figures: Mapping[str, Any]) -> list[Table]:
        robots = {"aligned": figures[MAP], "baseline": figures[BASELINE]}
        columns = (
            *((robot["mean_cost"], robot["half_interval_95"]) for robot in robots.values()),
            (figures[BASELINE]["paired_extra_cost"], figures[BASELINE]["paired_half_interval_95"]),
        )
        costs = Table(
            f"mean costs of {figures[MAP]['runs']} runs with each robot (± 95 % interval)",
            ["player", "robot aligned", "robot baseline", "difference, run by run"],
            [
                [name, *(_plus_minus(means[i], halves[i]) for means, halves in columns)]
                for i, name in enumerate(self.players)
            ],
        )
        others = Table(
            f"distances, collisions (below {self.collision_distance:g} m), and step times during "
            "parallel runs",
            ["robot", "smallest", "median", "collisions", "mean step", "median step"],
            [
                [
                    name,
                    *(metres(robot[f"{which}smallest_distance"]) for which in ("", "median_")),
                    f"{100 * robot['collision_share']:.1f} %",
                    *(milliseconds(robot[f"{which}step_ms"]) for which in ("", "median_")),
                ]
                for name, robot in robots.items()
            ],
        )
        if not self.safety:
            return [costs, others]
        layer = Table(
            "interventions of the safety layer",
            ["robot", "runs with braking", "braked steps per run", "limited steps per run"],
            [
                [
                    name,
                    f"{100 * robot['safety_braked_share']:.1f} %",
                    *(f"{robot['safety_steps'][what]:.1f}" for what in ("braked", "limited")),
                ]
                for name, robot in robots.items()
            ],
        )
        return [costs, others, layer]

    @override
    def draw(self, rows: Rows, figures: Mapping[str, Any]) -> "Figure":
        # Slow to import, and not needed by workers.
        from gameinfer_ros.experiments.planning import violins

        costs = {planner: self.costs(rows, planner) for planner in (MAP, BASELINE)}
        return violins.draw(costs, self.players)


def _of(rows: Rows, planner: str) -> Rows:
    return [row for row in rows if row["planner"] == planner]


def _digest(record: RunRecord) -> str:
    """Return a digest that differs between runs unless all states and inputs are equal."""
    digest = hashlib.sha256()
    for array in (*record.states, *record.inputs):
        digest.update(np.ascontiguousarray(array, dtype=float).tobytes())
    return digest.hexdigest()[:16]


def _plus_minus(mean: float, half: float | None) -> str:
    return f"{mean:.0f}" if half is None else f"{mean:.0f} ± {half:.0f}"


def run(options: argparse.Namespace) -> int:
    """Run the study that the options describe, and return the exit code."""
    return command.run(
        options, options.runs, lambda scenario: PlanningStudy(scenario, options.ros, options.safety)
    )
