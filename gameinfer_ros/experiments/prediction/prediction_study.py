"""The study of prediction: inference against the baseline."""

import argparse
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from typing_extensions import override

from gameinfer_ros.experiments.prediction.watching import INFERENCE, watch
from gameinfer_ros.experiments.study import (
    Key,
    Row,
    Rows,
    Study,
    Table,
    command,
    numbers,
    statistics,
)
from gameinfer_ros.names.choices import BASELINE

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class PredictionStudy(Study):
    """A study that compares predictions by inference with those by a random equilibrium.

    Each run gives two series of mean squared errors: by look-ahead, over the predictions that end
    within the run, and by the time of the prediction, over its whole horizon.
    """

    name: ClassVar[str] = "prediction"
    description: ClassVar[str] = (
        "A robot watches all players play one equilibrium, and predicts their positions after each "
        "step: by inference, or by an equilibrium drawn at random (the baseline). Errors by "
        "look-ahead are means over the predictions that end within the run. Errors by time are "
        "means over the whole horizon of a prediction."
    )
    key_columns: ClassVar[tuple[str, ...]] = ("seed", "predictor")

    #: Number of steps between errors that are kept.
    STRIDE: ClassVar[int] = 2

    @property
    @override
    def columns(self) -> tuple[str, ...]:
        return (*self.look_ahead_columns, *self.time_of_columns)

    @property
    def look_aheads(self) -> np.ndarray:
        """Look-aheads, in s, at which errors are kept."""
        longest = min(self.scenario.horizon, self.scenario.steps - 1)
        return np.round(np.arange(0, longest + 1, self.STRIDE) * self.scenario.dt, 9)

    @property
    def times(self) -> np.ndarray:
        """Times, in s, of the predictions whose errors are kept."""
        return np.round(np.arange(1, self.scenario.steps + 1, self.STRIDE) * self.scenario.dt, 9)

    @property
    def look_ahead_columns(self) -> tuple[str, ...]:
        """Names of the columns with the mean squared error by look-ahead."""
        return tuple(f"ahead_{t:.6g}" for t in self.look_aheads)

    @property
    def time_of_columns(self) -> tuple[str, ...]:
        """Names of the columns with the mean squared error by time of the prediction."""
        return tuple(f"at_{t:.6g}" for t in self.times)

    @override
    def keys(self, seeds: Iterable[int]) -> list[Key]:
        return [(seed, predictor) for seed in seeds for predictor in (INFERENCE, BASELINE)]

    @override
    def play(self, key: Key) -> Row:
        seed, predictor = key
        ahead, at = self.means(watch(self.scenario, str(predictor), int(seed)))
        # Means over runs need no more than four digits.
        means = [float(f"{error:.4g}") for error in (*ahead, *at)]
        return dict(zip(self.columns, means, strict=True))

    def means(self, errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Average squared errors (S, T + 1) of a run, in m^2, at `look_aheads` and at `times`."""
        S = self.scenario.steps
        row, look_ahead = np.indices(errors.shape)
        within = row + 1 + look_ahead <= S
        counts = np.maximum(within.sum(axis=0), 1)
        ahead = np.where(within, errors, 0.0).sum(axis=0) / counts
        # A look-ahead of 0 is an observation, so means over the horizon leave it out.
        return ahead[:S][:: self.STRIDE], errors[:: self.STRIDE, 1:].mean(axis=1)

    @override
    def figures(self, rows: Rows) -> dict[str, Any]:
        figures = {}
        for predictor in (INFERENCE, BASELINE):
            own = [row for row in rows if row["predictor"] == predictor]
            ahead = numbers(own, self.look_ahead_columns)
            at = numbers(own, self.time_of_columns)
            mean, sem = ahead.mean(axis=0), statistics.finite(statistics.sem(ahead))
            peak = int(np.argmax(mean))
            figures[predictor] = {
                "look_ahead_s": self.look_aheads.tolist(),
                "mean_squared_error": mean.tolist(),
                "sem": sem,
                "time_s": self.times.tolist(),
                "mean_squared_error_by_time": at.mean(axis=0).tolist(),
                "sem_by_time": statistics.finite(statistics.sem(at)),
                "peak": float(mean[peak]),
                "peak_sem": sem[peak],
                "peak_look_ahead_s": float(self.look_aheads[peak]),
                "runs": len(own),
            }
        return figures

    @override
    def tables(self, figures: Mapping[str, Any]) -> list[Table]:
        rows = [
            [
                predictor,
                f"{f['peak']:.2f} m²"
                + ("" if f["peak_sem"] is None else f" ± {f['peak_sem']:.2f}"),
                f"{f['peak_look_ahead_s']:.1f} s",
                f"{_at(f, 1.1):.2f} m²",
                f"{_at(f, 2.1):.3f} m²",
            ]
            for predictor, f in figures.items()
        ]
        header = ["predictor", "largest mean squared error", "at a look-ahead of",
                  "error after 1.1 s", "error after 2.1 s"]  # fmt: skip
        title = f"errors of predicted positions over {figures[INFERENCE]['runs']} runs"
        return [Table(f"{title} (± standard error)", header, rows)]

    @override
    def draw(self, rows: Rows, figures: Mapping[str, Any]) -> "Figure":
        # Slow to import, and not needed by workers.
        from gameinfer_ros.experiments.prediction import ribbons

        return ribbons.draw(figures)


def _at(figures: Mapping[str, Any], time: float) -> float:
    """Interpolate the mean squared error, in m^2, of the predictions made at a time, in s."""
    return float(np.interp(time, figures["time_s"], figures["mean_squared_error_by_time"]))


def run(options: argparse.Namespace) -> int:
    """Run the study that the options describe, and return the exit code."""
    return command.run(options, options.runs, PredictionStudy)
