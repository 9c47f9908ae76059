"""The figure of the check: the distribution of the gaps."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from gameinfer_ros.names import colours

#: Smaller gaps are drawn at this value, because the axis is logarithmic.
LEAST = 1e-6


def draw(names: Sequence[str], gaps: np.ndarray, tolerance: float) -> Figure:
    """Draw the cumulative distribution of the relative gaps (K, N), one curve per player."""
    figure = Figure(figsize=(6, 3.6), layout="constrained")
    axes = figure.subplots()
    shares = np.arange(1, len(gaps) + 1) / max(1, len(gaps))
    for i, name in enumerate(names):
        ordered = np.maximum(np.sort(gaps[:, i]), LEAST)
        axes.step(ordered, shares, where="post", color=colours.of_player(i), label=name)
    axes.axvline(tolerance, color="0.5", linestyle="--", linewidth=0.8, label="tolerance")
    axes.set(xscale="log", xlabel="gap, as a share of the player's cost")
    axes.set(ylim=(0, 1.02), ylabel="cumulative share of equilibria")
    axes.legend(fontsize="small")
    return figure
