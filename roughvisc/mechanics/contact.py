r"""The instantaneous contact state: an elastic contact problem under given load or given approach.

Minimise ``f(p) = p.Kp/2 + g.p`` over ``p >= 0`` (and ``sum p`` given, under load), where ``g`` is the gap that the
surfaces would have without pressure. This module knows nothing of time or material: pressure here is divided by the
contact modulus, and a memory of the past is part of ``g``.

The method is that of constrained conjugate gradients on an evolving contact area [1]_, with these changes:

1. Preconditioned by the inverse of the periodic kernel, and conjugated to the step really taken (Hestenes-Stiefel),
   also when that step was cut by the contact's border, instead of restarting whenever the area changes.
2. One convolution an iteration: the step is first cut at zero pressure, then its convolution gives both the exact
   minimum along it and the new displacement. Printed algorithms spend one convolution on the step length and
   another on the cut pressure.
3. Every step descends, and a projected-gradient step is taken wherever progress stalls (a spacer step), so that
   convergence is proven. No normal run needs it.
4. Stopped on the duality gap, a bound on the error that costs nothing, not on the stagnation of the pressure.

.. [1] I. A. Polonsky, L. M. Keer, Wear 231 (1999) 206.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.halfspace import HalfSpace

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Iterations in which the gap must halve; otherwise a projected-gradient step is taken.
_PATIENCE = 30
# The step length may grow by this factor where the last step ended at the border of the feasible set.
_GROWTH = 1.3
_EPSILON = float(np.finfo(float).eps)


@dataclass(frozen=True)
class ContactState:
    """A solved contact problem.

    Attributes
    ----------
    pressure : ndarray, shape (nx, ny)
        Pressure over the contact modulus, zero outside the contact. [-]
    displacement : ndarray, shape (nx, ny)
        Displacement due to this pressure. [m]
    approach : float
        Rigid-body approach ``omega``: the gap is ``g + displacement - omega``. [m]
    load : float
        Sum of the pressure over the cells. [-]
    bound : float
        Bound on the relative error of the pressure in the energy norm, ``sqrt(2 gap / p.Kp)``.
    converged : bool
        Whether the relative duality gap is below the tolerance.
    iterations, convolutions : int
        Cost; a convolution is a displacement or an application of the preconditioner.
    """

    pressure: Array
    displacement: Array
    approach: float
    load: float
    bound: float
    converged: bool
    iterations: int
    convolutions: int


def solve_contact(
    halfspace: HalfSpace,
    gap: Array,
    *,
    load: float | None = None,
    approach: float | None = None,
    tolerance: float = 1e-8,
    start: Array | None = None,
    present: Mask | None = None,
    max_iterations: int = 1000,
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
        On the relative duality gap, ``gap / p.Kp``; the square of the relative error in the energy norm.
    start : ndarray, shape (nx, ny), optional
        First guess of the pressure; negative values count as zero. [-]
    present : ndarray of bool, shape (nx, ny), optional
        Cells where there is material; None: all.
    max_iterations : int
        The state reached by then is returned as not converged.

    Returns
    -------
    ContactState
    """
    if (load is None) == (approach is None):
        raise ValueError("give either a load or an approach")
    if present is not None and present.all():
        present = None
    problem = _Problem(halfspace, gap, load, approach, tolerance, present)
    return problem.solve(start, max_iterations)


