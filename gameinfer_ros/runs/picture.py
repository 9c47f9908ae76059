"""The figure of a run: the paths of the players, and the belief of the robot."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from gameinfer_ros.names import colours
from gameinfer_ros.runs.record import RunRecord


def draw(record: RunRecord, path: Path, title: str) -> None:
    """Draw a run, and write the figure to a PNG or PDF file."""
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
        if vehicles.radii[i] > 0:
            disc = Circle(positions[closest, i], vehicles.radii[i], color=colour, alpha=0.25)
            axes.add_patch(disc)
    axes.set(aspect="equal", xlabel="x in m", ylabel="y in m")
    axes.set_title("paths: start (dot), closest approach (diamond), end (star)")
    axes.legend()


def draw_belief(axes, record: RunRecord) -> None:  # type: ignore[no-untyped-def]
    """Draw the weights of the particles over time into `axes`, as stacked bands."""
    axes.set_title("belief: one band for each equilibrium")
    axes.set(xlabel="time in s", ylabel="probability", ylim=(0, 1))
    if not record.beliefs:
        axes.text(0.5, 0.5, "no belief", ha="center", transform=axes.transAxes)
        return
    times, weights = weights_over_time(record)
    axes.stackplot(
        times, *weights.values(), edgecolor="white", linewidth=0.3,
        labels=[f"particle {number}" for number in list(weights)[:6]],
    )  # fmt: skip
    axes.margins(x=0)
    axes.legend(loc="lower right", fontsize="small")


def weights_over_time(record: RunRecord) -> tuple[np.ndarray, dict[int, list[float]]]:
    """Return the times (S,) of the beliefs, in s, and the weights (S,) of each particle by number.

    The particles with the largest peaks come first, so that their colours in a plot are distinct.
    """
    steps = sorted(record.beliefs)
    peak: dict[int, float] = {}
    for weights in record.beliefs.values():
        for number, weight in weights.items():
            peak[number] = max(peak.get(number, 0.0), weight)
    numbers = sorted(peak, key=lambda number: -peak[number])
    series = {n: [record.beliefs[step].get(n, 0.0) for step in steps] for n in numbers}
    return np.array(steps) * record.game.dt, series
