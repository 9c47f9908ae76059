"""The study of prediction."""

from __future__ import annotations

import json

import numpy as np
import pytest

from gameinfer_ros.experiments.prediction.prediction_study import PredictionStudy
from gameinfer_ros.names.choices import BASELINE
from gameinfer_ros.scenario import Scenario


@pytest.fixture
def study(two_player: Scenario) -> PredictionStudy:
    """A study of a run of 7 steps, in which predictions look 4 steps ahead."""
    content = two_player.model_dump() | {"horizon": 4, "steps": 7}
    return PredictionStudy(Scenario.model_validate(content))


def test_errors_past_the_end_of_the_run_do_not_count_by_look_ahead(study: PredictionStudy) -> None:
    # The prediction after step t has an error of 10 t; after the end of the run all is lost.
    made, looks = np.indices((7, 5))
    errors = np.where(made + 1 + looks <= 7, 10.0 * (made + 1), 1e9)
    ahead, _ = study.means(errors)
    # Looking 0, 2 and 4 steps ahead, the last predictions that count are those of step 7, 5, 3.
    np.testing.assert_allclose(ahead, [40.0, 30.0, 20.0])
    np.testing.assert_allclose(study.look_aheads, [0.0, 0.2, 0.4])


def test_errors_by_time_are_means_over_all_that_is_looked_ahead_to(study: PredictionStudy) -> None:
    made, looks = np.indices((7, 5))
    errors = np.where(looks == 0, -1e9, 100.0 * (made + 1) + looks)  # no look-ahead
    _, at = study.means(errors)
    np.testing.assert_allclose(study.times, [0.1, 0.3, 0.5, 0.7])
    np.testing.assert_allclose(at, [102.5, 302.5, 502.5, 702.5])


def test_an_error_that_does_not_change_is_a_flat_line(three_player: Scenario) -> None:
    ahead, at = PredictionStudy(three_player).means(np.full((101, 101), 1.5))
    np.testing.assert_allclose(ahead, np.full(51, 1.5))
    np.testing.assert_allclose(at, np.full(51, 1.5))


def test_figures_are_those_of_the_rows(study: PredictionStudy) -> None:
    assert study.keys([4]) == [(4, "inference"), (4, BASELINE)]
    rows = []
    for seed, scale in ((0, 1.0), (1, 3.0)):
        for predictor, factor in (("inference", 1.0), (BASELINE, 10.0)):
            values = factor * scale * np.arange(1.0, len(study.columns) + 1)
            rows.append(
                {"seed": str(seed), "predictor": predictor}
                | dict(zip(study.columns, map(str, values.tolist()), strict=True))
            )
    figures = study.figures(rows)
    inference = figures["inference"]
    np.testing.assert_allclose(inference["mean_squared_error"], [2.0, 4.0, 6.0])
    np.testing.assert_allclose(inference["sem"], [1.0, 2.0, 3.0])
    np.testing.assert_allclose(inference["mean_squared_error_by_time"], [8.0, 10.0, 12.0, 14.0])
    assert (inference["peak"], inference["peak_sem"]) == pytest.approx((6.0, 3.0))
    assert inference["peak_look_ahead_s"] == 0.4
    assert figures[BASELINE]["peak"] == pytest.approx(60.0)
    json.dumps(figures, allow_nan=False)
    study.draw(rows, figures)
    (table,) = study.tables(figures)
    assert table.rows[1][0] == BASELINE and table.rows[1][1].startswith("60.00 m² ± 30.00")


def test_a_row_is_what_watching_gives(study: PredictionStudy) -> None:
    row = study.play((3, "inference"))
    assert list(row) == list(study.columns)
    assert row["ahead_0"] == 0.0
    assert all(0 <= float(value) < 0.1 for value in row.values())  # it all starts slowly
    assert study.play((3, "inference")) == row
