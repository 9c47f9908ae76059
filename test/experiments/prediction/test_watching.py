"""A robot that watches and predicts."""

from __future__ import annotations

import numpy as np
import pytest

from gameinfer_ros.experiments.prediction import watching
from gameinfer_ros.experiments.prediction.watching import BASELINE, INFERENCE, squared_errors, watch
from gameinfer_ros.planning import EquilibriumPlayer
from gameinfer_ros.scenario import Scenario


def test_errors_are_those_of_what_is_known_later() -> None:
    # One player moves along x by 1 m in each step; predictions say that it stands still.
    happened = np.zeros((6, 1, 2))
    happened[:, 0, 0] = np.arange(6)
    predictions = np.repeat(happened[:, None], 4, axis=1)
    errors = squared_errors(happened, predictions)
    assert errors.shape == (6, 4)
    assert np.isnan(errors[0]).all()  # nothing has been observed yet
    np.testing.assert_array_equal(errors[1], [0, 1, 4, 9])
    np.testing.assert_array_equal(errors[4], [0, 1, np.nan, np.nan])
    np.testing.assert_array_equal(errors[5], [0, np.nan, np.nan, np.nan])


def test_errors_of_all_players_add_up() -> None:
    happened = np.zeros((3, 2, 2))
    predictions = np.zeros((3, 2, 2, 2))
    predictions[1, 1] = [[3.0, 0.0], [0.0, -4.0]]
    assert squared_errors(happened, predictions)[1, 1] == 25.0


def test_who_knows_the_equilibrium_predicts_it(
    three_player: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The baseline is right where its equilibrium happens to be the one that is played."""

    def same_seed(*args: object) -> EquilibriumPlayer:
        solver, seeds, _ = args
        return EquilibriumPlayer(solver, seeds, np.random.default_rng(7))  # type: ignore[arg-type]

    monkeypatch.setattr(watching, "EquilibriumPlayer", same_seed)
    errors = watch(three_player, BASELINE, 0)
    known = errors[~np.isnan(errors)]
    assert known.size > 5000
    # What was solved with 10 s to go is not to the millimetre what is done in the end.
    assert known.max() < 0.5
    assert np.nanmean(errors) < 0.05


def test_inference_finds_out_and_the_baseline_does_not(three_player: Scenario) -> None:
    runs = range(4)
    inference = np.mean([watch(three_player, INFERENCE, run) for run in runs], axis=0)
    baseline = np.mean([watch(three_player, BASELINE, run) for run in runs], axis=0)
    assert inference.shape == (102, 101)
    assert np.nanmax(inference[20:60]) < 0.05 < 1.0 < np.nanmax(baseline[20:60])
    assert np.nanmean(inference[:, 0]) == np.nanmean(baseline[:, 0]) == 0.0


def test_an_unknown_predictor_is_refused(three_player: Scenario) -> None:
    with pytest.raises(ValueError, match="predictor: 'oracle' is not allowed"):
        watch(three_player, "oracle", 0)
