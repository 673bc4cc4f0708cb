"""Connected regions of one map, free or repeated periodically: clusters and percolation. Arrays only."""

from __future__ import annotations

import numpy as np
from scipy import ndimage, sparse

from roughvisc.errors import InputError
from roughvisc.topography.blocks import row_blocks

_STRUCTURES = {4: ndimage.generate_binary_structure(2, 1), 8: ndimage.generate_binary_structure(2, 2)}


def label_clusters(mask: np.ndarray, periodic: bool = False, connectivity: int = 4) -> tuple[np.ndarray, int]:
    """Number the connected clusters of one map.

    Parameters
    ----------
    mask : array_like of bool, shape (nx, ny)
        The cells that belong to any cluster.
    periodic : bool
        Whether a cluster goes on across opposite borders.
    connectivity : {4, 8}
        Whether cells that share only a corner are apart or together.

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
    mask = np.asarray(mask, dtype=bool)
    if connectivity not in _STRUCTURES:
        raise InputError(f"connectivity is {connectivity!r}: expected 4 or 8")
    labels, count = ndimage.label(mask, _STRUCTURES[connectivity])
    if not periodic or count < 2:
        return labels, count
    links = _border_links(labels, connectivity)[:, :2] - 1
    graph = sparse.coo_array((np.ones(len(links)), links.T), shape=(count, count))
    merged = sparse.csgraph.connected_components(graph, directed=False)[1]
    return np.append(0, merged + 1).astype(labels.dtype)[labels], int(merged.max()) + 1


def cluster_sizes(mask: np.ndarray, periodic: bool = False, connectivity: int = 4) -> np.ndarray:
    """Number of cells of each cluster of one map, largest first; parameters as for :func:`label_clusters`."""
    labels, count = label_clusters(mask, periodic, connectivity)
    sizes = np.zeros(count + 1, int)
    for rows in row_blocks(labels.shape):  # counting takes a copy
        sizes += np.bincount(labels[rows].ravel(), minlength=count + 1)
    return np.sort(sizes[1:])[::-1]


def _border_links(labels: np.ndarray, connectivity: int) -> np.ndarray:
    """Links between clusters across the borders of a periodic map: rows (from, to, turns in x, turns in y)."""
    reach = (-1, 0, 1) if connectivity == 8 else (0,)
    found = []
    for axis, turn in ((0, (1, 0)), (1, (0, 1))):
        last, first = np.take(labels, -1, axis), np.take(labels, 0, axis)
        for shift in reach:
            there = np.arange(last.size) + shift
            turns = [np.full(last.size, one) for one in turn]
            turns[1 - axis] = there // last.size
            found.append(np.stack([last, first[there % last.size], *turns], axis=1))
    links = np.concatenate(found)
    return np.unique(links[(links[:, 0] > 0) & (links[:, 1] > 0)], axis=0)


def _percolates_around(labels: np.ndarray, connectivity: int) -> tuple[bool, bool]:
    """Whether a cluster of a periodic map comes back to itself after a turn along x, along y."""
    neighbours: dict[int, list[tuple[int, np.ndarray]]] = {}
    for here, there, *turns in _border_links(labels, connectivity).tolist():
        neighbours.setdefault(here, []).append((there, np.array(turns)))
        neighbours.setdefault(there, []).append((here, -np.array(turns)))
    turned = np.zeros(2, dtype=bool)
    place: dict[int, np.ndarray] = {}
    for start in neighbours:
        if start in place:
            continue
        place[start] = np.zeros(2, dtype=int)
        waiting = [start]
        while waiting:
            here = waiting.pop()
            for there, turns in neighbours[here]:
                if there not in place:
                    place[there] = place[here] + turns
                    waiting.append(there)
                else:
                    turned |= place[here] + turns != place[there]
    return bool(turned[0]), bool(turned[1])


def percolates(mask: np.ndarray, periodic: bool = False, connectivity: int = 4) -> tuple[bool, bool]:
    """Whether a region connects opposite sides of one map, along x and along y.

    Parameters
    ----------
    mask : array_like of bool, shape (nx, ny)
        The region.
    periodic : bool
        False: a cluster touches both borders. True: a path through the repeated map returns to its start one or more
        periods further along.
    connectivity : {4, 8}
        Whether cells that share only a corner are apart or together.

    Returns
    -------
    tuple of bool
        Along x, along y.

    Examples
    --------
    >>> percolates([[True, False], [True, False]])
    (True, False)
    """
    mask = np.asarray(mask, dtype=bool)
    labels, _ = label_clusters(mask, connectivity=connectivity)
    if periodic:
        return _percolates_around(labels, connectivity)
    across = [
        np.intersect1d(low[low > 0], high[high > 0]).size > 0
        for low, high in ((labels[0], labels[-1]), (labels[:, 0], labels[:, -1]))
    ]
    return across[0], across[1]
