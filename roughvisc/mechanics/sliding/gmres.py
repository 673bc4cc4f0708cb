"""GMRES whose bits do not depend on the number of threads.

SciPy's GMRES takes its inner products from BLAS. OpenBLAS splits them between its threads from 10,000 numbers on: their
bits depend on the number of threads, which differs between this process and the workers of Dask, and on a busy machine
each of these short products waits for all threads. ``numpy.einsum`` calls no BLAS here.

References
----------
.. [1] Y. Saad, M. H. Schultz, SIAM J. Sci. Stat. Comput. 7 (1986) 856.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from roughvisc.mechanics.grid import namespace

Array = Any  # an array of NumPy or CuPy

# Vectors before a restart, and in total.
_RESTART, _MOST_VECTORS = 60, 300
# A vector is orthogonalised a second time if its length falls below this fraction of its projection.
_REPEATED = 0.1


def gmres(operator: Callable[[Array], Array], right: Array, enough: float) -> tuple[Array, int]:
    """Solve a linear system by restarted GMRES [1]_.

    Parameters
    ----------
    operator : callable
        Takes and returns an array of the shape of the right-hand side.
    right : array
        Right-hand side.
    enough : float
        Norm of the residual at which the iteration ends.

    Returns
    -------
    array
        The solution, or the last iterate after 300 vectors.
    int
        Number of vectors.
    """
    xp = namespace(right)
    solution, residual, count = xp.zeros_like(right), right, 0
    while True:
        norm = math.sqrt(float((residual**2).sum()))
        if norm <= enough or count >= _MOST_VECTORS:
            return solution, count
        basis = xp.empty((_RESTART + 1, right.size))
        basis[0] = residual.reshape(-1) / norm
        triangle, left = np.zeros((_RESTART + 1, _RESTART)), np.zeros(_RESTART + 1)
        left[0] = norm
        rotations: list[tuple[float, float]] = []
        for k in range(_RESTART):
            vector = operator(basis[k].reshape(right.shape)).reshape(-1)
            count += 1
            length = math.inf
            while True:  # Gram-Schmidt, twice if little is left
                along = xp.einsum("ki,i->k", basis[: k + 1], vector)
                vector -= xp.einsum("ki,k->i", basis[: k + 1], along)
                triangle[: k + 1, k] += along.tolist()  # on the host, like all of the small system
                before, length = length, math.sqrt(float(xp.einsum("i,i->", vector, vector)))
                if before < math.inf or length > _REPEATED * math.sqrt(float((along**2).sum())):
                    break
            for i, (cosine, sine) in enumerate(rotations):
                a, b = triangle[i, k], triangle[i + 1, k]
                triangle[i, k], triangle[i + 1, k] = cosine * a + sine * b, cosine * b - sine * a
            diagonal = math.hypot(triangle[k, k], length)
            rotations.append((triangle[k, k] / diagonal, length / diagonal))
            triangle[k, k] = diagonal
            left[k], left[k + 1] = rotations[k][0] * left[k], -rotations[k][1] * left[k]
            if abs(left[k + 1]) <= enough or count >= _MOST_VECTORS:
                break
            basis[k + 1] = vector / length
        weights = xp.asarray(np.linalg.solve(triangle[: k + 1, : k + 1], left[: k + 1]))
        solution += xp.einsum("ki,k->i", basis[: k + 1], weights).reshape(right.shape)
        if abs(left[k + 1]) <= enough or count >= _MOST_VECTORS:
            return solution, count
        residual = right - operator(solution)
