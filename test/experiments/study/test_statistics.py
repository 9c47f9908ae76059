"""Means and how far they can be trusted."""

from __future__ import annotations

import numpy as np

from gameinfer_ros.experiments.study import statistics


def test_the_standard_error_is_that_of_the_mean() -> None:
    values = np.random.default_rng(0).normal(2.0, 3.0, (4000, 100, 2))
    spread = values.mean(axis=1).std(axis=0)  # of 4000 means over 100 values each
    np.testing.assert_allclose(statistics.sem(values[0]), spread, rtol=0.3)
    np.testing.assert_allclose(statistics.sem(np.array([[1.0], [3.0]])), [1.0])


def test_the_interval_holds_the_mean_in_95_of_100_cases() -> None:
    values = np.random.default_rng(1).normal(5.0, 2.0, (8, 20000))
    inside = np.abs(values.mean(axis=0) - 5.0) < statistics.half_interval(values)
    assert 0.94 < inside.mean() < 0.96


def test_one_run_says_nothing_about_its_error() -> None:
    one = np.ones((1, 3))
    assert statistics.finite(statistics.sem(one)) == [None] * 3
    assert statistics.finite(statistics.half_interval(one)) == [None] * 3
    assert statistics.finite(np.array([1.5, np.inf, np.nan])) == [1.5, None, None]
