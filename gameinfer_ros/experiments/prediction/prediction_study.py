"""The study of prediction."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from matplotlib.figure import Figure
from typing_extensions import override

from gameinfer_ros.experiments.prediction import ribbons
from gameinfer_ros.experiments.prediction.watching import INFERENCE, watch
from gameinfer_ros.experiments.study import Key, Row, Rows, Study, Table, numbers, statistics
from gameinfer_ros.names.choices import BASELINE


@dataclass(frozen=True)
class PredictionStudy(Study):
    """Compares predictions by inference with those by an equilibrium drawn at random.

    What is kept of a run is the mean squared error by look-ahead, over all predictions that look
    so far ahead without looking past the end of the run; and by the time of the prediction, over
    the whole horizon that it looks ahead to.
    """

    name: ClassVar[str] = "prediction"
    description: ClassVar[str] = (
        "A robot watches how all players play one equilibrium, and predicts after each step where "
        "they will be: by inference, or by the baseline, an equilibrium drawn at random. Errors "
        "by look-ahead are means over all predictions that do not look past the end of the run, "
        "errors by time are means over the whole horizon."
    )
    key_columns: ClassVar[tuple[str, ...]] = ("seed", "predictor")

    #: Every so many steps, an error is kept.
    STRIDE: ClassVar[int] = 2

    @property
    @override
    def columns(self) -> tuple[str, ...]:
        return (*self.look_ahead_columns, *self.time_of_columns)

    @property
    def look_aheads(self) -> np.ndarray:
        """How far ahead predictions are looked at, in s."""
        longest = min(self.scenario.horizon, self.scenario.steps - 1)
        return np.round(np.arange(0, longest + 1, self.STRIDE) * self.scenario.dt, 9)

    @property
    def times(self) -> np.ndarray:
        """The times, in s, of the predictions that are looked at."""
        return np.round(np.arange(1, self.scenario.steps + 1, self.STRIDE) * self.scenario.dt, 9)

    @property
    def look_ahead_columns(self) -> tuple[str, ...]:
        """Names of columns with the mean squared error by look-ahead."""
        return tuple(f"ahead_{t:.6g}" for t in self.look_aheads)

    @property
    def time_of_columns(self) -> tuple[str, ...]:
        """Names of columns with the mean squared error by the time of the prediction."""
        return tuple(f"at_{t:.6g}" for t in self.times)

    @override
    def keys(self, seeds: Iterable[int]) -> list[Key]:
        return [(seed, predictor) for seed in seeds for predictor in (INFERENCE, BASELINE)]

    @override
    def play(self, key: Key) -> Row:
        seed, predictor = key
        ahead, at = self.means(watch(self.scenario, str(predictor), int(seed)))
        # Four digits are more than a mean over runs needs.
        means = [float(f"{error:.4g}") for error in (*ahead, *at)]
        return dict(zip(self.columns, means, strict=True))

    def means(self, errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean errors by look-ahead and by time, each at the ones that are kept.

        Args:
            errors: squared errors (S, T + 1) of a run of S steps, in m^2, as of `watch`.

        Returns:
            Means in m^2, one for each of `look_aheads` and one for each of `times`.
        """
        S = self.scenario.steps
        made, looks = np.indices(errors.shape)
        within = made + 1 + looks <= S
        counts = np.maximum(within.sum(axis=0), 1)
        ahead = np.where(within, errors, 0.0).sum(axis=0) / counts
        # Looking ahead by nothing is no prediction.
        return ahead[:S][:: self.STRIDE], errors[:: self.STRIDE, 1:].mean(axis=1)

    @override
    def figures(self, rows: Rows) -> dict[str, Any]:
        figures = {}
        for predictor in (INFERENCE, BASELINE):
            own = [row for row in rows if row["predictor"] == predictor]
            ahead = numbers(own, self.look_ahead_columns)
            at = numbers(own, self.time_of_columns)
            mean = ahead.mean(axis=0)
            peak = int(np.argmax(mean))
            figures[predictor] = {
                "look_ahead_s": self.look_aheads.tolist(),
                "mean_squared_error": mean.tolist(),
                "sem": statistics.finite(statistics.sem(ahead)),
                "time_s": self.times.tolist(),
                "mean_squared_error_by_time": at.mean(axis=0).tolist(),
                "sem_by_time": statistics.finite(statistics.sem(at)),
                "peak": float(mean[peak]),
                "peak_sem": statistics.finite(statistics.sem(ahead))[peak],
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
        header = ["predictor", "largest mean squared error", "looking ahead by",
                  "error after 1.1 s", "error after 2.1 s"]  # fmt: skip
        runs = figures[INFERENCE]["runs"]
        return [
            Table(f"errors of predicted positions, runs: {runs} (± standard error)", header, rows)
        ]

    @override
    def draw(self, rows: Rows, figures: Mapping[str, Any]) -> Figure:
        return ribbons.draw(figures)


def _at(figures: Mapping[str, Any], time: float) -> float:
    """Mean squared error of the predictions made at about this time, in s."""
    return float(np.interp(time, figures["time_s"], figures["mean_squared_error_by_time"]))