class _Problem:
    """One contact problem in scaled variables, and the vectors that every iteration needs."""

    def __init__(
        self,
        halfspace: HalfSpace,
        gap: Array,
        load: float | None,
        approach: float | None,
        tolerance: float,
        present: Mask | None,
    ) -> None:
        self.halfspace = halfspace
        self.present = present
        self.tolerance = tolerance
        self.lowest = float(np.min(gap if present is None else gap[present]))
        # Scaled so that neither a load of 1e-300 nor its square is lost: lengths in `length`, pressures in `unit`.
        if load is not None:
            self.unit = load
            self.length = load * halfspace.self_influence or load * halfspace.spacing[0]
        else:
            assert approach is not None
            self.length = approach - self.lowest
            self.unit = self.length / (halfspace.self_influence or halfspace.spacing[0])
        self.scale = self.unit / self.length
        self.load = None if load is None else load / self.unit
        self.target = math.nan if approach is None else 1.0  # approach above the lowest point
        self.gap = gap - self.lowest
        self.gap /= self.length
        self.convolutions = 0

    def solve(self, start: Array | None, max_iterations: int) -> ContactState:
        """Safeguarded, preconditioned conjugate gradients; see the module's notes."""
        pressure = self.feasible(start)
        displacement = self.displacement(pressure)
        direction: Array | None = None  # the last step and what it changed, for conjugation
        change = self.gap
        curvature = 0.0
        length = 1 / self.scale  # the preconditioner is the inverse up to boundaries and the contact's outline
        best, since = math.inf, 0
        spacer = False
        for iteration in range(max_iterations + 1):
            total = self.gap + displacement
            contact = pressure > 0
            duality_gap, energy = self.duality_gap(pressure, displacement, total)
            floor = 8 * _EPSILON * float(np.sum(pressure)) * float(np.max(np.abs(total[contact]), initial=1.0))
            converged = duality_gap <= self.tolerance * energy + floor
            if converged or iteration == max_iterations:
                break
            best, since = (duality_gap, 0) if duality_gap < best / 2 else (best, since + 1)

            face, level = self.face(contact, total)
            residual = np.where(face, total - level, 0.0)
            if since >= _PATIENCE:
                spacer, since, best = True, 0, duality_gap
            if spacer:
                trial = self.projected_gradient(pressure, total)
            else:
                search = self.precondition(residual, face)
                if direction is not None:
                    beta = float(np.sum(search * change)) / curvature
                    if beta > 0:
                        conjugate = search + beta * self.tangent(direction, face)
                        if float(np.sum(residual * conjugate)) > 0:
                            search = conjugate
                trial = self.cut(pressure - length * search)
            step = trial - pressure
            slope = float(np.sum(step * (total - level)))  # the step keeps a given load: `level` only saves digits
            if not slope < 0:  # no descent: forget the history, then the preconditioner too
                if spacer:
                    break  # the projected gradient does not descend either: this is the minimum, to rounding
                spacer, direction, length = direction is None, None, 1 / self.scale
                continue
            change = self.displacement(trial) - displacement
            curvature = float(np.sum(step * change))
            best_fraction = -slope / curvature if curvature > 0 else math.inf
            fraction, cut = self.fraction(pressure, step, best_fraction)
            pressure = trial if fraction == 1 else np.maximum(pressure + fraction * step, 0)
            displacement = displacement + fraction * change
            if spacer:
                spacer, direction = False, None
            else:
                direction = -step
                length *= min(max(best_fraction, 0.3), _GROWTH if cut else 3.0)
        return self.state(pressure, displacement, total, duality_gap, energy, converged, iteration)

    def feasible(self, start: Array | None) -> Array:
        if start is None or not np.any(start > 0):
            pressure = np.ones(self.halfspace.shape)
            if self.load is None:
                pressure = np.where(self.gap < self.target, self.target - self.gap, 0.0)
        else:
            pressure = np.maximum(start, 0) / self.unit
        if self.present is not None:
            pressure = np.where(self.present, pressure, 0.0)
        if self.load is not None:
            pressure *= self.load / float(np.sum(pressure))
        return pressure

    def displacement(self, pressure: Array) -> Array:
        self.convolutions += 1
        displacement = self.halfspace.displacement(pressure)
        displacement *= self.scale
        return displacement

    def duality_gap(self, pressure: Array, displacement: Array, total: Array) -> tuple[float, float]:
        """Bound on ``f(p) - min f``, and ``p.Kp``."""
        energy = float(np.sum(pressure * displacement))
        lowest = float(np.min(total if self.present is None else total[self.present]))
        if self.load is not None:
            return float(np.sum(pressure * (total - lowest))), energy
        excess = float(np.sum(pressure * (total - self.target)))
        missing = max(0.0, self.target - lowest)
        if self.halfspace.boundary == "free":
            # a dual feasible point from q >= 0 with Kq >= 1: here q is uniform
            uniform, response = self.uniform
            gap = excess + missing * uniform * float(np.sum(displacement))
            return gap + 0.5 * missing**2 * uniform**2 * response, energy
        # The periodic kernel is singular, no such q exists. The pressure is certified under its own load, and its
        # own approach must be the one asked for.
        load = float(np.sum(pressure))
        if load == 0:
            return math.inf, energy
        own_gap = float(np.sum(pressure * (total - lowest)))
        mismatch = abs(excess) + load * missing
        return max(own_gap, mismatch), energy

    @property
    def uniform(self) -> tuple[float, float]:
        """Uniform pressure that displaces every present cell by at least one length, and its total displacement."""
        if not hasattr(self, "_uniform"):
            ones = np.ones(self.halfspace.shape) if self.present is None else self.present.astype(float)
            response = self.displacement(ones)
            inside = response if self.present is None else response[self.present]
            self._uniform = (1 / float(np.min(inside)), float(np.sum(inside)))
        return self._uniform

    def face(self, contact: Mask, total: Array) -> tuple[Mask, float]:
        """Cells that may change pressure, and the level that ``total`` has on them at the solution."""
        level = self.target if self.load is None else float(np.mean(total[contact]))
        face = contact | (total < level)
        if self.present is not None:
            face &= self.present
        return face, level if self.load is None else float(np.mean(total[face]))

    def tangent(self, field: Array, face: Mask) -> Array:
        """Part of a field that keeps the cells outside the face, and the load where it is given."""
        if self.load is None:
            return np.where(face, field, 0.0)
        return np.where(face, field - float(np.sum(field, where=face)) / np.count_nonzero(face), 0.0)

    def precondition(self, residual: Array, face: Mask) -> Array:
        self.convolutions += 1
        return self.tangent(self.halfspace.approximate_inverse(residual), face)

    def cut(self, pressure: Array) -> Array:
        """Nearest admissible pressure in the manner of Polonsky and Keer: cut at zero, then scaled to the load."""
        pressure = np.maximum(pressure, 0)
        if self.load is not None:
            pressure *= self.load / float(np.sum(pressure))
        return pressure

    def projected_gradient(self, pressure: Array, total: Array) -> Array:
        stiffest = self.halfspace.largest_influence * self.scale
        moved = pressure - (total - (self.target if self.load is None else 0.0)) / stiffest
        if self.present is not None:
            moved = np.where(self.present, moved, -math.inf)
        return np.maximum(moved, 0) if self.load is None else _onto_simplex(moved, self.load)

    @staticmethod
    def fraction(pressure: Array, step: Array, best: float) -> tuple[float, bool]:
        """Fraction of the step to take, and whether the border of the feasible set cut it."""
        falling = step < 0
        limit = float(np.min(pressure[falling] / -step[falling], initial=math.inf))
        if limit <= 1 and best > 0.5:
            return 1.0, best > 1  # whole: cells leave the contact, and f falls for any best fraction above a half
        return min(best, limit), best > limit

    def state(
        self,
        pressure: Array,
        displacement: Array,
        total: Array,
        duality_gap: float,
        energy: float,
        converged: bool,
        iterations: int,
    ) -> ContactState:
        load = float(np.sum(pressure))
        approach = self.target
        if self.load is not None:  # weighted by pressure: its error is of second order
            approach = float(np.sum(pressure * total)) / load
        bound = math.sqrt(2 * max(duality_gap, 0.0) / energy) if energy > 0 else 0.0
        return ContactState(
            pressure=pressure * self.unit,
            displacement=displacement * self.length,
            approach=approach * self.length + self.lowest,
            load=load * self.unit,
            bound=bound,
            converged=converged,
            iterations=iterations,
            convolutions=self.convolutions,
        )


def _onto_simplex(values: Array, total: float) -> Array:
    """Nearest non-negative array of given sum."""
    largest = float(np.max(values))
    shifted = values - largest  # a small sum is lost beside large values otherwise
    ordered = np.sort(shifted, axis=None)[::-1]
    excess = (np.cumsum(ordered) - total) / np.arange(1, ordered.size + 1)
    last = int(np.count_nonzero(ordered > excess)) - 1
    return np.maximum(shifted - excess[last], 0)
