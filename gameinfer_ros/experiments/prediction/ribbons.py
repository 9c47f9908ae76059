"""The figure of the study of prediction: errors with bands of one standard error."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from gameinfer_ros.experiments.prediction.watching import INFERENCE
from gameinfer_ros.names.choices import BASELINE
from gameinfer_ros.names.colours import COLOURS

#: Colour of each predictor.
COLOUR_OF = {INFERENCE: COLOURS[1], BASELINE: COLOURS[0]}


def draw(figures: Mapping[str, Any]) -> Figure:
    """Draw the mean squared errors of `PredictionStudy.figures` over look-ahead and over time."""
    figure = Figure(figsize=(10, 3.8), layout="constrained")
    ahead, at = figure.subplots(1, 2)
    for axes, x, suffix in ((ahead, "look_ahead_s", ""), (at, "time_s", "_by_time")):
        for predictor, f in figures.items():
            colour, mean = COLOUR_OF[predictor], np.array(f[f"mean_squared_error{suffix}"])
            sem = np.nan_to_num(np.array(f[f"sem{suffix}"], dtype=float))
            axes.plot(f[x], mean, color=colour, label=predictor)
            axes.fill_between(f[x], mean - sem, mean + sem, color=colour, alpha=0.25, linewidth=0)
        axes.set_ylabel("mean squared error in m²")
        axes.set_ylim(bottom=0)
        axes.margins(x=0)
        axes.legend()
    ahead.set_xlabel("look-ahead in s (within the run)")
    at.set_xlabel("time of the prediction in s")
    runs = figures[INFERENCE]["runs"]
    figure.suptitle(
        f"Errors of predicted positions, mean ± standard error over {runs} runs", fontsize="medium"
    )
    return figure
