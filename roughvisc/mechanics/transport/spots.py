r"""Stiffness of a contact at constant area, as one flat punch; it gives the conductance of the contact.

A body of resistivity ``rho`` whose surface is at one potential ``V`` on the spots and insulated elsewhere carries the
current ``I = 2 k V / rho``, where ``k`` is the stiffness ``F = E* k delta`` of a flat punch with the outline of the
spots. The Green's function of both problems is ``1/(2 pi r)``, times ``rho`` for the potential and ``2 / E*`` for the
displacement [1]_. Two bodies in series conduct ``2 k / (rho_1 + rho_2)``.

Grid error, measured on discs, squares at any angle, strips and Hertz contacts:

1. At an edge where the gap opens, counting cells overestimates the spot, and a punch of cells is too soft. The two
   errors cancel: the punch has the stiffness of the spot with the corrected area, and it is the derivative of force by
   approach on the same grid. A correction is not needed.
2. At an edge of the material the outline is known, and the punch is too soft to first order. The problem is solved
   again on cells of half the side, and the stiffness is extrapolated: by twice the difference for an outline along the
   cells, and by 1.2 times the difference for an oblique outline, whose cells form a staircase around it. The share of
   faces that belong to steps distinguishes the two.

.. [1] J. R. Barber, *Proc. R. Soc. A* 459 (2003) 53-66.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from roughvisc.mechanics.contact import solve_contact
from roughvisc.mechanics.contact.solver import neighbours
from roughvisc.mechanics.grid import Boundary, Grid

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Factors of the difference to cells of half the side: along the cells, oblique, and the share of faces in steps from
# which an outline counts as oblique (a disc has 0.59). Squares of 64 cells at 0 to 45 degrees: within 9e-4.
_ALONG, _OBLIQUE, _STEPS = 2.0, 1.2, 0.6
# Error of the extrapolated value over the same difference.
_OFF = 0.4
# Error of the position of an edge where the gap opens, in cells: the error common to all faces, and three standard
# deviations of one face, since the edge lies anywhere in its cell. Rough surfaces of 32 to 128 cells: within 0.6 of the
# estimate.
_SHARED, _SCATTER = 0.03, 1.0
# Error of the pressure over the square root of the error of the stiffness, which is of second order.
_OF_PRESSURE = 0.1


def frozen_contact(
    contact: Mask,
    spacing: tuple[float, float],
    boundary: Boundary = "free",
    *,
    present: Mask | None = None,
    tolerance: float = 1e-6,
) -> tuple[float, float]:
    """Return the stiffness of a contact at constant area, and its error.

    Parameters
    ----------
    contact : ndarray of bool, shape (nx, ny)
        Cells in contact.
    spacing : tuple of float
        Cell sides ``(dx, dy)``. [m]
    boundary : {"free", "periodic", "mirror"}
        With periodic or mirror boundaries the approach is measured to the mean plane of a half-space, and the stiffness
        refers to one period, or to the map.
    present : ndarray of bool, shape (nx, ny), optional
        Cells with material; None: all. The outline of a spot is known exactly next to absent cells and at the border of
        free space.
    tolerance : float
        Approximate relative error of the stiffness due to the solver.

    Returns
    -------
    stiffness : float
        Force over approach, over the contact modulus; for a disc twice the radius. Infinite in full contact
        unless space is free. [m]
    error : float
        Error of the stiffness due to grid and solver. [m]
    """
    if not contact.any():
        return 0.0, 0.0
    if contact.all() and boundary != "free":
        return math.inf, 0.0
    present = np.ones(contact.shape, dtype=bool) if present is None else present
    beyond: Any = {"free": "constant", "periodic": "wrap", "mirror": "symmetric"}[boundary]
    rimmed, rim = (np.pad(one, 1, mode=beyond) for one in (contact, present))
    if boundary == "free":  # the surface outside the spots has no influence
        [(x, y)] = ndimage.find_objects(contact.astype(np.int8))
        around = slice(x.start, x.stop + 2), slice(y.start, y.stop + 2)
        contact, rimmed, rim = contact[x, y], rimmed[around], rim[around]
    stiffness, off, pressure = _punch(contact, spacing, boundary, tolerance)
    ends, opens, scatter = _edge_energies(rimmed, rim, pressure, spacing)
    images = math.prod(
        2 for axis in (0, 1) if np.array_equal(contact, np.flip(contact, axis))
    )  # their faces have equal errors
    error = off + _SHARED * opens + _SCATTER * math.sqrt(images) * scatter
    if ends == 0:
        return stiffness, error
    split = np.repeat(np.repeat(contact, 2, axis=0), 2, axis=1)  # edges of the material: cells of half the side
    finer, off, _ = _punch(split, (spacing[0] / 2, spacing[1] / 2), boundary, tolerance)
    difference = ends / (ends + opens) * max(finer - stiffness, 0.0)
    oblique = min(_staircase(rimmed) / _STEPS, 1.0)
    part = _OBLIQUE + (_ALONG - _OBLIQUE) * (1 - oblique) ** 2
    return stiffness + part * difference, error + part * off + _OFF * difference


def _punch(
    contact: Mask, spacing: tuple[float, float], boundary: Boundary, tolerance: float
) -> tuple[float, float, Array]:
    """Return a lower bound of the stiffness, a bound on its error [m], and the pressure of the punch.

    ``k = max 2 sum p - p.Kp`` has an error of second order in the pressure, at most twice the duality gap.
    """
    body = Grid((contact.shape[0], contact.shape[1]), spacing, boundary)
    nearness = _OF_PRESSURE * math.sqrt(tolerance)
    punch = solve_contact(body, np.zeros(contact.shape), approach=1.0, present=contact, tolerance=nearness)
    energy = float(np.sum(punch.pressure * punch.displacement))
    stiffness = body.cell_area * (2 * punch.load - energy)
    return stiffness, body.cell_area * energy * punch.bound**2, punch.pressure


def _edge_energies(
    contact: Mask, rim: Mask, pressure: Array, spacing: tuple[float, float]
) -> tuple[float, float, float]:
    """Return the change of the stiffness if the edge of the contact moves by one cell. [m]

    The first number is for edges of the material, the second for edges where the gap opens. The third is for edges
    where the gap opens whose faces move independently: the root of the sum of squares.

    If an edge moves out by ``ds``, the stiffness grows by ``K^2 ds / 2`` with the strength ``K`` of the singularity.
    The squared pressure of the edge cell times the cell side is in proportion to ``K^2``.

    Parameters
    ----------
    contact, rim : ndarray of bool, shape (nx + 2, ny + 2)
        Contact cells, and cells with material, with a rim of one cell.
    pressure : ndarray, shape (nx, ny)
        Pressure of the punch. [-]
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
    """Return the share of the faces of the outline in steps, two per inner corner; the map has a rim of one cell."""
    faces = sum(int(np.count_nonzero((contact & ~seen)[1:-1, 1:-1])) for seen in neighbours(contact, "free"))
    around = contact[1:, 1:].astype(int) + contact[:-1, 1:] + contact[1:, :-1] + contact[:-1, :-1]
    return 2 * int(np.count_nonzero(around == 3)) / max(faces, 1)
