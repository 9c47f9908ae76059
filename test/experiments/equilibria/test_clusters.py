"""Clusters of trajectories, against clusters that were made."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from gameinfer_ros.experiments.equilibria.clusters import find, find_by_k_means


def trajectories(sizes: Sequence[int], spread: float = 0.05) -> tuple[np.ndarray, np.ndarray]:
    """Trajectories of two players around the centre of their cluster, and which that is."""
    rng = np.random.default_rng(len(sizes))
    label = rng.permutation(np.repeat(np.arange(len(sizes)), sizes))
    centres = rng.normal(0.0, 2.0, (len(sizes), 20, 2, 2))
    return centres[label] + rng.normal(0.0, spread, (len(label), 20, 2, 2)), label


def same(members: list[np.ndarray], label: np.ndarray) -> bool:
    """Whether the members are those of the clusters that were made."""
    wanted = {tuple(np.flatnonzero(label == k).tolist()) for k in set(label.tolist())}
    return {tuple(sorted(m.tolist())) for m in members} == wanted


@pytest.mark.parametrize(
    "sizes", [[1], [7], [5, 3], [1, 1], [30, 2, 1], [4] * 8, [1] * 6, [20] * 30]
)
def test_the_number_of_clusters_is_found(sizes: list[int]) -> None:
    positions, label = trajectories(sizes)
    assert same(find(positions), label)


def test_trajectories_that_are_the_same_to_the_eye_are_one_cluster() -> None:
    for spread in (0.0, 0.02, 0.08, 0.1):
        assert len(find(trajectories([40], spread)[0])) == 1


def test_k_means_finds_clusters_whose_number_is_given() -> None:
    positions, label = trajectories([12, 5, 9])
    assert same(find_by_k_means(positions, 3, np.random.default_rng(0)), label)
    assert len(find_by_k_means(positions, 2, np.random.default_rng(0))) == 2


def test_of_no_ways_there_are_no_clusters() -> None:
    none = np.zeros((0, 20, 2, 2))
    assert find(none) == []
    assert find_by_k_means(none, 3, np.random.default_rng(0)) == []


@pytest.mark.filterwarnings("error")
def test_there_are_no_more_clusters_than_different_trajectories() -> None:
    positions, label = trajectories([4, 2], spread=0.0)
    assert same(find_by_k_means(positions, 5, np.random.default_rng(0)), label)
