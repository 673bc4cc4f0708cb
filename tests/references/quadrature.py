"""Quadrature of functions with singular ends of the interval.

Gauss panels that halve towards both ends converge exponentially for any power or logarithm at an end, near an
end, and for boundary layers of any width: contact histories have all three.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

_ORDER = 10
_LEVELS = 40  # the last panel is 2^-40 of the interval
_BLOCK = 2000  # integrals evaluated at once, which bounds the memory


@cache
def graded_rule() -> tuple[Array, Array, Array]:
    """Nodes ``u`` on (0, 1), their complements ``1 - u`` without cancellation, and weights."""
    nodes, weights = np.polynomial.legendre.leggauss(_ORDER)
    edges = np.append(0.0, 0.5 ** np.arange(_LEVELS, 0, -1))
    width = np.diff(edges)[:, None]
    half = (edges[:-1, None] + width * (nodes + 1) / 2).ravel()
    weight = (width * weights / 2).ravel()
    return (
        np.concatenate([half, 1 - half[::-1]]),
        np.concatenate([1 - half, half[::-1]]),
        np.concatenate([weight, weight[::-1]]),
    )


def integrate(function: Callable[..., Array], lower: ArrayLike, upper: ArrayLike, *arguments: ArrayLike) -> Array:
    """Integral between graded ends, one for each element of the broadcast limits.

    Parameters
    ----------
    function : callable
        ``function(from_lower, to_upper, *arguments)``, given the distances of the nodes from both limits, so that
        neither suffers from cancellation. Arrays of shape (n, nodes) and arguments of shape (n, 1).
    lower, upper : array_like
        Limits; an empty or reversed interval gives zero.
    *arguments : array_like
        Broadcast with the limits and handed on.

    Returns
    -------
    ndarray
        The integrals.
    """
    from_lower, to_upper, weights = graded_rule()
    broadcast = np.broadcast_arrays(*(np.asarray(a, dtype=float) for a in (lower, upper, *arguments)))
    shape = broadcast[0].shape
    columns = [np.reshape(a, (-1, 1)) for a in broadcast]
    length = np.maximum(columns[1] - columns[0], 0.0)
    total = np.zeros(len(length))
    for start in range(0, len(length), _BLOCK):
        part = slice(start, start + _BLOCK)
        values = function(length[part] * from_lower, length[part] * to_upper, *(c[part] for c in columns[2:]))
        total[part] = length[part, 0] * np.sum(values * weights, axis=1)
    return total.reshape(shape)


def bisect(function: Callable[[Array], Array], lower: ArrayLike, upper: ArrayLike, iterations: int = 110) -> Array:
    """Where a function that never falls crosses zero, for each element; the nearer limit if it does not.

    The steps halve the interval, in the logarithm while the limits are more than a factor of two apart, so
    that a crossing near zero keeps its relative accuracy.
    """
    low, high = (np.array(a, dtype=float) for a in np.broadcast_arrays(lower, upper))
    for _ in range(iterations):
        far = high > 2 * np.maximum(low, 1e-300)
        middle = np.where(far, np.sqrt(np.maximum(low, 1e-30 * high)) * np.sqrt(high), low + (high - low) / 2)
        above = function(middle) > 0
        high = np.where(above, middle, high)
        low = np.where(above, low, middle)
    return np.asarray(low + (high - low) / 2)
