"""Connected clusters of the cells of a map."""

from __future__ import annotations

import numpy as np
from scipy import ndimage, sparse


def label_clusters(mask: np.ndarray, wrap: tuple[bool, bool] = (False, False)) -> tuple[np.ndarray, int]:
    """Number the connected clusters of one map. Cells that share only a corner are not connected.

    Parameters
    ----------
    mask : array_like of bool, shape (nx, ny)
        Cells that belong to any cluster.
    wrap : pair of bool
        Whether a cluster continues across the opposite borders of each axis.

    Returns
    -------
    labels : ndarray of int, shape (nx, ny)
        From 1 on; 0 outside the clusters.
    count : int
        Number of clusters.

    Examples
    --------
    >>> ends = [[True], [False], [True]]
    >>> label_clusters(ends)[1], label_clusters(ends, (True, False))[1]
    (2, 1)
    """
    labels, count = ndimage.label(mask)
    borders = [labels.take((0, -1), axis).swapaxes(0, axis) for axis in (0, 1) if wrap[axis]]
    links = np.concatenate([np.zeros((2, 1), int), *borders], axis=1)
    links = links[:, (links > 0).all(axis=0)]
    graph = sparse.coo_array((np.ones(links.shape[1]), links), shape=(count + 1, count + 1))
    pieces, merged = sparse.csgraph.connected_components(graph, directed=False)
    return merged[labels], pieces - 1
