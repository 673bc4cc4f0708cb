"""Roots of the secular equation: exact interconversion of creep and relaxation series."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import scipy  # which imports a submodule when it is first used: scipy.optimize takes 0.2 s
from numpy.typing import NDArray

Array = NDArray[np.float64]


def merged(weights: Sequence[float], times: Sequence[float]) -> tuple[Array, Array]:
    """Return positive weights and rates ``1/time``, with ascending rates and equal rates merged."""
    sums: dict[float, float] = {}
    for weight, time in zip(weights, times, strict=True):
        if weight > 0:
            sums[1 / time] = sums.get(1 / time, 0.0) + weight
    rates = np.array(sorted(sums))
    return np.array([sums[rate] for rate in rates]), rates


def secular_roots(strengths: Array, poles: Array, constant: float) -> list[tuple[float, Array]]:
    """Return the zeros of ``constant + sum strengths / (poles - mu)``, each with its offsets ``poles - mu``.

    One zero lies between each two poles, and one above the last pole if ``constant > 0``.

    Each zero is computed as an offset from the nearer of its two poles, on a logarithmic scale, so that the offset of a
    zero close to a pole is accurate. The equivalent eigenproblem loses the slow modes over many decades of rates (24
    decades: a negative eigenvalue).
    """

    def value(offset: float, origin: float) -> tuple[float, Array]:
        offsets = (poles - origin) - offset
        return constant + float(np.sum(strengths / offsets)), offsets

    roots = []
    for i, pole in enumerate(poles):
        if i + 1 < len(poles):
            half = float(poles[i + 1] - pole) / 2
            from_below = value(half, pole)[0] > 0
            origin, sign = (float(pole), 1.0) if from_below else (float(poles[i + 1]), -1.0)
        elif constant > 0:
            origin, sign, half = float(pole), 1.0, float(np.sum(strengths)) / constant
        else:
            break
        offset = sign * _log_bracketed(lambda d, o=origin, s=sign: s * value(s * d, o)[0], half)  # type: ignore[misc]
        # the logarithm leaves an error of some 30 eps in the offset; a Newton step removes it
        found, offsets = value(offset, origin)
        step = found / float(np.sum(strengths / offsets**2))
        if abs(step) < 1e-9 * abs(offset):
            offset -= step
        roots.append((origin + offset, value(offset, origin)[1]))
    return roots


def _log_bracketed(function: Callable[[float], float], upper: float) -> float:
    """Return the zero of a function that rises from -inf at 0+ to at least 0 at ``upper``, found in log scale."""
    if function(upper) <= 0:
        return upper
    lower = upper
    while function(lower) > 0:
        lower *= 1e-3
        if lower < 1e-300:
            return lower
    # slightly wider, so that rounding of the logarithm cannot exclude a zero at an end of the bracket
    low, high = math.log(lower) - 1e-9, math.log(min(upper, lower * 1e3)) + 1e-9
    return math.exp(scipy.optimize.brentq(lambda y: function(math.exp(y)), low, high, xtol=1e-15))
