r"""Contact spots as one flat punch: the stiffness of a contact whose area is frozen, and so what flows through it.

A body of resistivity ``rho`` whose surface is at one potential ``V`` on the spots and insulated elsewhere carries the
current ``I = 2 k V / rho``, where ``F = E* k delta`` presses a flat punch of these spots: potential and displacement
are both ``1/(2 pi r)`` of what is put in, times ``rho`` and ``2 / E*`` [1]_. Two bodies in series conduct
``2 k / (rho_1 + rho_2)``.

The grid's part, as measured on discs, squares at any angle, strips and Hertz contacts:

1. Where a contact ends because the gap opens, counted cells take the spot for too large, and a punch of cells is too
   soft, as if it were smaller. The two cancel: the punch has the stiffness of the spot with the corrected area, and it
   is the slope of the grid's own force over its approach. Nothing is corrected there.
2. Where a contact ends with the material, the outline is known, and the punch is too soft to first order. It is solved
   again on cells of half the side, and extrapolated: by twice the difference for an outline along the cells, which
   the finer ones share, and by 1.2 times for an oblique one, whose staircase is not its outline: the spot meant is a
   smooth one of the same area. How many of the outline's faces belong to steps tells which it is.

.. [1] J. R. Barber, *Proc. R. Soc. A* 459 (2003) 53-66.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.body import HALF_SPACE, Kernel
from roughvisc.mechanics.contact import ContactState, solve_contact
from roughvisc.mechanics.contact.neighbours import neighbours
from roughvisc.mechanics.grid import Boundary, Grid

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Parts of the difference to cells of half the side: along the cells, oblique, and the share of faces in steps from
# which an outline counts as oblique (a disc has 0.59). Squares of 64 cells at 0 to 45 degrees: within 9e-4.
_ALONG, _OBLIQUE, _STEPS = 2.0, 1.2, 0.6
# Part of the same difference by which the extrapolated value may be off.
_OFF = 0.4
# Where the gap opens, each face of the outline lies somewhere in its cell: by so many cells it may be off in all, and
# three standard deviations of a face. Rough surfaces of 32 to 128 cells: within 0.6 of what that comes to.
_SHARED, _SCATTER = 0.03, 1.0
# Error of the pressure over the square root of the error of the stiffness, which is of second order.
_OF_PRESSURE = 0.1


@dataclass(frozen=True)
class FrozenContact:
    """A contact whose area does not change, as a punch.

    Attributes
    ----------
    stiffness : float
        Force over approach, over the contact modulus. A single disc has twice its radius; infinite where a uniform
        pressure displaces nothing and all is in contact. [m]
    error : float
        What the grid and the solver may have it off by. [m]
    iterations : int
        Of the contact solver.
    """

    stiffness: float
    error: float
    iterations: int = 0


def frozen_contact(
    contact: Mask,
    spacing: tuple[float, float],
    boundary: Boundary = "free",
    *,
    present: Mask | None = None,
    kernel: Kernel = HALF_SPACE,
    tolerance: float = 1e-6,
) -> FrozenContact:
    """Stiffness of a contact whose area is frozen.

    Parameters
    ----------
    contact : ndarray of bool, shape (nx, ny)
        Cells in contact.
    spacing : tuple of float
        Cell sides ``(dx, dy)``. [m]
    boundary : {"free", "periodic", "mirror"}
        With periodic or mirror boundaries the approach is that to the mean plane of a half-space, and the stiffness
        that of these cells.
    present : ndarray of bool, shape (nx, ny), optional
        Cells where there is material; None: all. Spots end for certain beside the others, and at the border of free
        space.
    kernel : Kernel
        Of the body.
    tolerance : float
        Part of the stiffness that the solver leaves, about.

    Returns
    -------
    FrozenContact
    """
    if not contact.any():
        return FrozenContact(0.0, 0.0)
    present = np.ones(contact.shape, dtype=bool) if present is None else present
    beyond: Any = {"free": "constant", "periodic": "wrap", "mirror": "symmetric"}[boundary]
    rimmed, rim = (np.pad(one, 1, mode=beyond) for one in (contact, present))
    if boundary == "free":  # nothing outside the spots matters
        x, y = _bounds(contact)
        around = slice(x.start, x.stop + 2), slice(y.start, y.stop + 2)
        contact, rimmed, rim = contact[x, y], rimmed[around], rim[around]
    body = Grid((contact.shape[0], contact.shape[1]), spacing, boundary, kernel=kernel)
    if contact.all() and not body.definite:
        return FrozenContact(math.inf, 0.0)
    punch = _punch(body, contact, tolerance)
    stiffness, off = _variational(punch, body.cell_area)
    ends, opens, scatter = _edge_energies(rimmed, rim, punch.pressure, spacing)
    images = math.prod(2 for axis in (0, 1) if np.array_equal(contact, np.flip(contact, axis)))  # their faces err alike
    error = off + _SHARED * opens + _SCATTER * math.sqrt(images) * scatter
    found = FrozenContact(stiffness, error, punch.iterations)
    if ends == 0:
        return found
    oblique = min(_staircase(rimmed) / _STEPS, 1.0)
    return _extrapolated(found, contact, body, tolerance, share=ends / (ends + opens), oblique=oblique)


def _extrapolated(
    coarse: FrozenContact, contact: Mask, body: Grid, tolerance: float, *, share: float, oblique: float
) -> FrozenContact:
    """With the part of the edge that is known for certain extrapolated from cells of half the side."""
    split = np.repeat(np.repeat(contact, 2, axis=0), 2, axis=1)
    finer = body.on((split.shape[0], split.shape[1]))
    punch = _punch(finer, split, tolerance)
    stiffness, off = _variational(punch, finer.cell_area)
    difference = share * max(stiffness - coarse.stiffness, 0.0)
    part = _OBLIQUE + (_ALONG - _OBLIQUE) * (1 - oblique) ** 2
    return FrozenContact(
        coarse.stiffness + part * difference,
        coarse.error + part * off + _OFF * difference,
        coarse.iterations + punch.iterations,
    )


def _punch(body: Grid, contact: Mask, tolerance: float) -> ContactState:
    return solve_contact(
        body, np.zeros(contact.shape), approach=1.0, present=contact, tolerance=_OF_PRESSURE * math.sqrt(tolerance)
    )


def _variational(punch: ContactState, cell: float) -> tuple[float, float]:
    """Stiffness from below, with an error of second order in that of the pressure, and a bound on what it lacks. [m]

    ``k = max 2 sum p - p.Kp``, and the duality gap is half of what is missing at most.
    """
    energy = float(np.sum(punch.pressure * punch.displacement))
    return cell * (2 * punch.load - energy), cell * energy * punch.bound**2


def _bounds(contact: Mask) -> tuple[slice, slice]:
    """The smallest rectangle of cells that holds the contact."""
    along = [np.flatnonzero(contact.any(axis=1 - axis)) for axis in (0, 1)]
    x, y = (slice(int(found[0]), int(found[-1]) + 1) for found in along)
    return x, y


def _edge_energies(
    contact: Mask, rim: Mask, pressure: Array, spacing: tuple[float, float]
) -> tuple[float, float, float]:
    """Stiffness over the distance, in cells, that an edge might move by: where the material ends, where the gap opens.

    The third is that of independent moves of the latter's faces, the root of their sum of squares.

    A punch gains ``K^2 ds / 2`` of stiffness for an edge that moves out by ``ds``, where ``K`` is the strength of the
    singularity there; the edge cell's pressure squared times the cell's side is in proportion to ``K^2``. [m]

    Parameters
    ----------
    contact, rim : ndarray of bool, shape (nx + 2, ny + 2)
        Cells in contact, and those with material, with one more on every side.
    pressure : ndarray, shape (nx, ny)
        Of the punch. [-]
    """
    ends = opens = squares = 0.0
    strips = [side * spacing[0] * spacing[1] for side in (spacing[0], spacing[0], spacing[1], spacing[1])]
    pairs = zip(neighbours(contact, "free"), neighbours(rim, "free"), strict=True)
    for strip, (touching, material) in zip(strips, pairs, strict=True):
        at_edge = (contact & ~touching)[1:-1, 1:-1]
        energy = strip * pressure**2
        open_faces = at_edge & material[1:-1, 1:-1]
        opens += float(np.sum(energy, where=open_faces))
        squares += float(np.sum(energy**2, where=open_faces))
        ends += float(np.sum(energy, where=at_edge & ~material[1:-1, 1:-1]))
    return ends, opens, math.sqrt(squares)


def _staircase(contact: Mask) -> float:
    """Share of an outline's faces that belong to steps, two for each inner corner; one more cell on every side."""
    faces = sum(int(np.count_nonzero((contact & ~seen)[1:-1, 1:-1])) for seen in neighbours(contact, "free"))
    around = contact[1:, 1:].astype(int) + contact[:-1, 1:] + contact[1:, :-1] + contact[:-1, :-1]
    return 2 * int(np.count_nonzero(around == 3)) / max(faces, 1)
