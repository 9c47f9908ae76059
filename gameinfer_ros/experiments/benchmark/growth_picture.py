"""The figure of the growth of an update's time."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from gameinfer_ros.names.colours import COLOURS


def draw(growth: Mapping[str, Mapping[str, Any]], path: Path) -> None:
    """Draw the growth, and write it to a PNG or PDF file.

    Args:
        growth: what `measure_growth` returned, by the kind of game.
        path: the file.
    """
    figure = Figure(figsize=(13, 4.2), layout="constrained")
    particles, players, horizon = figure.subplots(1, 3)
    for i, (kind, times) in enumerate(growth.items()):
        for (threads, by_count), style in zip(times["particles"].items(), "-:", strict=True):
            _plot(particles, by_count, f"{kind}, {threads} thread(s)", COLOURS[i], f"o{style}")
        for axes, name in ((players, "players"), (horizon, "horizon")):
            _plot(axes, times[name], kind, COLOURS[i], "o-")
            axes.set_xticks([int(n) for n in times[name]], labels=list(times[name]))
            axes.tick_params(axis="x", which="minor", labelbottom=False)
    particles.set(xlabel="particles", ylabel="ms per update", title="3 players")
    players.set(xlabel="players", ylabel="ms per particle and iteration", title="100 steps")
    horizon.set(xlabel="steps of the horizon", title="3 players")
    for axes in (particles, players, horizon):
        axes.grid(which="both", alpha=0.3)
        axes.legend(fontsize="small")
    figure.savefig(path, dpi=120)


def _plot(axes: Any, times: Mapping[str, float], label: str, colour: str, style: str) -> None:
    """Draw times against the sizes that are their keys, with the power of their growth."""
    n, ms = np.array([float(name) for name in times]), np.array(list(times.values()))
    power = np.polyfit(np.log(n), np.log(ms), 1)[0]
    axes.loglog(n, ms, style, color=colour, label=f"{label}: power {power:.1f}", markersize=4)
