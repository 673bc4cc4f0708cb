"""Gauss quadrature over panels."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Gauss-Legendre nodes and weights on [-1, 1], by number of points.
rule = cache(np.polynomial.legendre.leggauss)


def panels(count: int, end: float, points: int) -> tuple[Array, Array]:
    """Return Gauss nodes and weights on equal parts of the interval from zero to an end."""
    nodes, weights = rule(points)
    side = end / count
    places = (np.arange(count)[:, None] + (nodes + 1) / 2) * side
    return places.ravel(), np.tile(weights * side / 2, count)
