from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from gameinfer_ros.inference import GaussianObservation


@pytest.mark.parametrize("rows", [[0, 1, 2, 3, 4], [2, 4], [0]])
@pytest.mark.parametrize("noise", [0.1, 3.0])
def test_the_likelihood_is_that_of_a_normal_distribution(rows: list[int], noise: float) -> None:
    rng = np.random.default_rng(0)
    x, x_hat = rng.normal(size=5), rng.normal(size=(5, 7))
    model = GaussianObservation(noise, np.array(rows), np.zeros(5, dtype=bool))
    given = model.log_likelihood(x, x_hat)
    expected = [
        multivariate_normal.logpdf(x[rows], x_hat[rows, k], noise**2 * np.eye(len(rows)))
        for k in range(7)
    ]
    np.testing.assert_allclose(given, expected, rtol=1e-12)


def test_components_that_are_not_weighed_do_not_matter() -> None:
    model = GaussianObservation(0.1, np.array([1]), np.zeros(2, dtype=bool))
    x_hat = np.array([[0.0, 50.0, np.nan], [1.0, 1.0, 1.0]])
    likelihood = model.log_likelihood(np.array([0.0, 1.0]), x_hat)
    assert likelihood[0] == likelihood[1] == likelihood[2]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_predictions_that_are_not_finite_are_impossible(value: float) -> None:
    for angle in (True, False):
        model = GaussianObservation(0.1, np.arange(2), np.array([angle, False]))
        likelihood = model.log_likelihood(np.zeros(2), np.array([[0.0, value], [0.0, 0.0]]))
        assert np.isfinite(likelihood[0])
        assert likelihood[1] == -np.inf


def test_an_error_of_whole_turns_is_none() -> None:
    is_angle = np.array([False, False, True, False])
    model = GaussianObservation(0.1, np.array([1, 2, 3]), is_angle)
    x = np.array([0.0, 1.0, 3.1, 0.5])
    x_hat = np.tile(x[:, None], (1, 4))
    x_hat[2] = 3.1, 3.1 - 2 * np.pi, 3.1 + 6 * np.pi, -3.1
    likelihood = model.log_likelihood(x, x_hat)
    np.testing.assert_allclose(likelihood[1:3], likelihood[0], rtol=1e-9)
    short = 2 * np.pi - 6.2
    assert likelihood[0] - likelihood[3] == pytest.approx(0.5 * (short / 0.1) ** 2)
    x_hat[1] += 2 * np.pi  # a position
    assert (model.log_likelihood(x, x_hat) < likelihood - 1000).all()
