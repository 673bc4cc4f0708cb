"""Flow of a fluid through a gap by Reynolds' equation: finite volumes on the cells of the contact's grid."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse import linalg

from roughvisc.mechanics.transport.bounds import bounds, imbalance
from roughvisc.mechanics.transport.dissection import Cells, pressures
from roughvisc.mechanics.transport.network import Array, Faces, Network, faces_of, network_of

#: Distance of the bounds, relative, at which no better pressures are sought; and how often they are.
_CLOSE = 1e-9
_MOST_ROUNDS = 8
#: Nested dissection is taken from so many cells on, if they are so large a part of the map: then it takes less time
#: than factors, and always less memory (workflows/benchmarks/leakage.py).
_LARGE, _OPEN = 2**18, 0.8


@dataclass(frozen=True)
class Flow:
    """Flow between two sides of a map, for a unit of pressure drop over viscosity.

    Attributes
    ----------
    conductance : float
        Volume flow times viscosity over pressure drop; zero where nothing connects the sides. [m^3]
    lower, upper : float
        Bounds on it, of the discrete equations. [m^3]
    pressure : ndarray, shape (nx, ny)
        Pressure of the fluid: 1 where it comes in, 0 where it goes out, missing where nothing flows through. [-]
    """

    conductance: float
    lower: float
    upper: float
    pressure: Array

    @property
    def is_closed(self) -> bool:
        """Whether no path connects the two sides."""
        return self.upper == 0.0


def flow(gap: Array, spacing: tuple[float, float], *, wrap: bool = False) -> Flow:
    r"""Flow through a gap from one side of the map to the opposite one, along the first axis.

    Parameters
    ----------
    gap : ndarray, shape (nx, ny)
        Finite everywhere; cells without a positive one are closed. [m]
    spacing : tuple of float
        Cell sides ``(dx, dy)``. [m]
    wrap : bool
        Whether the other two sides meet, as those of a periodic map do, or are walls.

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
    They are exact where the gap depends on one coordinate alone and is constant in each cell, and of second order in
    the cells' sides where it is smooth. The equations are solved directly, since the conductances span many decades, on
    which iterations with an algebraic multigrid stall: by SciPy's factorisation in the order of minimum degree, or, if
    the map is large and mostly open, by nested dissection.

    The conductance given is the mean of its bounds, which are as close as rounding allows.

    References
    ----------
    .. [1] B. J. Hamrock, S. R. Schmid, B. O. Jacobson, Fundamentals of Fluid Film Lubrication, 2004, chapter 7.
    """
    if not np.isfinite(gap).all():
        raise ValueError("the gap is missing or infinite in some cells")
    faces = faces_of(gap, spacing, wrap)
    network = network_of(faces)
    field = np.full(gap.shape, np.nan)
    if network is None:
        return Flow(0.0, 0.0, 0.0, field)
    is_large = len(network.cells) >= max(_LARGE, _OPEN * gap.size)
    solve = _by_dissection(faces, network) if is_large else _by_factors(network)
    field.ravel()[network.cells], lower, upper = _solved(network, solve)
    lower, upper = lower * faces.scale, upper * faces.scale
    return Flow((lower + upper) / 2, lower, upper, field)


def fluxes(gap: Array, spacing: tuple[float, float], pressure: Array, *, wrap: bool = False) -> tuple[Array, Array]:
    """Flux of the fluid in the cells: the mean of that through their faces.

    Parameters
    ----------
    gap, spacing, wrap
        As in :func:`flow`.
    pressure : ndarray, shape (nx, ny)
        What :func:`flow` found.

    Returns
    -------
    along, across : ndarray, shape (nx, ny)
        Volume flow over the length of the face, for a unit of pressure drop over viscosity: per metre of the map a
        mobility [m^3] times a gradient [1/m]. Zero where nothing flows through. [m^2]
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


def _solved(network: Network, solve: Callable[[Array], Array]) -> tuple[Array, float, float]:
    """Pressures of the cells that conserve the fluid in each, and bounds on the conductance. [-]

    A lake behind narrow slits loses digits in the factors, as many as the slits are narrower than it is wide; each
    round brings some back.
    """
    pressure = np.zeros(len(network.cells))
    lower, upper = 0.0, np.inf
    for _ in range(_MOST_ROUNDS):
        pressure = np.clip(pressure + solve(imbalance(network, pressure)), 0.0, 1.0)
        below, above = bounds(network, pressure)
        lower, upper = max(lower, below), min(upper, above)
        if upper - lower <= _CLOSE * upper:
            break
    return pressure, min(lower, upper), upper  # that rounding may turn round


def _by_dissection(faces: Faces, network: Network) -> Callable[[Array], Array]:
    """Pressures of the cells from what comes into each of them, by nested dissection."""
    kept = np.zeros(faces.across.shape, dtype=bool)
    kept.ravel()[network.cells] = True
    halves = np.zeros((4, *kept.shape))
    halves[0, 1:] = halves[2, :-1] = 2 * np.where(kept[1:] & kept[:-1], faces.along[1:-1], 0.0)
    halves[3] = 2 * np.where(kept & np.roll(kept, -1, axis=1), faces.across, 0.0)
    halves[1] = np.roll(halves[3], 1, axis=1)
    ground = np.zeros(kept.shape)
    ground[0] += faces.along[0]
    ground[-1] += faces.along[-1]
    ground[~kept] = 0.0

    def solve(source: Array) -> Array:
        coming = np.zeros(kept.shape)
        coming[kept] = source
        return pressures(Cells(halves, ground, coming))[kept]

    return solve


def _by_factors(network: Network) -> Callable[[Array], Array]:
    """The same by factors of the equations, which are scaled by the root of their diagonal."""
    count = len(network.cells)
    diagonal = network.entrance + network.exit
    np.add.at(diagonal, network.first, network.conductance)
    np.add.at(diagonal, network.second, network.conductance)
    scale = 1 / np.sqrt(diagonal)
    between = -network.conductance * scale[network.first] * scale[network.second]
    every = np.arange(count)
    entries = np.concatenate([between, between, np.ones(count)])
    rows = np.concatenate([network.first, network.second, every])
    columns = np.concatenate([network.second, network.first, every])
    matrix = sparse.coo_array((entries, (rows, columns)), shape=(count, count)).tocsc()
    # positive definite: no pivoting, and the ordering of symmetric matrices
    options = {"SymmetricMode": True}
    factors = linalg.splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    return lambda source: scale * factors.solve(scale * source)
