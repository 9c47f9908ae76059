"""The claims of the paper, checked against the figures of the studies."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from gameinfer_ros.experiments.prediction.watching import INFERENCE
from gameinfer_ros.experiments.report import published
from gameinfer_ros.names.choices import BASELINE, MAP

Figures = Mapping[str, Any]

#: Mean costs (N,) by planner.
Costs = Mapping[str, tuple[int, ...]]


class Claim(NamedTuple):
    """A claim and its outcome.

    Attributes:
        claim: the claim in words, with its bound.
        published: the published value; empty if there is none.
        found: the value found here.
        holds: whether the claim holds here.
    """

    claim: str
    published: str
    found: str
    holds: bool


def of_equilibria(scenario: str, figures: Figures) -> list[Claim]:
    """Check that the number of clusters of equilibria is the published one."""
    count, expected = len(figures["clusters"]), published.CLUSTERS[scenario]
    claim = f"{_name(scenario)}: there are {expected} clusters of equilibria"
    return [Claim(claim, str(expected), str(count), count == expected)]


def of_prediction(scenario: str, figures: Figures) -> list[Claim]:
    """Check that the baseline predicts badly and inference predicts well."""
    name = _name(scenario)
    peaks = {predictor: figures[predictor]["peak"] for predictor in (BASELINE, INFERENCE)}
    found = {
        predictor: f"{peak:.2f} m² at {figures[predictor]['peak_look_ahead_s']:.1f} s"
        for predictor, peak in peaks.items()
    }
    known = {
        predictor: f"{error} m² at {time} s"
        for predictor, (error, time) in published.PREDICTION_PEAKS.items()
    }
    return [
        Claim(
            f"{name}: the error of the baseline peaks above 2 m²",
            known[BASELINE], found[BASELINE], bool(peaks[BASELINE] > 2),
        ),
        Claim(
            f"{name}: the error of inference peaks below 0.4 m²",
            known[INFERENCE], found[INFERENCE], bool(peaks[INFERENCE] < 0.4),
        ),
    ]  # fmt: skip


def of_planning(scenario: str, figures: Figures) -> list[Claim]:
    """Check the costs, and that every player gains from alignment, the robot most."""
    known = published.MEAN_COSTS.get(scenario)
    return [
        *_of_costs(scenario, figures, known),
        *_of_differences(scenario, figures[BASELINE], known),
    ]


def _of_costs(scenario: str, figures: Figures, known: Costs | None) -> list[Claim]:
    """Check the mean costs against the published ones, if there are any."""
    if known is None:
        return []
    name = _name(scenario)
    aligned, baseline = (np.array(figures[robot]["mean_cost"]) for robot in (MAP, BASELINE))
    if scenario == "three_player":
        return [
            Claim(
                f"{name}, aligned: all mean costs are between 660 and 720",
                _list(known[MAP]), _list(aligned), bool(((aligned > 660) & (aligned < 720)).all()),
            ),
            Claim(
                f"{name}, baseline: the robot's mean cost is above 1000",
                _list(known[BASELINE]), _list(baseline), bool(baseline[0] > 1000),
            ),
        ]  # fmt: skip
    ratio = aligned / np.array(known[MAP])
    return [
        Claim(
            f"{name}, aligned: all mean costs are within 10 % of the published ones",
            _list(known[MAP]), _list(aligned), bool((np.abs(ratio - 1) <= 0.1).all()),
        )
    ]  # fmt: skip


def _of_differences(scenario: str, baseline: Figures, known: Costs | None) -> list[Claim]:
    """Check the costs of a robot that does not align, run by run."""
    name = _name(scenario)
    extra = np.array(baseline["paired_extra_cost"], dtype=float)
    half = np.array(baseline["paired_half_interval_95"], dtype=float)
    published_extra = None if known is None else np.subtract(known[BASELINE], known[MAP])
    return [
        Claim(
            f"{name}: every player pays more if the robot does not align, and the 95 % interval "
            "of each difference excludes 0",
            "" if published_extra is None else _list(published_extra),
            ", ".join(f"{e:.0f} ± {h:.0f}" for e, h in zip(extra, half, strict=True)),
            bool((extra > half).all()),
        ),
        Claim(
            f"{name}: the difference is largest for the robot",
            "" if published_extra is None else _largest(published_extra),
            _largest(extra),
            bool(extra[0] > extra[1:].max()),
        ),
    ]


def _largest(extra: np.ndarray) -> str:
    return f"robot {extra[0]:.0f}, others at most {extra[1:].max():.0f}"


def _name(scenario: str) -> str:
    return scenario.replace("_", " ")


def _list(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.0f}" for value in values)
