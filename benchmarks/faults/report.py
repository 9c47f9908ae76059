"""What a campaign has shown."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.table import Table

#: Figures of promises, by what they are called in the table.
PROMISES = {
    "oldest state, steps": "oldest_state_steps",
    "oldest strategy, steps": "oldest_strategy_steps",
    "brakes within, steps": "brake_steps",
    "goes on after, s": "resume_s",
    "belief after, steps": "rebuild_steps",
}

#: Figures of which the lowest is the worst.
_LOWEST = ("same_map", "slowest_m_s", "messages_per_s", "judged_inputs")


def worst(figures: list[dict[str, float]]) -> dict[str, float]:
    """The worst figure of all trials; not every trial has every figure."""
    names = {name: None for trial in figures for name in trial}
    return {
        name: (min if name in _LOWEST else max)(trial[name] for trial in figures if name in trial)
        for name in names
    }


def show(told: dict[str, Any], console: Console) -> None:
    """Print all figures as one table, and then what was broken."""
    table = Table("fault", "held", *PROMISES, "other figures")
    for name, row in told.items():
        figures = dict(row["worst"])
        promised = [figures.pop(key, None) for key in PROMISES.values()]
        others = ", ".join(f"{key} {value:.3g}" for key, value in figures.items())
        cells = ["" if value is None else f"{value:.3g}" for value in promised]
        table.add_row(name, f"{row['held']} of {row['trials']}", *cells, others)
    console.print(table)
    for name, row in told.items():
        for what in row["broken"]:
            console.print(f"{name}: {what}", markup=False)
