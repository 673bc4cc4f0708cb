"""A first guess of the pressure from a coarser grid."""

from __future__ import annotations

import numpy as np

from roughvisc.mechanics.contact.iteration import solved
from roughvisc.mechanics.contact.problem import Array, Problem
from roughvisc.mechanics.halfspace.operator import HalfSpace

# A cold start on so many cells a side is guessed on every so-many-eth cell, and taken from there if no more than this
# part of them is in contact. Measured at 256 to 512 squared, 5 % in contact: 0.6 of the time; at 30 and 95 % the guess
# saves no iteration, and costs 5 % of the time.
_COARSE_FROM, _STRIDE, _SPARSE = 256, 8, 0.25
# Tolerance of the guess: what the coarse grid leaves out is more. Measured at 256 squared, 4 % in contact:
# 10 to 12 iterations follow with any from 0.001 to 0.3.
_TOLERANCE = 0.03
# As many as whoever asks for a solution gets unless told otherwise.
_MAX_ITERATIONS = 1000


def coarse_guess(halfspace: HalfSpace, gap: Array, load: float) -> Array | None:
    """First guess of the pressure under a load, constant over blocks of cells; None where that does not pay. [-]"""
    if min(gap.shape) < _COARSE_FROM:
        return None
    few = np.array(gap[_STRIDE // 2 :: _STRIDE, _STRIDE // 2 :: _STRIDE])
    spacing = (_STRIDE * halfspace.spacing[0], _STRIDE * halfspace.spacing[1])
    coarse = halfspace.on((few.shape[0], few.shape[1]), spacing)
    start = coarse_guess(coarse, few, load / _STRIDE**2)
    problem = Problem.scaled(coarse, few, load=load / _STRIDE**2, approach=None, tolerance=_TOLERANCE, present=None)
    found = solved(problem, start, None, max_iterations=_MAX_ITERATIONS, estimate_error=False).pressure
    if np.count_nonzero(found) > _SPARSE * found.size:
        return None
    cells = [np.minimum(np.arange(n) // _STRIDE, m - 1) for n, m in zip(gap.shape, few.shape, strict=True)]
    return found[np.ix_(*cells)]
