"""Bounds on the conductance of a network: an upper bound from any pressures, a lower bound from any conserved flux."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from roughvisc.mechanics.transport.network import Array, Network, Numbers


def imbalance(network: Network, pressure: Array) -> Array:
    """Return inflow less outflow of each cell for given pressures of the cells. [-]"""
    flux = network.conductance * (pressure[network.first] - pressure[network.second])
    left = network.entrance * (1.0 - pressure) - network.exit * pressure
    np.add.at(left, network.second, flux)
    np.subtract.at(left, network.first, flux)
    return left


def bounds(network: Network, pressure: Array) -> tuple[float, float]:
    r"""Return bounds on the conductance between the two sides of a network.

    Parameters
    ----------
    network : Network
        Cells and faces.
    pressure : ndarray, shape (n,)
        Pressures of the cells, relative to the pressure drop: 1 at the inlet, 0 at the outlet. Better pressures give
        closer bounds. [-]

    Returns
    -------
    lower, upper : float
        Bounds, in the unit of the conductances of the network. [-]

    Notes
    -----
    Dirichlet's principle: :math:`G \le \sum c \, \Delta P^2` with the conductances :math:`c` of the faces
    and the jumps :math:`\Delta P` of any pressures with the given values on the two sides. Thomson's principle:
    :math:`G \ge Q^2 / \sum q^2 / c` with any flux :math:`q` that is conserved in every cell and has the total
    :math:`Q`. Here the flux is :math:`c \, \Delta P` plus a correction: the imbalance of each cell flows to a side
    along the maximum spanning tree of the conductances. Both bounds are exact for the solution of the discrete
    equations. For an approximate solution they differ by the square of its error.

    References
    ----------
    .. [1] P. G. Doyle, J. L. Snell, Random Walks and Electric Networks, MAA, 1984, section 1.3.5 and exercise 1.3.11.
    """
    first, second = network.first, network.second
    jump, entering = pressure[first] - pressure[second], 1.0 - pressure
    upper = np.sum(network.conductance * jump**2)
    upper += np.sum(network.entrance * entering**2) + np.sum(network.exit * pressure**2)

    flux, into, out = network.conductance * jump, network.entrance * entering, network.exit * pressure
    _lead_away(network, imbalance(network, pressure), flux, into, out)
    loss = np.sum(flux**2 / network.conductance)
    loss += sum(
        np.sum(np.divide(through**2, face, where=face > 0, out=np.zeros_like(face)))
        for through, face in ((into, network.entrance), (out, network.exit))
    )
    through = float(into.sum())
    return through**2 / float(loss) if loss > 0 else 0.0, float(upper)


def _lead_away(network: Network, left: Array, flux: Array, into: Array, out: Array) -> None:
    """Add to the fluxes, in place, a flow of the imbalances to the sides along the maximum spanning tree."""
    side = len(left)  # both sides together are the root of the tree
    at_sides = np.maximum(network.entrance, network.exit)
    touching = np.flatnonzero(at_sides)
    one = np.concatenate([network.first, touching]).astype(np.int32)  # for older SciPy versions
    other = np.concatenate([network.second, np.full(len(touching), side)]).astype(np.int32)
    width = np.log(np.concatenate([network.conductance, at_sides[touching]]))
    graph = sparse.coo_array((width.max() - width + 1.0, (one, other)), shape=(side + 1, side + 1)).tocsr()
    tree = sparse.csgraph.minimum_spanning_tree(graph)
    order, above = sparse.csgraph.breadth_first_order(tree, side, directed=False)
    carried = _summed_upward(order, above, left)
    below = np.arange(side)
    above = above[:side].astype(np.int64)

    last = above == side
    leaving = network.exit >= network.entrance
    out += np.where(last & leaving, carried, 0.0)
    into -= np.where(last & ~leaving, carried, 0.0)
    inner = below[~last]
    outer = above[inner]
    pairs = np.minimum(inner, outer) * (side + 1) + np.maximum(inner, outer)
    face = np.searchsorted(network.first.astype(np.int64) * (side + 1) + network.second, pairs)
    flux[face] += np.where(inner < outer, carried[inner], -carried[inner])


def _summed_upward(order: Numbers, above: Numbers, left: Array) -> Array:
    """Return the sum of the imbalances of each cell and of all cells below it in the tree.

    The order is breadth-first from the root, so that the positions of the parents ascend.
    """
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    over = place[above[order[1:]]] + 1  # position of the parent cell, from one on; the root has none
    over = np.concatenate([[0], over])
    carried = np.append(left, 0.0)[order]
    starts = [0, 1]
    while starts[-1] < len(order):
        starts.append(int(np.searchsorted(over, starts[-1], side="right")))
    for start, middle, end in zip(starts[-3::-1], starts[-2::-1], starts[:0:-1], strict=False):
        carried[start:middle] += np.bincount(over[middle:end] - start - 1, carried[middle:end], middle - start)
    return carried[place[:-1]]
