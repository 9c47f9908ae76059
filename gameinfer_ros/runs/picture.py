"""The picture of a run: who went where, and what the robot believed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from gameinfer_ros.names import colours
from gameinfer_ros.runs.record import RunRecord


def draw(record: RunRecord, path: Path, title: str) -> None:
    """Write a picture of the run to a PNG or PDF file."""
    figure = Figure(figsize=(11, 5), layout="constrained")
    figure.suptitle(title)
    ways, belief = figure.subplots(1, 2)
    _draw_ways(ways, record)
    draw_belief(belief, record)
    figure.savefig(path, dpi=120)


def _draw_ways(axes, record: RunRecord) -> None:  # type: ignore[no-untyped-def]
    vehicles, states = record.vehicles, np.array(record.states)
    positions = vehicles.positions(states)
    distances = vehicles.distances(states).min(axis=1, initial=np.inf)
    closest = int(np.nanargmin(distances))
    for i, name in enumerate(vehicles.names):
        colour = colours.of_player(i)
        x, y = positions[:, i].T
        axes.plot(x, y, color=colour, label=name)
        axes.plot(x[0], y[0], "o", color=colour, markersize=7)
        axes.plot(x[-1], y[-1], "*", color=colour, markersize=12)
        axes.plot(x[closest], y[closest], "D", color=colour, markersize=6, fillstyle="none")
    axes.set_aspect("equal")
    axes.set_xlabel("x in m")
    axes.set_ylabel("y in m")
    axes.set_title("ways: start (dot), closest (diamond), end (star)")
    axes.legend()


def draw_belief(axes, record: RunRecord) -> None:  # type: ignore[no-untyped-def]
    """Draw the belief of a run into `axes`: a band for each particle, over time."""
    axes.set_title("belief: one band for each equilibrium")
    axes.set_xlabel("time in s")
    axes.set_ylabel("probability")
    axes.set_ylim(0, 1)
    if not record.beliefs:
        axes.text(0.5, 0.5, "nobody kept a belief", ha="center", transform=axes.transAxes)
        return
    steps = sorted(record.beliefs)
    # Particles that were heavy at some time come first, so that they get colours of their own.
    peak: dict[int, float] = {}
    for weights in record.beliefs.values():
        for number, weight in weights.items():
            peak[number] = max(peak.get(number, 0.0), weight)
    numbers = sorted(peak, key=lambda number: -peak[number])
    bands = [[record.beliefs[step].get(number, 0.0) for step in steps] for number in numbers]
    axes.stackplot(
        np.array(steps) * record.game.dt, bands, edgecolor="white", linewidth=0.3,
        labels=[f"particle {number}" for number in numbers[:6]],
    )  # fmt: skip
    axes.margins(x=0)
    axes.legend(loc="lower right", fontsize="small")
