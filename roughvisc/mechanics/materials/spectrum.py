"""Positive retardation spectra on a lattice of times, by non-negative least squares."""

from __future__ import annotations

import numpy as np
import scipy  # which imports a submodule when it is first used: scipy.optimize takes 0.2 s
from numpy.typing import NDArray

Array = NDArray[np.float64]


#: Terms whose part of the target is below this in all rows are left out.
_UNSEEN = 1e-10
#: Number of rows above which they are first reduced to a triangular factor.
_MANY = 1000


def lattice(shortest: float, longest: float, per_decade: float) -> Array:
    """Return times from the shortest to the longest, evenly spaced in the logarithm. [s]"""
    count = max(2, int(np.ceil(per_decade * np.log10(longest / shortest))) + 1) if longest > shortest else 1
    return np.geomspace(shortest, longest, count)


def nonnegative(columns: Array, target: Array, scale: Array) -> Array:
    """Return non-negative weights of columns, mostly zeros, whose weighted sum fits a target in least squares.

    Parameters
    ----------
    columns : ndarray, shape (rows, terms)
        Columns to combine.
    target : ndarray, shape (rows,)
        Target of the sum.
    scale : ndarray, shape (rows,)
        Positive scale of the misfit of each row.
    """
    scaled = columns / scale[:, None]
    norms = np.sqrt(np.sum(scaled**2, axis=0))
    norms[norms == 0] = 1.0
    matrix, wanted = scaled / norms, target / scale
    if wanted.size > _MANY:  # the triangular factor has the same squared misfit up to a constant
        factor: Array = np.asarray(np.linalg.qr(np.column_stack([matrix, wanted]), mode="r"))
        matrix, wanted = factor[:, :-1], factor[:, -1]
    weights, _ = scipy.optimize.nnls(matrix, wanted, maxiter=50 * columns.shape[1])
    seen = np.abs(scaled / norms).max(axis=0) * weights
    return np.where(seen > _UNSEEN, weights / norms, 0.0)
