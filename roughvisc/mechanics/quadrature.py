"""Gauss quadrature over panels and over cells."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_rule = cache(np.polynomial.legendre.leggauss)


def panels(count: int, end: float, points: int) -> tuple[Array, Array]:
    """Return Gauss nodes and weights on equal parts of an interval from zero."""
    nodes, weights = _rule(points)
    side = end / count
    at = (np.arange(count)[:, None] + (nodes + 1) / 2) * side
    return at.ravel(), np.tile(weights * side / 2, count)


def cell_mean(
    function: Callable[[Array], Array], x: NDArray, y: NDArray, sides: tuple[float, float], points: tuple[int, int]
) -> Array:
    """Return the mean of a function of the distance over a cell, by Gauss quadrature.

    Parameters
    ----------
    function : callable
        Takes distances. [m]
    x, y : ndarray
        Positions relative to the centre of the cell, which broadcast. [m]
    sides : tuple of float
        Cell sides. [m]
    points : tuple of int
        Gauss points along each side.
    """
    total = np.zeros(np.broadcast_shapes(x.shape, y.shape))
    (along_x, share_x), (along_y, share_y) = map(_rule, points)
    for a, part_a in zip(along_x * sides[0] / 2, share_x / 2, strict=True):
        square = (x + a) ** 2
        for b, part_b in zip(along_y * sides[1] / 2, share_y / 2, strict=True):
            total += part_a * part_b * function(np.sqrt(square + (y + b) ** 2))
    return total
