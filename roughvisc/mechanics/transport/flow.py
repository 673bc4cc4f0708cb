"""Flow of a fluid through a gap by Reynolds' equation: finite volumes on the cells of the contact's grid."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from roughvisc.mechanics.transport.network import (
    Array,
    Network,
    dissipation,
    equations,
    faces_of,
    factors,
    imbalance,
    network_of,
)
from roughvisc.mechanics.transport.two_grids import solver_on_two_grids

#: Relative error of the conductance at which the iteration ends.
_CLOSE = 1e-9
#: Number of cells from which two grids are used, and relative error of the energy in each round on them.
_LARGE, _ON_TWO_GRIDS = 2**12, (1e-16, 1e-2, 1e-2, 1e-2)
#: Largest number of rounds with direct factors.
_BY_FACTORS = 8


@dataclass(frozen=True)
class Flow:
    """Flow between two sides of a map, for a unit of pressure drop over viscosity.

    Attributes
    ----------
    conductance : float
        Volume flow times viscosity over pressure drop; zero if no path connects the sides. [m^3]
    error : float
        Estimated error of the conductance of the discrete equations. [m^3]
    pressure : ndarray, shape (nx, ny)
        Pressure of the fluid: 1 at the inlet, 0 at the outlet, missing in cells without flow. [-]
    """

    conductance: float
    error: float
    pressure: Array


def flow(gap: Array, spacing: tuple[float, float], *, wrap: bool = False) -> Flow:
    r"""Return the flow through a gap from one side of the map to the opposite side, along the first axis.

    Parameters
    ----------
    gap : ndarray, shape (nx, ny)
        Gap, finite everywhere; cells without a positive gap are closed. [m]
    spacing : tuple of float
        Cell sides ``(dx, dy)``. [m]
    wrap : bool
        Whether the other two sides are joined, as in a periodic map; otherwise they are walls.

    Returns
    -------
    Flow

    Raises
    ------
    ValueError
        If a gap is missing or infinite.

    Notes
    -----
    Reynolds' equation for creeping flow of a constant viscosity :math:`\eta`, without slip and with small slopes,

    .. math:: \nabla \cdot \left(\frac{g^3}{12 \eta} \nabla P\right) = 0,

    by cell-centred finite volumes: see :func:`roughvisc.mechanics.transport.network.faces_of` for the conductances.
    They are exact for a gap that depends on one coordinate and is constant in each cell, and of second order in the
    sides of the cells for a smooth gap. Small maps are solved with SciPy's direct factors in minimum-degree order,
    large ones by conjugate gradients on two grids. If the conductances span too many decades for two grids, direct
    factors follow.

    By Dirichlet's principle the dissipation of approximate pressures exceeds the conductance [2]_. The excess is the
    work of what flows into the cells and not out of them on the remaining error of the pressures, which the next round
    solves for. The iteration ends when it is below 1e-9 of the conductance.

    References
    ----------
    .. [1] B. J. Hamrock, S. R. Schmid, B. O. Jacobson, Fundamentals of Fluid Film Lubrication, 2004, chapter 7.
    .. [2] P. G. Doyle, J. L. Snell, Random Walks and Electric Networks, MAA, 1984, section 1.3.5.
    """
    if not np.isfinite(gap).all():
        raise ValueError("the gap is missing or infinite in some cells")
    faces = faces_of(gap, spacing, wrap)
    network = network_of(faces)
    field = np.full(gap.shape, np.nan)
    if network is None:
        return Flow(0.0, 0.0, field)
    pressure, conductance, error = np.zeros(len(network.cells)), 0.0, np.inf
    for solve in _solvers(network, gap.shape[1]):
        left = imbalance(network, pressure)
        step = solve(left)
        conductance, error = dissipation(network, pressure), abs(float(left @ step))
        # the factors lose digits for a wide basin behind narrow slits; each round recovers some
        pressure = np.clip(pressure + step, 0.0, 1.0)
        if error <= _CLOSE * conductance:
            break
    field.ravel()[network.cells] = pressure
    return Flow(conductance * faces.scale, error * faces.scale, field)


def fluxes(gap: Array, spacing: tuple[float, float], pressure: Array, *, wrap: bool = False) -> tuple[Array, Array]:
    """Return the flux in the cells: the mean over opposite faces.

    Parameters
    ----------
    gap, spacing, wrap
        As in :func:`flow`.
    pressure : ndarray, shape (nx, ny)
        Pressure from :func:`flow`.

    Returns
    -------
    along, across : ndarray, shape (nx, ny)
        Volume flow per length of the face and per pressure drop over viscosity: a mobility [m^3] times a gradient
        [1/m]. Zero in cells without flow. [m^2]
    """
    faces = faces_of(gap, spacing, wrap)
    inside = np.where(np.isnan(pressure), 0.0, pressure)
    kept = ~np.isnan(pressure)
    ends = np.concatenate([np.ones_like(inside[:1]), inside, np.zeros_like(inside[:1])])
    reached = np.pad(kept, ((1, 1), (0, 0)), constant_values=True)
    along = np.where(reached[1:] & reached[:-1], -faces.along * np.diff(ends, axis=0), 0.0)
    there = np.roll(inside, -1, axis=1)
    across = np.where(kept & np.roll(kept, -1, axis=1), faces.across * (inside - there), 0.0)
    mean_along, mean_across = (along[1:] + along[:-1]) / 2, (across + np.roll(across, 1, axis=1)) / 2
    return mean_along * faces.scale / spacing[1], mean_across * faces.scale / spacing[0]


def _solvers(network: Network, width: int) -> Iterator[Callable[[Array], Array]]:
    """Yield the solver of each round: two grids for a large network, then direct factors."""
    if len(network.cells) >= _LARGE:
        solve = solver_on_two_grids(network, width)
        yield from (functools.partial(solve, enough) for enough in _ON_TWO_GRIDS)
    yield from itertools.repeat(factors(equations(network)), _BY_FACTORS)
