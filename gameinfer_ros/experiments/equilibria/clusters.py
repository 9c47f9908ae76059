"""Clustering of trajectories."""

import numpy as np
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.cluster.vq import kmeans2
from scipy.spatial.distance import pdist

#: Merge distances below this value, in m (root mean square over time), count as this value.
SAME = 0.25

#: Smallest ratio of consecutive merge distances that separates clusters.
NARROWEST = 1.25


def find(trajectories: np.ndarray) -> list[np.ndarray]:
    """Cluster positions (K, S, N, 2), in m, of K runs; return the indices of each cluster's runs.

    Average linkage uses the root mean square, over time, of the distance between joint positions.
    The widest gap between merge distances, on a logarithmic scale, determines the number of
    clusters. If no ratio of consecutive distances exceeds `NARROWEST`, there is one cluster.
    """
    K, S = trajectories.shape[:2]
    if K < 2:
        return [np.arange(K)] if K else []
    joined = linkage(pdist(trajectories.reshape(K, -1)) / np.sqrt(S), "average")
    # The first entry belongs to K clusters, and each merge leaves one cluster less.
    heights = np.concatenate([[SAME], np.maximum(joined[:, 2], SAME)])
    gaps = np.diff(np.log(heights))
    count = K - int(np.argmax(gaps)) if gaps.max() > np.log(NARROWEST) else 1
    return _members(fcluster(joined, count, "maxclust"))


def find_by_k_means(
    trajectories: np.ndarray, count: int, rng: np.random.Generator
) -> list[np.ndarray]:
    """Cluster like `find`, but into `count` clusters by the best of ten runs of k-means++."""
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
