"""The figure of the study of planning: the costs of the runs to each player."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from gameinfer_ros.names.choices import BASELINE, MAP
from gameinfer_ros.names.colours import COLOURS

#: Colour, label and horizontal shift of each planner.
LOOK = {MAP: (COLOURS[1], "robot aligned", -0.2), BASELINE: (COLOURS[0], "robot baseline", 0.2)}


def draw(costs: Mapping[str, np.ndarray], players: Sequence[str]) -> Figure:
    """Draw the distribution of the costs (runs, N), by planner, as violins with box plots."""
    figure = Figure(figsize=(2.2 + 1.5 * len(players), 4.2), layout="constrained")
    axes = figure.subplots()
    for planner, values in costs.items():
        colour, _, shift = LOOK[planner]
        places = np.arange(len(players)) + shift
        if len(values) > 1:
            violins: Any = axes.violinplot(values, places, widths=0.36, showextrema=False)
            for body in violins["bodies"]:
                body.set(facecolor=colour, edgecolor=colour, alpha=0.35)
        axes.boxplot(
            values, positions=places, widths=0.1, manage_ticks=False, showmeans=True,
            boxprops={"color": colour}, whiskerprops={"color": colour},
            capprops={"color": colour}, medianprops={"color": colour, "linewidth": 2},
            meanprops={"marker": "D", "markerfacecolor": colour, "markeredgecolor": "white",
                       "markersize": 6},
            flierprops={"marker": ".", "markersize": 3, "markeredgecolor": colour},
        )  # fmt: skip
    axes.set_xticks(np.arange(len(players)), players)
    axes.set_ylabel("cost of a run")
    axes.set_ylim(bottom=0)
    runs = max(len(values) for values in costs.values())
    axes.set_title(
        f"{runs} runs with each robot: distribution (violin), quartiles (box), mean (diamond)",
        fontsize="medium",
    )
    axes.legend(
        handles=[Patch(color=colour, alpha=0.5, label=name) for colour, name, _ in LOOK.values()]
    )
    return figure
