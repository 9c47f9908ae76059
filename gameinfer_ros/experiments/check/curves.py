"""The picture of the check: how many equilibria leave a player how much to gain."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from gameinfer_ros.names import colours

#: Smaller gaps are drawn as this.
LEAST = 1e-6


def draw(names: Sequence[str], gaps: np.ndarray, tolerance: float) -> Figure:
    """Draw the share of equilibria by the gap that they do not exceed, a curve for each player.

    Args:
        names: names of the players.
        gaps: relative gaps (K, N).
        tolerance: what they are compared with.
    """
    figure = Figure(figsize=(6, 3.6), layout="constrained")
    axes = figure.subplots()
    shares = np.arange(1, len(gaps) + 1) / max(1, len(gaps))
    for i, name in enumerate(names):
        ordered = np.maximum(np.sort(gaps[:, i]), LEAST)
        axes.step(ordered, shares, where="post", color=colours.of_player(i), label=name)
    axes.axvline(tolerance, color="0.5", linestyle="--", linewidth=0.8, label="tolerance")
    axes.set_xscale("log")
    axes.set_xlabel("gap, as a share of the player's cost")
    axes.set_ylabel("share of equilibria up to it")
    axes.set_ylim(0, 1.02)
    axes.legend(fontsize="small")
    return figure
