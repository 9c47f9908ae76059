"""The claims of the paper, checked against the figures of the studies."""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from gameinfer_ros.experiments.prediction.watching import INFERENCE
from gameinfer_ros.experiments.report import published
from gameinfer_ros.names.choices import BASELINE, MAP

Figures = Mapping[str, Any]


class Claim(NamedTuple):
    """A claim and its outcome."""

    claim: str  # in words, with its bound
    published: str  # the published value; empty if there is none
    found: str  # the value found here
    holds: bool


def of_equilibria(scenario: str, figures: Figures) -> list[Claim]:
    """Check that the number of clusters of equilibria is the published one."""
    count, expected = len(figures["clusters"]), published.CLUSTERS[scenario]
    claim = f"{_name(scenario)}: there are {expected} clusters of equilibria"
    return [Claim(claim, str(expected), str(count), count == expected)]


def of_prediction(scenario: str, figures: Figures) -> list[Claim]:
    """Check that the baseline predicts badly and inference predicts well."""
    claims = []
    for predictor, words, holds in (
        (BASELINE, "the baseline peaks above 2 m²", figures[BASELINE]["peak"] > 2),
        (INFERENCE, "inference peaks below 0.4 m²", figures[INFERENCE]["peak"] < 0.4),
    ):
        error, time = published.PREDICTION_PEAKS[predictor]
        peak, peak_time = (figures[predictor][key] for key in ("peak", "peak_look_ahead_s"))
        found = f"{peak:.2f} m² at {peak_time:.1f} s"
        claim = f"{_name(scenario)}: the error of {words}"
        claims.append(Claim(claim, f"{error} m² at {time} s", found, bool(holds)))
    return claims


def of_planning(scenario: str, figures: Figures) -> list[Claim]:
    """Check the costs, and that every player gains from alignment, the robot most."""
    name, known = _name(scenario), published.MEAN_COSTS.get(scenario)
    aligned, baseline = (np.array(figures[robot]["mean_cost"]) for robot in (MAP, BASELINE))
    extra, half = (
        np.array(figures[BASELINE][key], dtype=float)
        for key in ("paired_extra_cost", "paired_half_interval_95")
    )
    claims, known_extra, known_largest = [], "", ""
    if known is not None:
        difference = np.subtract(known[BASELINE], known[MAP])
        known_extra, known_largest = _list(difference), _largest(difference)
    if known is not None and scenario == "three_player":
        claims = [
            Claim(
                f"{name}, aligned: all mean costs are between 660 and 720",
                _list(known[MAP]), _list(aligned), bool(((aligned > 660) & (aligned < 720)).all()),
            ),
            Claim(
                f"{name}, baseline: the robot's mean cost is above 1000",
                _list(known[BASELINE]), _list(baseline), bool(baseline[0] > 1000),
            ),
        ]  # fmt: skip
    elif known is not None:
        claims = [
            Claim(
                f"{name}, aligned: all mean costs are within 10 % of the published ones",
                _list(known[MAP]), _list(aligned),
                bool((np.abs(aligned / np.array(known[MAP]) - 1) <= 0.1).all()),
            )
        ]  # fmt: skip
    return [
        *claims,
        Claim(
            f"{name}: every player pays more if the robot does not align, and the 95 % interval "
            "of each difference excludes 0",
            known_extra,
            ", ".join(f"{e:.0f} ± {h:.0f}" for e, h in zip(extra, half, strict=True)),
            bool((extra > half).all()),
        ),
        Claim(
            f"{name}: the difference is largest for the robot",
            known_largest,
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
