"""A robot that watches and predicts."""

from __future__ import annotations

import numpy as np
import pytest

from gameinfer_ros.experiments.prediction import watching
from gameinfer_ros.experiments.prediction.watching import BASELINE, squared_errors, watch
from gameinfer_ros.planning import EquilibriumPlayer
from gameinfer_ros.scenario import Scenario


def test_errors_are_those_of_what_is_known_later() -> None:
    # One player moves along x by 1 m in each step; predictions say that it stands still.
    happened = np.zeros((8, 1, 2))
    happened[:, 0, 0] = np.arange(8)
    predictions = np.repeat(happened[:5, None], 4, axis=1)
    errors = squared_errors(happened, predictions)
    np.testing.assert_array_equal(errors, [[0, 1, 4, 9]] * 5)
    happened[4, 0, 1] = 10.0  # a step to the side at one moment
    errors = squared_errors(happened, predictions) - errors
    expected = np.zeros((5, 4))
    for step in range(1, 5):
        expected[step, 4 - step] = 100.0
    np.testing.assert_array_equal(errors, expected)


def test_errors_of_all_players_add_up() -> None:
    predictions = np.zeros((3, 2, 2, 2))
    predictions[1, 1] = [[3.0, 0.0], [0.0, -4.0]]
    assert squared_errors(np.zeros((4, 2, 2)), predictions)[1, 1] == 25.0


def test_who_knows_the_equilibrium_predicts_it(
    three_player: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The baseline is right where its equilibrium happens to be the one that is played."""

    def same_seed(*args: object) -> EquilibriumPlayer:
        solver, seeds, _ = args
        return EquilibriumPlayer(solver, seeds, np.random.default_rng(7))  # type: ignore[arg-type]

    monkeypatch.setattr(watching, "EquilibriumPlayer", same_seed)
    errors = watch(three_player, BASELINE, 0)
    assert errors.shape == (101, 101)
    # What was solved with 10 s to go is not to the millimetre what is done in the end.
    assert errors.max() < 0.5
    assert errors.mean() < 0.05


def test_an_unknown_predictor_is_refused(three_player: Scenario) -> None:
    with pytest.raises(ValueError, match="predictor: 'oracle' is not allowed"):
        watch(three_player, "oracle", 0)
