"""Spots as discs, and estimates of the stiffness of many, and so of their conductance: by Holm and by Greenwood."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.special import erfc

from roughvisc.mechanics.contact.neighbours import PERIMETER_CORRECTION, neighbours

Array = NDArray[np.float64]

# Points a side of the table of what the images add. Cubic between them: within 1e-6 of the constant of a square.
_TABLE = 33
# Terms of Ewald's sums on each side: the next ones are below 1e-9 of the first.
_TERMS = 3
# Pairs of spots at once.
_PAIRS = 1_000_000


def round_spots(
    labels: NDArray[np.integer], free: NDArray[np.bool_], spacing: tuple[float, float], periodic: bool = False
) -> tuple[Array, Array]:
    """Discs of the areas of the spots, corrected for the grid, in their places.

    Parameters
    ----------
    labels : ndarray of int, shape (nx, ny)
        Numbers of the spots from 1 on, 0 outside.
    free : ndarray of bool, shape (nx, ny)
        Cells out of contact where there is material: counted cells are too large towards these.
    spacing : tuple of float
        Cell sides. [m]
    periodic : bool
        Whether a spot goes on across opposite borders.

    Returns
    -------
    radii : ndarray, shape (n,)
        [m]
    positions : ndarray, shape (n, 2)
        Centres, from the corner of the first cell; with periodic boundaries by the mean angle around the period. [m]
    """
    count = int(labels.max(initial=0)) + 1
    faces: Array = sum((beside & (labels > 0)).astype(float) for beside in neighbours(free, periodic))  # type: ignore
    cells = np.bincount(labels.ravel(), minlength=count)[1:]
    strip = np.bincount(labels.ravel(), faces.ravel(), minlength=count)[1:]
    areas = (cells - PERIMETER_CORRECTION * strip) * spacing[0] * spacing[1]
    places = []
    for axis, side in enumerate(spacing):
        n = labels.shape[axis]
        at = np.broadcast_to(np.expand_dims(np.arange(n) + 0.5, 1 - axis), labels.shape)
        if periodic:
            turn = np.exp(2j * math.pi / n * at)
            parts = (np.bincount(labels.ravel(), part.ravel(), count)[1:] for part in (turn.real, turn.imag))
            cosine, sine = parts
            places.append(np.arctan2(sine, cosine) / (2 * math.pi) % 1 * n * side)
        else:
            places.append(np.bincount(labels.ravel(), at.ravel(), count)[1:] / cells * side)
    return np.sqrt(areas / math.pi), np.stack(places, axis=-1)


def holm(radii: Array, positions: Array, period: tuple[float, float] | None = None) -> float:
    r"""Holm's estimate for many spots: side by side, and in series with the disc that they lie in.

    Parameters
    ----------
    radii : ndarray, shape (n,)
        [m]
    positions : ndarray, shape (n, 2)
        [m]
    period : tuple of float, optional
        Sides of one period; the constriction to the whole surface is none then. [m]

    Returns
    -------
    float
        ``k`` with ``1/k = 1/(2 sum a) + 1/(2 alpha)``: a conductance times half the sum of the resistivities. [m]

    Notes
    -----
    ``alpha`` is the radius of the disc with the same radius of gyration as the spots, ``sqrt(2)`` times it [1]_. The
    spots are taken for many: of two far ones the second term is 4.4 times too large.

    References
    ----------
    .. [1] R. Holm, *Electric Contacts*, 4th ed., Springer, 1967, section 4.

    Examples
    --------
    >>> holm(np.array([1e-6]), np.zeros((1, 2)))
    2e-06
    """
    total = 2 * float(np.sum(radii))
    if total == 0 or period is not None:
        return total
    centre = np.average(positions, axis=0, weights=radii)
    gyration = math.sqrt(float(np.average(np.sum((positions - centre) ** 2, axis=1), weights=radii)))
    return total if gyration == 0 else 1 / (1 / total + 1 / (2 * math.sqrt(2) * gyration))


def greenwood(radii: Array, positions: Array, period: tuple[float, float] | None = None) -> float:
    r"""Greenwood's estimate: round spots, each with a current in proportion to its radius.

    Parameters
    ----------
    radii : ndarray, shape (n,)
        [m]
    positions : ndarray, shape (n, 2)
        [m]
    period : tuple of float, optional
        Sides of one period. [m]

    Returns
    -------
    float
        ``k`` with ``1/k = 1/(2 sum a) + sum_{i != j} a_i a_j / s_ij / (pi (sum a)^2)``. [m]

    Notes
    -----
    The second term is the interaction of points [1]_: too weak for spots that nearly touch. With periodic boundaries
    ``1/s`` is the sum over all images less its mean, and each spot has its own images.

    References
    ----------
    .. [1] J. A. Greenwood, *Br. J. Appl. Phys.* 17 (1966) 1621-1632.
    """
    total = float(np.sum(radii))
    if total == 0:
        return 0.0
    images = None if period is None else _image_table(period)
    energy = 0.0
    rows = max(_PAIRS // len(radii), 1)
    for first in range(0, len(radii), rows):
        some = slice(first, first + rows)
        apart = positions[some, None] - positions[None]
        if period is not None:
            apart -= np.asarray(period) * np.round(apart / np.asarray(period))
        distance = np.hypot(apart[..., 0], apart[..., 1])
        seen = np.divide(1.0, distance, out=np.zeros_like(distance), where=distance > 0)
        if images is not None and period is not None:
            seen += _looked_up(images, apart, period)
        energy += float(radii[some] @ seen @ radii)
    return 1 / (1 / (2 * total) + energy / (math.pi * total**2))


def lattice_potential(apart: Array, period: tuple[float, float]) -> Array:
    """Sum of ``1/r`` over all images but the nearest, less the mean of the whole sum, by Ewald's method. [1/m]

    Parameters
    ----------
    apart : ndarray, shape (..., 2)
        Within half a period of zero. [m]
    period : tuple of float
        [m]

    Examples
    --------
    >>> round(float(lattice_potential(np.zeros(2), (1.0, 1.0))), 6)  # the constant of a square lattice
    -3.900265
    """
    area = period[0] * period[1]
    eta = math.sqrt(math.pi / area)
    aspect = max(period) / min(period)
    terms = math.ceil(_TERMS * math.sqrt(aspect)) + 1
    total = np.full(apart.shape[:-1], -2 * math.sqrt(math.pi) / (eta * area))
    for i in range(-terms, terms + 1):
        for j in range(-terms, terms + 1):
            r = np.hypot(apart[..., 0] + i * period[0], apart[..., 1] + j * period[1])
            if i or j:
                total += erfc(eta * r) / r
                qx, qy = 2 * math.pi * i / period[0], 2 * math.pi * j / period[1]
                q = math.hypot(qx, qy)
                wave = np.cos(qx * apart[..., 0] + qy * apart[..., 1])
                total += 2 * math.pi / area * erfc(q / (2 * eta)) / q * wave
            else:  # what the nearest one lacks: -erf(eta r) / r, which is smooth
                near = eta * r
                safe = np.where(near > 1e-8, r, 1.0)
                total += np.where(near > 1e-8, (erfc(near) - 1) / safe, -2 * eta / math.sqrt(math.pi))
    return total


def _image_table(period: tuple[float, float]) -> Array:
    """The lattice potential over a quarter of the cell around a spot, as coefficients of cubic splines."""
    x, y = (np.linspace(0, side / 2, _TABLE) for side in period)
    values = lattice_potential(np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1), period)
    coefficients: Array = ndimage.spline_filter(values, order=3, mode="mirror")  # even about all four sides
    return coefficients


def _looked_up(table: Array, apart: Array, period: tuple[float, float]) -> Array:
    index = np.abs(np.moveaxis(apart, -1, 0)) / (np.reshape(period, (2, 1, 1)) / 2) * (_TABLE - 1)
    found: Array = ndimage.map_coordinates(table, index, order=3, mode="mirror", prefilter=False)
    return found
