"""A track: states between and after samples that arrive in any order."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from gameinfer_ros.nodes.world.track import Sample, Track

rates = st.tuples(*[st.floats(-2.0, 2.0)] * 3).map(np.array)
places = st.floats(-5.0, 5.0)
poses = st.tuples(places, places, st.floats(-np.pi, np.pi)).map(np.array)


def moved(pose: np.ndarray, twist: np.ndarray, seconds: float) -> np.ndarray:
    """Where a body comes that keeps its rates, by numerical integration."""

    def flow(_: float, p: np.ndarray) -> list[float]:
        c, s = np.cos(p[2]), np.sin(p[2])
        return [c * twist[0] - s * twist[1], s * twist[0] + c * twist[1], twist[2]]

    return solve_ivp(flow, (0.0, seconds), pose, rtol=1e-10, atol=1e-12).y[:, -1]


@given(pose=poses, twist=rates, seconds=st.floats(0.001, 2.0))
def test_after_the_newest_sample_a_body_keeps_its_rates(
    pose: np.ndarray, twist: np.ndarray, seconds: float
) -> None:
    track = Track(1.0)
    track.add(Sample(10.0, pose, twist))
    found = track.at(10.0 + seconds)
    np.testing.assert_allclose(found.pose, moved(pose, twist, seconds), atol=1e-7)
    np.testing.assert_array_equal(found.twist, twist)
    assert found.time == 10.0 + seconds


@given(pose=poses, twist=rates, rate=st.floats(20.0, 200.0), lag=st.floats(0.0, 0.05))
def test_the_rate_of_the_samples_does_not_matter(
    pose: np.ndarray, twist: np.ndarray, rate: float, lag: float
) -> None:
    track = Track(2.0)
    for time in np.arange(0.0, 1.0, 1.0 / rate):
        track.add(Sample(time, moved(pose, twist, time) if time else pose, twist))
    found = track.at(1.0 - lag)
    # Between two samples it takes the chord and not the arc.
    np.testing.assert_allclose(found.pose, moved(pose, twist, 1.0 - lag), atol=3e-3)


def test_samples_may_come_in_any_order() -> None:
    samples = [Sample(0.1 * k, np.array([k, 0.0, 0.0]), np.zeros(3)) for k in range(8)]
    sorted_track, shuffled = Track(10.0), Track(10.0)
    for sample in samples:
        sorted_track.add(sample)
    for k in np.random.default_rng(0).permutation(8):
        shuffled.add(samples[k])
    for time in np.linspace(0.0, 1.0, 21):
        one, other = sorted_track.at(time), shuffled.at(time)
        np.testing.assert_array_equal(one.pose, other.pose)
    assert shuffled.newest.time == samples[-1].time


def test_between_two_samples_headings_take_the_shorter_way_round() -> None:
    track = Track(1.0)
    track.add(Sample(0.0, np.array([0.0, 0.0, 3.0]), np.array([1.0, 0.0, 0.5])))
    track.add(Sample(1.0, np.array([2.0, 4.0, -3.0]), np.array([3.0, 0.0, 1.5])))
    found = track.at(0.5)
    assert np.cos(found.pose[2]) == pytest.approx(-1.0)
    np.testing.assert_allclose(found.pose[:2], [1.0, 2.0])
    np.testing.assert_allclose(found.twist, [2.0, 0.0, 1.0])


def test_a_newer_word_on_the_same_time_counts() -> None:
    track = Track(1.0)
    track.add(Sample(1.0, np.zeros(3), np.zeros(3)))
    track.add(Sample(1.0, np.ones(3), np.zeros(3)))
    found = track.at(1.0)
    np.testing.assert_array_equal(found.pose, np.ones(3))


def test_before_the_first_sample_and_beyond_memory_nothing_is_known() -> None:
    track = Track(0.5)
    assert track.newest is None and track.at(0.0) is None
    for time in (1.0, 1.2, 1.9):
        track.add(Sample(time, np.zeros(3), np.zeros(3)))
    assert track.at(0.9) is None
    assert track.at(1.1) is None, "older than the memory"
    assert track.at(1.5) is None
    assert track.at(1.9) is not None
    track.clear()
    assert track.at(2.0) is None
