"""The check of equilibria as a study."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from typing_extensions import override

from gameinfer_ros.experiments.equilibria.equilibria_study import EquilibriaStudy, converged
from gameinfer_ros.experiments.study import Key, Row, Rows, Study, Table, numbers
from gameinfer_ros.solver import best_response
from gameinfer_ros.solver.best_response import CONVERGED

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: What is kept of each player's best response; attributes of `BestResponse`.
QUANTITIES = ("cost", "best_cost", "relative_gap", "moved", "reason")

#: The check fails if a larger share of the searches gave up: a better response may exist.
MOST_GAVE_UP = 0.01


@dataclass(frozen=True)
class CheckStudy(Study):
    """A study that compares the cost of each player with that of its best response to the others.

    Sample k is the one of `EquilibriaStudy`. Samples that did not converge are not checked.

    Attributes:
        tolerance: largest gain, as a share of a player's cost, that a local equilibrium may leave.
    """

    tolerance: float = 0.01

    name: ClassVar[str] = "check"
    description: ClassVar[str] = (
        "The game is solved from many seeds. For each equilibrium and each player, a search looks "
        "for inputs that cost the player less while the others keep their strategies. The gap is "
        "the gain as a share of the player's cost. A search that ends before it converges counts "
        "as given up."
    )

    @property
    @override
    def columns(self) -> tuple[str, ...]:
        of_players = (name for q in QUANTITIES for name in self.columns_of_players(q))
        return ("status", "iterations", "smallest_distance", *of_players)

    @override
    def play(self, key: Key) -> Row:
        game, x0 = self.scenario.game, self.scenario.initial_state
        samples = EquilibriaStudy(self.scenario)
        solution = samples.solve(int(key[0]))
        row: dict[str, int | float | str] = dict.fromkeys(self.columns, np.nan)
        row |= dict.fromkeys(self.columns_of_players("reason"), "not checked")
        row |= samples.outcome(solution)
        if not solution.converged[0]:
            return row
        for i, name in enumerate(self.players):
            response = best_response(game, x0, solution.strategy, i)
            row |= {f"{quantity}_{name}": getattr(response, quantity) for quantity in QUANTITIES}
        return row

    @override
    def figures(self, rows: Rows) -> dict[str, Any]:
        checked = converged(rows)
        gaps = numbers(checked, self.columns_of_players("relative_gap"))
        moved = numbers(checked, self.columns_of_players("moved"))
        above = np.any(gaps > self.tolerance, axis=1)
        collision_distance = EquilibriaStudy(self.scenario).collision_distance
        collided = numbers(checked, ["smallest_distance"])[:, 0] < collision_distance
        reasons = self.columns_of_players("reason")
        gave_up = [sum(row[c] != CONVERGED for row in checked) for c in reasons]
        return {
            "samples": len(rows),
            "converged_share": len(checked) / len(rows),
            "median_iterations": (
                float(np.median(numbers(checked, ["iterations"]))) if checked else None
            ),
            "collided": int(collided.sum()),
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
        conclusive = gave_up <= MOST_GAVE_UP * figures["searches"]
        return figures["converged_share"] > 0 and conclusive and figures["above_tolerance"] == 0

    @override
    def tables(self, figures: Mapping[str, Any]) -> list[Table]:
        rows = [
            [
                name,
                *(_shown(figures["relative_gap"][name][key], "{:.2f} %") for key in _SPREAD),
                *(_shown(figures["moved"][name][key], "{:.1f} cm") for key in _SPREAD[::2]),
                str(figures["gave_up"][name]),
            ]
            for name in self.players
        ]
        header = ["player", "gap: median", "95 %", "largest", "moved: median", "largest", "gave up"]
        samples, share = figures["samples"], figures["converged_share"]
        gave_up = sum(figures["gave_up"].values())
        title = (
            f"gain of each player's best response, as a share of its cost ({samples} seeds, "
            f"{100 * share:.1f} % converged; {gave_up} of {figures['searches']} searches gave up; "
            f"equilibria with a gap above {100 * figures['tolerance']:.3g} %: "
            f"{figures['above_tolerance']}, of which collisions: "
            f"{figures['above_tolerance_collided']})"
        )
        return [Table(title, header, rows)]

    @override
    def draw(self, rows: Rows, figures: Mapping[str, Any]) -> "Figure":
        # Slow to import, and not needed by workers.
        from gameinfer_ros.experiments.check import curves

        gaps = numbers(converged(rows), self.columns_of_players("relative_gap"))
        return curves.draw(self.players, gaps, figures["tolerance"])


_SPREAD = ("median", "percentile_95", "largest")


def _spreads(names: tuple[str, ...], values: np.ndarray) -> dict[str, dict[str, float | None]]:
    """Compute the median, the 95th percentile and the maximum of values (rows, N) per player."""
    if not len(values):
        return {name: dict.fromkeys(_SPREAD) for name in names}
    spreads = np.median(values, axis=0), np.percentile(values, 95, axis=0), values.max(axis=0)
    return {
        name: dict(zip(_SPREAD, of_player.tolist(), strict=True))
        for name, of_player in zip(names, np.transpose(spreads), strict=True)
    }


def _shown(value: float | None, template: str) -> str:
    """Format a value in hundredths of its unit."""
    return "unknown" if value is None else template.format(100 * value)
