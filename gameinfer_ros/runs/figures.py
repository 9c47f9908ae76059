"""The figures of a run in the terminal."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.table import Table


def print_figures(players: Sequence[str], figures: Mapping[str, Any], console: Console) -> None:
    """Print the costs, the smallest distance and the steps in a `RunRecord.summary`."""
    costs = Table("player")
    costs.add_column("cost", justify="right")
    for name, cost in zip(players, figures["cost"], strict=True):
        costs.add_row(name, f"{cost:.1f}")
    console.print(costs)
    if figures["smallest_distance"] is not None:
        console.print(f"Smallest distance: {figures['smallest_distance']:.2f} m")
    console.print(f"Steps: {figures['steps']}, late: {figures['late_steps']}")
    if figures["missing_steps"]:
        console.print(f"Missing states: {figures['missing_steps']}")
