r"""Influence of a sheet on cells that are longer than half its thickness.

A uniform pressure on a cell displaces a thin, incompressible sheet along the edges of that cell only. The centres of
long cells do not move, and the sheet would seem rigid. The kernel is split as Ewald splits the Coulomb potential [1]_:

.. math::
    K_q = K^s_q + q^2 G_q, \qquad K^s_q = \frac2q \operatorname{erf} \frac{q}{2 \kappa}
        + \left(K_0 - \frac{2}{\sqrt\pi\,\kappa}\right) e^{-q^2 / 12 \kappa^2}

The first part reaches less far than a thickness. It is taken as on short cells: at the centres of the cells, under
pressures that are uniform on each cell. The second part is minus the Laplacian of a smooth kernel ``G``, by finite
differences of fourth order from cell to cell. In the limit of a thin incompressible sheet ``K = 4/3 h^3 q^2``, and the
differences of pressure between neighbours squeeze the sheet from one cell to the next, as a film in lubrication theory.

All lengths here are in thicknesses.

References
----------
.. [1] P. P. Ewald, Ann. Phys. 369 (1921) 253.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.bodies.love import rectangle_displacement

Array = NDArray[np.float64]

# With this kappa the response to long waves is right to 1e-3 of 4/3 q^2 on cells of any length (measured).
_KAPPA = 3.0
# Distance at which erfc(kappa r) is below rounding, and Gauss points that integrate over as much to rounding.
_SHORT_REACH, _GAUSS_POINTS = 6.2 / _KAPPA, 32
# Wave number at which the second part of the kernel, 2/q erfc(q / 2 kappa), is below rounding.
_LAST_WAVE = 12 * _KAPPA
# Minus the second derivative, to fourth order in the spacing.
_SECOND_DIFFERENCE = (-1 / 12, 16 / 12, -30 / 12, 16 / 12, -1 / 12)
_MARGIN = len(_SECOND_DIFFERENCE) // 2


def long_cell_influence(
    shape: tuple[int, int],
    sides: tuple[float, float],
    transfer: Callable[[Array], Array],
    uniform: float,
    reach: float,
) -> Array:
    """Displacement of cells due to unit pressure on the cell at the origin.

    Parameters
    ----------
    shape : tuple of int
        Number of cells ``(nx, ny)``.
    sides : tuple of float
        Cell sides. [thicknesses]
    transfer : callable
        ``K_q`` of positive wave numbers. [thicknesses]
    uniform : float
        Its limit ``K_0`` at zero. [thicknesses]
    reach : float
        Distance beyond which the kernel is zero to rounding. [thicknesses]

    Returns
    -------
    ndarray, shape (nx, ny)
        [thicknesses]
    """
    from scipy.special import erf  # slow to import

    rest = uniform - 2 / (math.sqrt(math.pi) * _KAPPA)
    influence = np.zeros(shape)

    # a Fourier sum over half-integer wave numbers: its nearest images lie two reaches away
    waves = np.asarray((np.arange(math.ceil(_LAST_WAVE * reach / math.pi)) + 0.5) * math.pi / reach, dtype=np.float64)
    squared = waves[:, None] ** 2 + waves**2
    q = np.sqrt(squared)
    smooth = (transfer(q) - 2 / q * erf(q / (2 * _KAPPA)) - rest * np.exp(-squared / (12 * _KAPPA**2))) / squared
    nx, ny = (min(n, math.ceil(reach / side + 0.5) + _MARGIN) for n, side in zip(shape, sides, strict=True))
    means = _cell_waves(nx, sides[0], waves, reach) @ smooth @ _cell_waves(ny, sides[1], waves, reach).T
    for shift, weight in enumerate(_SECOND_DIFFERENCE):
        influence[:nx, :ny] -= weight / sides[0] ** 2 * means[shift : shift + nx, _MARGIN:-_MARGIN]
        influence[:nx, :ny] -= weight / sides[1] ** 2 * means[_MARGIN:-_MARGIN, shift : shift + ny]

    nx, ny = (min(n, math.ceil(_SHORT_REACH / side + 0.5)) for n, side in zip(shape, sides, strict=True))
    x, width = _clipped_cells(np.arange(nx), sides[0], _SHORT_REACH)
    y, depth = _clipped_cells(np.arange(ny), sides[1], _SHORT_REACH)
    nodes, weights = np.polynomial.legendre.leggauss(_GAUSS_POINTS)
    at_x, at_y = (at[:, None] + side[:, None] * nodes / 2 for at, side in ((x, width), (y, depth)))
    distance = np.hypot(at_x[:, None, :, None], at_y[:, None, :])
    beyond = erf(_KAPPA * distance) / (math.pi * distance)  # what 1 / (pi r) has more than the first part
    influence[:nx, :ny] += rectangle_displacement(x[:, None], y, (width[:, None], depth))
    influence[:nx, :ny] -= np.outer(width, depth) / 4 * (beyond @ weights @ weights)
    share_x, share_y = (
        (erf(math.sqrt(3) * _KAPPA * (at + side / 2)) - erf(math.sqrt(3) * _KAPPA * (at - side / 2))) / 2
        for at, side in ((x, width), (y, depth))
    )
    influence[:nx, :ny] += rest * np.outer(share_x, share_y)
    return influence


def _clipped_cells(cells: NDArray[np.intp], side: float, reach: float) -> tuple[Array, Array]:
    """Centre and length of what lies within a distance of the origin, of each cell along an axis."""
    lower, upper = (np.clip((cells + end) * side, -reach, reach) for end in (-0.5, 0.5))
    return (lower + upper) / 2, upper - lower


def _cell_waves(count: int, side: float, waves: Array, reach: float) -> Array:
    """Integrals of waves over so many cells from the origin on, and over some on either side of these."""
    centre, length = _clipped_cells(np.arange(-_MARGIN, count + _MARGIN), side, reach)
    integrals = np.cos(np.outer(centre, waves)) * np.sin(np.outer(length / 2, waves)) * (2 / waves)
    return np.asarray(integrals / reach)
