"""Positive retardation spectra on a lattice of times, by non-negative least squares."""

from __future__ import annotations

import numpy as np
import scipy  # which imports a submodule when it is first used: scipy.optimize takes 0.2 s
from numpy.typing import NDArray

Array = NDArray[np.float64]


#: a term that nowhere makes up more of the target than this is left out
_UNSEEN = 1e-10


def lattice(shortest: float, longest: float, per_decade: float) -> Array:
    """Times from the shortest to the longest, evenly spaced in the logarithm. [s]"""
    count = max(2, int(np.ceil(per_decade * np.log10(longest / shortest))) + 1) if longest > shortest else 1
    return np.geomspace(shortest, longest, count)


def nonnegative(columns: Array, target: Array, scale: Array) -> Array:
    """Non-negative weights of the columns whose sum comes nearest to the target, in least squares; mostly zeros.

    Parameters
    ----------
    columns : ndarray, shape (rows, terms)
    target : ndarray, shape (rows,)
    scale : ndarray, shape (rows,)
        Positive: what the misfit of a row counts relative to.
    """
    scaled = columns / scale[:, None]
    norms = np.sqrt(np.sum(scaled**2, axis=0))
    norms[norms == 0] = 1.0
    weights, _ = scipy.optimize.nnls(scaled / norms, target / scale, maxiter=50 * columns.shape[1])
    seen = np.abs(scaled / norms).max(axis=0) * weights
    return np.where(seen > _UNSEEN, weights / norms, 0.0)
