"""The study of equilibria, and its samples."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from typing_extensions import override

from gameinfer_ros.experiments.equilibria.clusters import find, find_by_k_means
from gameinfer_ros.experiments.study import (
    Key,
    Row,
    Rows,
    Study,
    Table,
    command,
    metres,
    numbers,
    statistics,
)
from gameinfer_ros.games import Proximity
from gameinfer_ros.runs.seeds import RunSeeds
from gameinfer_ros.solver import GameSolver, Solution, Status, Strategy

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class EquilibriaStudy(Study):
    """A study that solves a game from many seeds and clusters the equilibria.

    Sample k has the seed of the humans in run k of a closed loop. Samples that do not converge are
    excluded, and so are collisions.

    Attributes:
        clusters: number of clusters for k-means; None to determine it by average linkage.
    """

    clusters: int | None = None

    name: ClassVar[str] = "equilibria"
    description: ClassVar[str] = (
        "The game is solved from many seeds. Samples that do not converge are excluded, and so are "
        "those in which two players come closer than half the radius of the proximity cost. The "
        "remaining trajectories are clustered."
    )

    #: Number of steps between positions that are kept.
    STRIDE: ClassVar[int] = 5

    @property
    @override
    def columns(self) -> tuple[str, ...]:
        return ("status", "iterations", *self.cost_columns, "smallest_distance",
                *self.position_columns)  # fmt: skip

    @property
    def position_columns(self) -> tuple[str, ...]:
        """Names of the columns with the position of each player, in m, ordered by step."""
        return tuple(
            f"{axis}_{name}_{k * self.scenario.dt:.6g}"
            for k in self.kept_steps
            for name in self.players
            for axis in ("x", "y")
        )

    @property
    def kept_steps(self) -> range:
        """Steps at which positions are kept."""
        return range(0, self.scenario.horizon + 1, self.STRIDE)

    @property
    def collision_distance(self) -> float:
        """Distance, in m, below which two players collide: half the largest proximity radius."""
        radii = [cost.radius for cost in self.scenario.costs if isinstance(cost, Proximity)]
        return 0.5 * max(radii, default=0.0)

    @override
    def play(self, key: Key) -> Row:
        game, solution = self.scenario.game, self.solve(int(key[0]))
        x, u = solution.strategy.x_ref[..., 0], solution.strategy.u_ref[..., 0]
        costs = game.costs(x, u).sum(axis=1)
        positions = np.round(game.players.positions(x[:: self.STRIDE]), 3).ravel()
        names = (*self.cost_columns, *self.position_columns)
        values = [*costs.tolist(), *positions.tolist()]
        return {**self.outcome(solution), **dict(zip(names, values, strict=True))}

    def solve(self, seed: int) -> Solution:
        """Solve the game from the seed of one sample."""
        return self._solver.solve(self.scenario.initial_state, self._initial(seed))

    def outcome(self, solution: Solution) -> Row:
        """Return the status, the iterations and the smallest distance of a sample's solution."""
        distances = self.scenario.game.players.distances(solution.strategy.x_ref[..., 0])
        return {
            "status": Status(solution.status[0]).name.lower(),
            "iterations": int(solution.iterations[0]),
            "smallest_distance": float(distances.min(initial=np.inf)),
        }

    def initial_trajectories(self, seeds: Sequence[int]) -> np.ndarray:
        """Roll out the initial strategies of K samples to positions (K, S, N, 2), in m."""
        solver, x0 = self._solver, self.scenario.initial_state
        x = np.array([solver.play_out(x0, self._initial(seed)).x_ref[..., 0] for seed in seeds])
        every = max(1, self.scenario.horizon // 20)
        return self.scenario.game.players.positions(x[:, ::every])

    def trajectories(self, rows: Rows) -> np.ndarray:
        """Return the positions (rows, kept steps, N, 2), in m, of the players in some samples."""
        shape = (len(rows), len(self.kept_steps), len(self.players), 2)
        return numbers(rows, self.position_columns).reshape(shape)

    @override
    def figures(self, rows: Rows) -> dict[str, Any]:
        kept = self.kept(rows)
        trajectories, costs = self.trajectories(kept), numbers(kept, self.cost_columns)
        distances = numbers(kept, ["smallest_distance"])[:, 0]
        if self.clusters is None:
            members = find(trajectories)
        else:
            members = find_by_k_means(trajectories, self.clusters, np.random.default_rng(0))
        clusters = [
            {
                "size": len(m),
                "median_cost": np.median(costs[m], axis=0).tolist(),
                "smallest_distance": statistics.finite(distances[m])[distances[m].argmin()],
                "seeds": [int(kept[k]["seed"]) for k in m.tolist()],
            }
            for m in members
        ]
        clusters.sort(key=lambda cluster: cluster["median_cost"][0])
        solved = converged(rows)
        iterations = numbers(solved, ["iterations"])
        return {
            "clusters": clusters,
            "samples": len(rows),
            "not_converged": len(rows) - len(solved),
            "collided": len(solved) - len(kept),
            "collision_distance": self.collision_distance,
            "median_iterations": float(np.median(iterations)) if solved else None,
        }

    def kept(self, rows: Rows) -> Rows:
        """Return the samples that converged without a collision."""
        distance = self.collision_distance
        return [row for row in converged(rows) if float(row["smallest_distance"]) >= distance]

    @override
    def tables(self, figures: Mapping[str, Any]) -> list[Table]:
        clusters = figures["clusters"]
        rows = [
            [
                str(number),
                str(cluster["size"]),
                *(f"{cost:.0f}" for cost in cluster["median_cost"]),
                metres(cluster["smallest_distance"]),
            ]
            for number, cluster in enumerate(clusters, 1)
        ]
        header = ["cluster", "size", *self.players, "smallest distance"]
        excluded = (
            f"of {figures['samples']} seeds, {figures['not_converged']} did not converge and "
            f"{figures['collided']} came closer than {figures['collision_distance']:.2f} m"
        )
        title = f"{len(clusters)} clusters of equilibria, with median costs ({excluded})"
        return [Table(title, header, rows)]

    @override
    def draw(self, rows: Rows, figures: Mapping[str, Any]) -> "Figure":
        # Slow to import, and not needed by workers.
        from gameinfer_ros.experiments.equilibria import panels

        of_seed = {int(row["seed"]): row for row in rows}
        shown = []
        for cluster in figures["clusters"][: panels.MOST]:
            members = [of_seed[seed] for seed in cluster["seeds"]]
            initial = self.initial_trajectories(cluster["seeds"])
            costs = numbers(members, self.cost_columns)
            radii = self.scenario.game.players.radii
            trajectories = self.trajectories(members)
            panel = panels.Panel(trajectories, initial, costs, cluster["median_cost"], radii)
            shown.append(panel)
        return panels.draw(self.players, shown, len(figures["clusters"]))

    @property
    def _solver(self) -> GameSolver:
        return GameSolver(self.scenario.game, self.scenario.solver)

    def _initial(self, seed: int) -> Strategy:
        scenario, rng = self.scenario, np.random.default_rng(RunSeeds.of_run(seed).humans)
        u = scenario.seeds.sample(rng, scenario.game.players, scenario.horizon, 1)
        return Strategy.from_inputs(0, scenario.initial_state, u)


def converged(rows: Rows) -> Rows:
    """Return the samples that converged."""
    return [row for row in rows if row["status"] == Status.CONVERGED.name.lower()]


def run(options: argparse.Namespace) -> int:
    """Run the study that the options describe, and return the exit code."""
    return command.run(
        options, options.samples, lambda scenario: EquilibriaStudy(scenario, options.k_means)
    )
