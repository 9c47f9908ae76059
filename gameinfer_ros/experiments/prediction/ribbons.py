"""The figure of the study of prediction: errors with bands of one standard error."""

from __future__ import annotations

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
    """Draw mean squared errors over look-ahead and over time.

    Args:
        figures: what `PredictionStudy.figures` returned.
    """
    figure = Figure(figsize=(10, 3.8), layout="constrained")
    ahead, at = figure.subplots(1, 2)
    for predictor, f in figures.items():
        colour = COLOUR_OF[predictor]
        _ribbon(ahead, f["look_ahead_s"], f["mean_squared_error"], f["sem"], colour, predictor)
        _ribbon(
            at, f["time_s"], f["mean_squared_error_by_time"], f["sem_by_time"], colour, predictor
        )
    runs = figures[INFERENCE]["runs"]
    figure.suptitle(
        f"Errors of predicted positions, mean ± standard error over {runs} runs", fontsize="medium"
    )
    ahead.set_xlabel("look-ahead in s (within the run)")
    at.set_xlabel("time of the prediction in s")
    for axes in (ahead, at):
        axes.set_ylabel("mean squared error in m²")
        axes.set_ylim(bottom=0)
        axes.margins(x=0)
        axes.legend()
    return figure


def _ribbon(axes, x, mean, sem, colour: str, label: str) -> None:  # type: ignore[no-untyped-def]
    mean, sem = np.array(mean), np.nan_to_num(np.array(sem, dtype=float))
    axes.plot(x, mean, color=colour, label=label)
    axes.fill_between(x, mean - sem, mean + sem, color=colour, alpha=0.25, linewidth=0)
