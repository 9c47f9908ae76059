"""Clusters of trajectories that are alike."""

from __future__ import annotations

import numpy as np
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.cluster.vq import kmeans2
from scipy.spatial.distance import pdist

#: Trajectories that differ by less, in m as a root mean square over time, are the same trajectory.
SAME = 0.25

#: Where no gap is wider than by this factor, there is nothing to tell clusters apart by.
NARROWEST = 1.25


def find(trajectories: np.ndarray) -> list[np.ndarray]:
    """Clusters of trajectories by average linkage; how many there are is found.

    Two trajectories differ by the root mean square, over time, of the distance between the joint
    positions of all players. The clusters are those that exist before the widest gap, on a
    logarithmic scale, between the distances at which clusters are joined. Distances below `SAME`
    count as that. If all gaps are narrow, all trajectories are one cluster.

    Args:
        trajectories: positions (K, S, N, 2), in m, of N players at S times, in K runs.

    Returns:
        Indices of the runs in each cluster.
    """
    K, S = trajectories.shape[:2]
    if K < 2:
        return [np.arange(K)] if K else []
    joined = linkage(pdist(trajectories.reshape(K, -1)) / np.sqrt(S), "average")
    # In the end, all that is alike is one: the first entry stands for K clusters.
    heights = np.concatenate([[SAME], np.maximum(joined[:, 2], SAME)])
    gaps = np.diff(np.log(heights))
    count = K - int(np.argmax(gaps)) if gaps.max() > np.log(NARROWEST) else 1
    return _members(fcluster(joined, count, "maxclust"))


def find_by_k_means(
    trajectories: np.ndarray, count: int, rng: np.random.Generator
) -> list[np.ndarray]:
    """Clusters of trajectories by k-means, with starting points by k-means++.

    Args:
        trajectories: positions (K, S, N, 2), in m, of N players at S times, in K runs.
        count: number of clusters; fewer are found if there are fewer different trajectories.
        rng: where the starting points come from.

    Returns:
        Indices of the runs in each cluster.
    """
    if not len(trajectories):
        return []
    flat = trajectories.reshape(len(trajectories), -1)
    count = min(count, len(np.unique(flat, axis=0)))
    best, least = np.zeros(len(trajectories), dtype=int), np.inf
    for _ in range(10):
        centres, labels = kmeans2(flat, count, minit="++", seed=rng)
        scatter = float(((flat - centres[labels]) ** 2).sum())
        if scatter < least:
            best, least = labels, scatter
    return _members(best)


def _members(labels: np.ndarray) -> list[np.ndarray]:
    return [np.flatnonzero(labels == label) for label in np.unique(labels)]
