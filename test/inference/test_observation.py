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
    given = GaussianObservation(noise, np.array(rows)).log_likelihood(x, x_hat)
    expected = [
        multivariate_normal.logpdf(x[rows], x_hat[rows, k], noise**2 * np.eye(len(rows)))
        for k in range(7)
    ]
    np.testing.assert_allclose(given, expected, rtol=1e-12)


def test_components_that_are_not_weighed_do_not_matter() -> None:
    model = GaussianObservation(0.1, np.array([1]))
    x_hat = np.array([[0.0, 50.0, np.nan], [1.0, 1.0, 1.0]])
    likelihood = model.log_likelihood(np.array([0.0, 1.0]), x_hat)
    assert likelihood[0] == likelihood[1] == likelihood[2]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_predictions_that_are_not_finite_are_impossible(value: float) -> None:
    model = GaussianObservation(0.1, np.arange(2))
    likelihood = model.log_likelihood(np.zeros(2), np.array([[0.0, value], [0.0, 0.0]]))
    assert np.isfinite(likelihood[0])
    assert likelihood[1] == -np.inf
