"""Connected clusters of one map, free or repeated periodically. Arrays only."""

from __future__ import annotations

import numpy as np
from scipy import ndimage, sparse


def label_clusters(mask: np.ndarray, periodic: bool = False) -> tuple[np.ndarray, int]:
    """Number the connected clusters of one map. Cells that share only a corner are not connected.

    Parameters
    ----------
    mask : array_like of bool, shape (nx, ny)
        Cells that belong to any cluster.
    periodic : bool
        Whether a cluster continues across opposite borders.

    Returns
    -------
    labels : ndarray of int, shape (nx, ny)
        From 1 on; 0 outside the clusters.
    count : int
        Number of clusters.

    Examples
    --------
    >>> ends = [[True], [False], [True]]
    >>> label_clusters(ends)[1], label_clusters(ends, periodic=True)[1]
    (2, 1)
    """
    labels, count = ndimage.label(np.asarray(mask, dtype=bool))
    if not periodic or count < 2:
        return labels, count
    borders = np.concatenate(
        [np.stack([labels[-1], labels[0]], axis=1), np.stack([labels[:, -1], labels[:, 0]], axis=1)]
    )
    links = np.unique(borders[(borders > 0).all(axis=1)], axis=0) - 1
    graph = sparse.coo_array((np.ones(len(links)), links.T), shape=(count, count))
    merged = sparse.csgraph.connected_components(graph, directed=False)[1]
    return np.append(0, merged + 1).astype(labels.dtype)[labels], int(merged.max()) + 1


def cluster_sizes(mask: np.ndarray, periodic: bool = False) -> np.ndarray:
    """Number of cells of each cluster of one map, largest first; parameters as for :func:`label_clusters`."""
    labels, count = label_clusters(mask, periodic)
    return np.sort(np.bincount(labels.ravel(), minlength=count + 1)[1:])[::-1]
