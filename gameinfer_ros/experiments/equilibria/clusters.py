"""Clusters of ways that are alike."""

from __future__ import annotations

import numpy as np
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.cluster.vq import kmeans2
from scipy.spatial.distance import pdist

#: Ways that differ by less, in m as a root mean square over time, are the same way.
SAME = 0.25

#: Where no gap is wider than by this factor, there is nothing to tell clusters apart by.
NARROWEST = 1.25


def find(ways: np.ndarray) -> list[np.ndarray]:
    """Clusters of ways by average linkage; how many there are is found.

    Two ways differ by the root mean square, over time, of the distance between the joint positions
    of all players. The clusters are those that exist before the widest gap, on a logarithmic scale,
    between the distances at which clusters are joined. Distances below `SAME` count as that. If all
    gaps are narrow, all ways are one cluster.

    Args:
        ways: positions (K, S, N, 2) of N players at S times, in K runs.

    Returns:
        Indices of the runs in each cluster.
    """
    if len(ways) < 2:
        return [np.arange(len(ways))] if len(ways) else []
    joined = linkage(pdist(ways.reshape(len(ways), -1)) / np.sqrt(ways.shape[1]), "average")
    # In the end, all that is alike is one: the first entry stands for K clusters.
    heights = np.concatenate([[SAME], np.maximum(joined[:, 2], SAME)])
    gaps = np.diff(np.log(heights))
    count = len(ways) - int(np.argmax(gaps)) if gaps.max() > np.log(NARROWEST) else 1
    return _members(fcluster(joined, count, "maxclust"))


def find_by_k_means(ways: np.ndarray, count: int, rng: np.random.Generator) -> list[np.ndarray]:
    """Clusters of ways by k-means, with starting points by k-means++.

    Args:
        ways: positions (K, S, N, 2) of N players at S times, in K runs.
        count: number of clusters; fewer are found if there are fewer different ways.
        rng: where the starting points come from.

    Returns:
        Indices of the runs in each cluster.
    """
    if not len(ways):
        return []
    flat = ways.reshape(len(ways), -1)
    count = min(count, len(np.unique(flat, axis=0)))
    best, least = np.zeros(len(ways), dtype=int), np.inf
    for _ in range(10):
        centres, labels = kmeans2(flat, count, minit="++", seed=rng)
        scatter = float(((flat - centres[labels]) ** 2).sum())
        if scatter < least:
            best, least = labels, scatter
    return _members(best)


def _members(labels: np.ndarray) -> list[np.ndarray]:
    return [np.flatnonzero(labels == label) for label in np.unique(labels)]
