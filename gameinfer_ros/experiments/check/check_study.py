"""The check of equilibria."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from matplotlib.figure import Figure
from typing_extensions import override

from gameinfer_ros.experiments.check import curves
from gameinfer_ros.experiments.equilibria.equilibria_study import EquilibriaStudy
from gameinfer_ros.experiments.study import Key, Row, Rows, Study, Table, numbers
from gameinfer_ros.solver import Status, best_response
from gameinfer_ros.solver.best_response import CONVERGED

#: With a larger share of searches that gave up, it is not known what there is to be gained.
MOST_GAVE_UP = 0.01


@dataclass(frozen=True)
class CheckStudy(Study):
    """Compares what each equilibrium costs each player with its best response to the others.

    Sample k is that of the study of equilibria. Those that did not converge are no equilibria,
    and not checked. A search that gave up may have missed what there is to be gained, so the check
    does not hold if more than `MOST_GAVE_UP` of them did.

    Attributes:
        tolerance: an equilibrium counts as a local one if no player gains a larger share of its
            cost.
    """

    tolerance: float = 0.01

    name: ClassVar[str] = "check"
    description: ClassVar[str] = (
        "The game is solved from many seeds. For each equilibrium and each player, other inputs "
        "are sought that cost the player less while all others keep to their strategies. What it "
        "gains, as a share of its cost, is the gap. A search that ends before it has converged is "
        "counted as one that gave up."
    )

    @property
    @override
    def columns(self) -> tuple[str, ...]:
        every = (self.cost_columns, self.best_columns, self.gap_columns, self.moved_columns)
        return ("status", "iterations", "smallest_distance",
                *(name for group in every for name in group), *self.reason_columns)  # fmt: skip

    @property
    def best_columns(self) -> tuple[str, ...]:
        """Names of columns with the cost of each player's best response."""
        return self._columns("best_cost")

    @property
    def gap_columns(self) -> tuple[str, ...]:
        """Names of columns with each player's relative gap."""
        return self._columns("relative_gap")

    @property
    def moved_columns(self) -> tuple[str, ...]:
        """Names of columns that tell how far, in m, its best response moves each player."""
        return self._columns("moved")

    @property
    def reason_columns(self) -> tuple[str, ...]:
        """Names of columns that tell why the search for each player's best response ended."""
        return self._columns("reason")

    def _columns(self, what: str) -> tuple[str, ...]:
        return tuple(f"{what}_{name}" for name in self.players)

    @override
    def play(self, key: Key) -> Row:
        game, x0 = self.scenario.game, self.scenario.initial_state
        solution = EquilibriaStudy(self.scenario).solve(int(key[0]))
        x = solution.strategy.x_ref[..., 0]
        row: dict[str, int | float | str] = dict.fromkeys(self.columns, np.nan)
        row |= dict.fromkeys(self.reason_columns, "not checked")
        row["status"] = Status(solution.status[0]).name.lower()
        row["iterations"] = int(solution.iterations[0])
        row["smallest_distance"] = float(game.players.distances(x).min(initial=np.inf))
        if not solution.converged[0]:
            return row
        for i, name in enumerate(self.players):
            response = best_response(game, x0, solution.strategy, i)
            row[f"cost_{name}"] = response.cost
            row[f"best_cost_{name}"] = response.best_cost
            row[f"relative_gap_{name}"] = response.relative_gap
            row[f"moved_{name}"] = response.moved
            row[f"reason_{name}"] = response.reason
        return row

    def checked(self, rows: Rows) -> Rows:
        """The samples that converged."""
        return [row for row in rows if row["status"] == Status.CONVERGED.name.lower()]

    @override
    def figures(self, rows: Rows) -> dict[str, Any]:
        checked = self.checked(rows)
        gaps, moved = numbers(checked, self.gap_columns), numbers(checked, self.moved_columns)
        above = np.any(gaps > self.tolerance, axis=1)
        collision_distance = EquilibriaStudy(self.scenario).collision_distance
        collided = numbers(checked, ["smallest_distance"])[:, 0] < collision_distance
        gave_up = [sum(row[c] != CONVERGED for row in checked) for c in self.reason_columns]
        return {
            "samples": len(rows),
            "converged_share": len(checked) / len(rows),
            "searches": len(checked) * len(self.players),
            "gave_up": dict(zip(self.players, gave_up, strict=True)),
            "tolerance": self.tolerance,
            "above_tolerance": int(above.sum()),
            "above_tolerance_collided": int((above & collided).sum()),
            "seeds_above_tolerance": numbers(checked, ["seed"])[above, 0].astype(int).tolist(),
            "relative_gap": _spreads(self.players, gaps),
            "moved": _spreads(self.players, moved),
        }

    @override
    def holds(self, figures: Mapping[str, Any]) -> bool:
        gave_up = sum(figures["gave_up"].values())
        found_out = gave_up <= MOST_GAVE_UP * figures["searches"]
        return figures["converged_share"] > 0 and found_out and figures["above_tolerance"] == 0

    @override
    def tables(self, figures: Mapping[str, Any]) -> list[Table]:
        rows = []
        for name in self.players:
            gap, moved = figures["relative_gap"][name], figures["moved"][name]
            rows.append(
                [
                    name,
                    *(_percent(gap[key]) for key in _SPREAD),
                    *(_centimetres(moved[key]) for key in ("median", "largest")),
                    str(figures["gave_up"][name]),
                ]
            )
        header = ["player", "gap: median", "95 %", "largest", "moved: median", "largest", "gave up"]
        samples, share = figures["samples"], figures["converged_share"]
        gave_up = sum(figures["gave_up"].values())
        title = (
            f"what each player would gain by other inputs, as a share of its cost ({samples} "
            f"seeds, {100 * share:.1f} % converged; {gave_up} of {figures['searches']} "
            f"searches gave up; {figures['above_tolerance']} equilibria are "
            f"above {100 * figures['tolerance']:.3g} % for somebody, of which "
            f"{figures['above_tolerance_collided']} are collisions)"
        )
        return [Table(title, header, rows)]

    @override
    def draw(self, rows: Rows, figures: Mapping[str, Any]) -> Figure:
        gaps = numbers(self.checked(rows), self.gap_columns)
        return curves.draw(self.players, gaps, figures["tolerance"])


_SPREAD = ("median", "percentile_95", "largest")


def _spreads(names: tuple[str, ...], values: np.ndarray) -> dict[str, dict[str, float | None]]:
    """Median, 95th percentile and largest of values (rows, N) of each player."""
    if not len(values):
        return {name: dict.fromkeys(_SPREAD) for name in names}
    of_each = (np.median(values, axis=0), np.percentile(values, 95, axis=0), values.max(axis=0))
    return {
        name: dict(zip(_SPREAD, (float(spread[i]) for spread in of_each), strict=True))
        for i, name in enumerate(names)
    }


def _percent(share: float | None) -> str:
    return "unknown" if share is None else f"{100 * share:.2f} %"


def _centimetres(length: float | None) -> str:
    return "unknown" if length is None else f"{100 * length:.1f} cm"
