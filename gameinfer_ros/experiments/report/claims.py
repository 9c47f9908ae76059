"""What follows from the paper, and whether it holds here."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from gameinfer_ros.experiments.prediction.watching import INFERENCE
from gameinfer_ros.experiments.report import published
from gameinfer_ros.names.choices import BASELINE, MAP

Figures = Mapping[str, Any]


class Claim(NamedTuple):
    """One claim.

    Attributes:
        claim: in words, with the bound that decides.
        published: what the paper found; empty if it does not say.
        found: what was found here.
        holds: whether it holds here.
    """

    claim: str
    published: str
    found: str
    holds: bool


def of_equilibria(scenario: str, figures: Figures) -> list[Claim]:
    """The game has as many clusters of equilibria as published."""
    count, expected = len(figures["clusters"]), published.CLUSTERS[scenario]
    words = f"{_name(scenario)}: the number of clusters of equilibria is {expected}"
    return [Claim(words, str(expected), str(count), count == expected)]


def of_prediction(scenario: str, figures: Figures) -> list[Claim]:
    """Inference predicts much better than an equilibrium drawn at random."""
    claims = []
    for predictor, words, bound in (
        (BASELINE, "errors of the baseline peak above 2 m²", lambda peak: peak > 2),
        (INFERENCE, "errors of inference peak below 0.4 m²", lambda peak: peak < 0.4),
    ):
        f, (error, when) = figures[predictor], published.PREDICTION_PEAKS[predictor]
        found = f"{f['peak']:.2f} m² at {f['peak_look_ahead_s']:.1f} s"
        claims.append(
            Claim(
                f"{_name(scenario)}: {words}",
                f"{error} m² at {when} s",
                found,
                bool(bound(f["peak"])),
            )
        )
    return claims


def of_planning(scenario: str, figures: Figures) -> list[Claim]:
    """Alignment pays for everybody."""
    name, aligned, baseline = _name(scenario), figures[MAP], figures[BASELINE]
    costs, others = np.array(aligned["mean_cost"]), np.array(baseline["mean_cost"])
    known = published.MEAN_COSTS.get(scenario)
    claims = []
    if scenario == "three_player":
        claims.append(
            Claim(
                f"{name}, aligned: mean costs are from 660 to 720",
                _costs(known, MAP), _list(costs), bool(((costs > 660) & (costs < 720)).all()),
            )
        )  # fmt: skip
        claims.append(
            Claim(
                f"{name}, baseline: the robot's mean cost is above 1000",
                _costs(known, BASELINE), _list(others), bool(others[0] > 1000),
            )
        )  # fmt: skip
    elif known is not None:
        ratio = costs / np.array(known[MAP])
        claims.append(
            Claim(
                f"{name}, aligned: mean costs are within 10 % of the published ones",
                _costs(known, MAP), _list(costs), bool((np.abs(ratio - 1) <= 0.1).all()),
            )
        )  # fmt: skip
    extra = np.array(baseline["paired_extra_cost"], dtype=float)
    half = np.array(baseline["paired_half_interval_95"], dtype=float)
    published_extra = None
    if known is not None:
        published_extra = np.subtract(known[BASELINE], known[MAP])
    claims.append(
        Claim(
            f"{name}: every player pays more if the robot does not align, and the 95 % intervals "
            "of the differences are clear of 0",
            "" if published_extra is None else _list(published_extra),
            ", ".join(f"{e:.0f} ± {h:.0f}" for e, h in zip(extra, half, strict=True)),
            bool((extra > half).all()),
        )
    )
    claims.append(
        Claim(
            f"{name}: the robot pays the most of all",
            "" if published_extra is None else _most(published_extra),
            _most(extra),
            bool(extra[0] > extra[1:].max()),
        )
    )
    return claims


def _most(extra: np.ndarray) -> str:
    return f"robot {extra[0]:.0f}, others at most {extra[1:].max():.0f}"


def _name(scenario: str) -> str:
    return scenario.replace("_", " ")


def _costs(known: Mapping[str, tuple[int, ...]] | None, planner: str) -> str:
    return "" if known is None else ", ".join(map(str, known[planner]))


def _list(values: np.ndarray) -> str:
    return ", ".join(f"{value:.0f}" for value in values)
