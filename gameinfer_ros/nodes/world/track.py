"""Position of one body at any time, from measurements at irregular times."""

from bisect import bisect_right
from typing import NamedTuple

import numpy as np


class Sample(NamedTuple):
    """One measurement of a body.

    Attributes:
        time: time of measurement, in s.
        pose: x, y, yaw (3,), in m and rad.
        twist: rates (3,) in the frame of the body, in m/s and rad/s.
    """

    time: float
    pose: np.ndarray
    twist: np.ndarray


#: Largest number of samples of a track: 250 a second for twice the longest odometry timeout.
MOST = 30_000


class Track:
    """Samples of one body, added at any rate and in any order.

    Pose and rates are interpolated between two samples. After the newest sample, the body is
    assumed to keep its rates, so that it moves along an arc. Samples that are `memory` seconds
    older than the newest one are dropped, and so are those beyond `MOST`.
    """

    def __init__(self, memory: float) -> None:
        self._memory = memory
        self._samples: list[Sample] = []

    def add(self, sample: Sample) -> None:
        """Add a sample. It replaces a sample of the same time."""
        at = bisect_right(self._samples, sample.time, key=lambda s: s.time)
        if at and self._samples[at - 1].time == sample.time:
            self._samples[at - 1] = sample
        else:
            self._samples.insert(at, sample)
        oldest = self._samples[-1].time - self._memory
        while self._samples[0].time < oldest or len(self._samples) > MOST:
            del self._samples[0]

    def clear(self) -> None:
        """Remove all samples."""
        self._samples.clear()

    @property
    def newest(self) -> Sample | None:
        """The newest sample; None if there is none."""
        return self._samples[-1] if self._samples else None

    def at(self, time: float) -> Sample | None:
        """State of the body at a time, in s; None before the first sample."""
        after = bisect_right(self._samples, time, key=lambda s: s.time)
        if after == 0:
            return None
        before = self._samples[after - 1]
        if after == len(self._samples):
            return Sample(time, _moved(before, time - before.time), before.twist)
        return _between(before, self._samples[after], time)


def _moved(sample: Sample, seconds: float) -> np.ndarray:
    """Pose (3,) of a body after some seconds at constant rates: the exponential map of SE(2)."""
    x, y, yaw = sample.pose
    vx, vy, omega = sample.twist
    half = 0.5 * omega * seconds
    # The chord points along the heading half way; its length is sin(half) / half of the arc's.
    chord = seconds * np.sinc(half / np.pi)
    c, s = np.cos(yaw + half), np.sin(yaw + half)
    return np.array(
        [x + chord * (c * vx - s * vy), y + chord * (s * vx + c * vy), yaw + 2.0 * half]
    )


def _between(one: Sample, other: Sample, time: float) -> Sample:
    share = (time - one.time) / (other.time - one.time)
    way = other.pose - one.pose
    way[2] -= 2.0 * np.pi * np.round(way[2] / (2.0 * np.pi))  # the shorter way round
    return Sample(time, one.pose + share * way, (1.0 - share) * one.twist + share * other.twist)
