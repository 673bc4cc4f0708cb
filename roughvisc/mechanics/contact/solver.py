"""Public entry of the contact solver: half-space, gap and load or approach in, contact state out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.bodies.operator import HalfSpace
from roughvisc.mechanics.contact.iteration import pcg
from roughvisc.mechanics.contact.problem import Array, Problem
from roughvisc.mechanics.contact.state import ContactState
from roughvisc.mechanics.fields import passes
from roughvisc.mechanics.fields.reuse import empty, reused
from roughvisc.mechanics.fields.threads import blocks, parallel_map

# A cold start on so many cells a side is guessed on a grid of half as many, which is guessed in the same way.
# Measured with 5 to 95 % in contact and on spheres: 0.8 to 0.9 of the time at 256 squared, 0.7 to 0.8 at 1024.
_COARSE_FROM = 256
# Tolerance of the guess: what the coarse grid leaves out is more.
_COARSE_TOLERANCE = 0.03
# Rows of a grid that are averaged or spread at a time.
_ROWS = 8


def solve_contact(
    halfspace: HalfSpace,
    gap: Array,
    *,
    load: float | None = None,
    approach: float | None = None,
    tolerance: float = 1e-8,
    start: Array | None = None,
    start_displacement: Array | None = None,
    present: NDArray[np.bool_] | None = None,
    max_iterations: int = 1000,
    overwrite: bool = False,
    estimate_error: bool = False,
    error_tolerance: float | None = None,
) -> ContactState:
    """Contact state under given load or given approach.

    Parameters
    ----------
    halfspace : HalfSpace
        Grid and boundary.
    gap : ndarray, shape (nx, ny)
        Gap without pressure at zero approach; ignored at absent cells. [m]
    load : float, optional
        Sum of the pressure over the cells, positive. [-]
    approach : float, optional
        Rigid-body approach; this or the load is given. [m]
    tolerance : float
        On the relative duality gap, ``G / p.Kp``; the square of the relative error in the energy norm. Near full
        contact under given approach 10 times it is the largest relative error of the load.
    start : ndarray, shape (nx, ny), optional
        First guess of the pressure; negative values count as zero. [-]
    start_displacement : ndarray, shape (nx, ny), optional
        Displacement due to `start`, where that is known and nowhere negative or absent: saves a convolution. [m]
    present : ndarray of bool, shape (nx, ny), optional
        Cells where there is material; None: all.
    max_iterations : int
        The state reached by then is returned as not converged.
    overwrite : bool
        Whether `gap`, `start` and `start_displacement` may be used up, which spares copies of them.
    estimate_error : bool
        Whether to estimate the error of the pressure. It costs nothing, but an application of the preconditioner where
        the first guess was good enough, in full contact, and under given approach with periodic boundaries.
    error_tolerance : float, optional
        On the estimated error of the pressure. The state counts as converged where that is met, and the relative
        duality gap is within 10 times its tolerance; in full contact, and under given approach, with periodic
        boundaries by the duality gap alone.

    Returns
    -------
    ContactState

    Raises
    ------
    ValueError
        If neither a load nor an approach is given, or both are.
    """
    if (load is None) == (approach is None):
        raise ValueError("give either a load or an approach")
    if present is not None and present.all():
        present = None
    if not overwrite:
        gap = np.array(gap, dtype=float, order="C")
        start = None if start is None else np.array(start, dtype=float, order="C")
        start_displacement = (
            None if start_displacement is None else np.array(start_displacement, dtype=float, order="C")
        )
    with reused():
        if load is not None and present is None and (start is None or not passes.any_positive(start)):
            start, start_displacement = coarse_guess(halfspace, gap, load), None
        problem = Problem.scaled(halfspace, gap, load=load, approach=approach, tolerance=tolerance, present=present)
        return pcg(
            problem,
            start,
            start_displacement,
            max_iterations=max_iterations,
            estimate_error=estimate_error,
            error_tolerance=error_tolerance,
        )


def coarse_guess(halfspace: HalfSpace, gap: Array, load: float) -> Array | None:
    """First guess of the pressure under a load, constant over two by two cells; None where that does not pay. [-]"""
    if min(gap.shape) < _COARSE_FROM:
        return None
    coarse = halfspace.on((gap.shape[0] // 2, gap.shape[1] // 2))
    few = _averaged(gap, coarse.shape, halfspace.threads)
    load *= few.size / gap.size
    with reused(apart=True):  # none of its fields is as large as those to come
        found = solve_contact(coarse, few, load=load, tolerance=_COARSE_TOLERANCE, overwrite=True).pressure
    return _spread(found, gap.shape, halfspace.threads)


def _averaged(field: Array, shape: tuple[int, int], threads: int) -> Array:
    """Means over two by two cells; of an odd number, one row or column is left out."""
    rows, columns = (-(-np.arange(m) * n // m) for n, m in zip(field.shape, shape, strict=True))
    found = np.empty(shape)

    def work(part: slice) -> None:
        here = field.take(rows[part], axis=0)
        here += field.take(rows[part] + 1, axis=0)
        here *= 0.25
        np.add(here.take(columns, axis=1), here.take(columns + 1, axis=1), out=found[part])

    parallel_map(work, list(blocks(shape[0], _ROWS)), threads)
    return found


def _spread(values: Array, shape: tuple[int, ...], threads: int) -> Array:
    """The same values on a finer grid."""
    rows, columns = (np.arange(n) * m // n for n, m in zip(shape, values.shape, strict=True))
    found = empty(shape)

    def work(part: slice) -> None:
        found[part] = values.take(rows[part], axis=0).take(columns, axis=1)

    parallel_map(work, list(blocks(shape[0], _ROWS)), threads)
    return found
