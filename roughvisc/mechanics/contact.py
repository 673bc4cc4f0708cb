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
4. Stopped on the duality gap, a bound on the error that costs nothing, not on the stagnation of the pressure. Under
   given approach and periodic boundaries that norm does not see the mean pressure, since a uniform pressure displaces
   nothing: there the load must be certain, too.
5. Without a first guess, a sparse contact is found on every eighth cell first.
6. Far from the solution, steps are convolved in single precision and added to the displacement in double. What that
   leaves is 1e-7 of the steps and not of the displacement; before the solution is accepted, its displacement is
   computed anew in double precision, and judged.

.. [1] I. A. Polonsky, L. M. Keer, Wear 231 (1999) 206.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.halfspace.operator import HalfSpace

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Cells = NDArray[np.intp]

# Iterations in which the gap must halve; otherwise a projected-gradient step is taken.
_PATIENCE = 30
# The step length may grow by this factor where the last step ended at the border of the feasible set.
_GROWTH = 1.3
# No step goes farther than this many times its trial: along a uniform pressure the periodic kernel has no curvature.
_FARTHEST = 30.0
# A cold start on so many cells a side is guessed on every so-many-eth cell, and taken from there if no more than this
# part of them is in contact. Measured at 256 to 512 squared, 5 % in contact: 0.6 of the time; at 30 and 95 % the guess
# saves no iteration, and costs 5 % of the time.
_COARSE_FROM, _STRIDE, _SPARSE = 256, 8, 0.25
# Steps are convolved in single precision on so many cells, from so many times the tolerance: some four steps pay for
# the convolution in double precision that follows them (measured: 0.6 of the time of one in double).
_SINGLE_FROM, _FAR = 96**2, 30.0
# Under given approach and periodic boundaries the load is wrong by no more than this many times the tolerance.
# Measured: below 98 % of contact the duality gap makes it less, so that no iteration is added.
_LOAD_ERROR = 10.0
# ... and by this in any case: what rounding of the gap leaves.
_ROUNDED = 1e-10
# So near full contact, in parts of the approach, a load that leaves no gap at all is cut at once: measured at 64
# squared, 7 iterations instead of 346.
_NEARLY_FULL = 1e-3
# Error of a first guess that is good enough, over its relative duality gap: 1 in the median, 7 in one of fifty.
_UNIMPROVED = 3.5
# Safety factor of the estimated error elsewhere: without it, one estimate in fifty is below 0.8 of the true error.
_CAUTION = 1.25
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
        Whether the relative duality gap is below the tolerance; under given approach with periodic boundaries, also
        whether the load is within 10 times the tolerance.
    iterations, convolutions : int
        Cost; a convolution is a displacement or an application of the preconditioner.
    error : float
        Estimated relative error of the pressure, ``sum |p - p*| / sum p*`` with the exact ``p*`` on this grid; NaN
        unless asked for, infinite where the approach does not determine the load. Measured on 4,173 solutions
        (``workflows/benchmarks/solver_error.py``): at least 0.8 times the true error in 98 % of them, 2.4 times in
        the median, 8.3 times at the 98th percentile; `bound` is 160 times it in the median.
    """

    pressure: Array
    displacement: Array
    approach: float
    load: float
    bound: float
    converged: bool
    iterations: int
    convolutions: int
    error: float = math.nan


def solve_contact(
    halfspace: HalfSpace,
    gap: Array,
    *,
    load: float | None = None,
    approach: float | None = None,
    tolerance: float = 1e-8,
    start: Array | None = None,
    start_displacement: Array | None = None,
    present: Mask | None = None,
    max_iterations: int = 1000,
    overwrite: bool = False,
    estimate_error: bool = False,
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
        On the relative duality gap, ``gap / p.Kp``; the square of the relative error in the energy norm. Near full
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
        Whether to estimate the error of the pressure. It costs nothing, but under given approach with periodic
        boundaries two applications of the preconditioner.

    Returns
    -------
    ContactState
    """
    if (load is None) == (approach is None):
        raise ValueError("give either a load or an approach")
    if present is not None and present.all():
        present = None
    if not overwrite:
        gap = np.array(gap, dtype=float)
        start = None if start is None else np.array(start, dtype=float)
        start_displacement = None if start_displacement is None else np.array(start_displacement, dtype=float)
    if load is not None and present is None and (start is None or not np.any(start > 0)):
        start, start_displacement = _guessed(halfspace, gap, load), None
    problem = _Problem(halfspace, gap, load, approach, tolerance, present)
    return problem.solve(start, start_displacement, max_iterations, estimate_error)


def _guessed(halfspace: HalfSpace, gap: Array, load: float) -> Array | None:
    """First guess of a pressure from a coarser grid; None where that does not pay. [-]"""
    if min(gap.shape) < _COARSE_FROM:
        return None
    few = gap[_STRIDE // 2 :: _STRIDE, _STRIDE // 2 :: _STRIDE]
    spacing = (_STRIDE * halfspace.spacing[0], _STRIDE * halfspace.spacing[1])
    coarse = halfspace.on((few.shape[0], few.shape[1]), spacing)
    found = solve_contact(coarse, few, load=load / _STRIDE**2, tolerance=0.03).pressure
    if np.count_nonzero(found) > _SPARSE * found.size:
        return None
    cells = [np.minimum(np.arange(n) // _STRIDE, m - 1) for n, m in zip(gap.shape, few.shape, strict=True)]
    return found[np.ix_(*cells)]


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
        gap -= self.lowest
        gap /= self.length
        self.gap = gap
        # a uniform pressure displaces nothing, so that the energy does not see it
        self.sees_load = load is not None or halfspace.definite
        # the mean gap in contact, where it is known: periodic displacements have no mean
        known = not self.sees_load and present is None
        self.remaining = float(np.mean(gap)) - self.target if known else math.nan
        self.hopeless = False  # whether the approach does not determine the load
        self.convolutions = 0
        self.room = np.empty_like(gap)  # for what is needed in a part of an iteration

    def solve(
        self, start: Array | None, start_displacement: Array | None, max_iterations: int, estimate_error: bool
    ) -> ContactState:
        """Safeguarded, preconditioned conjugate gradients; see the module's notes.

        Vectors live on the face (the cells that may change pressure), as flat indices into the grid; only what the
        transforms take and give, and the search for cells that enter, runs over the whole grid.
        """
        pressure, displacement = self.feasible(start, start_displacement)
        grid = pressure.reshape(-1)
        approximate = displacement is not None  # extrapolated, or by steps in single precision
        if displacement is None:
            displacement = self.displacement(pressure)
        change: NDArray[Any] | None = None  # of the displacement by the last step, and its curvature, for conjugation
        last_face, last_step, unit, curvature = None, np.zeros(0), 1.0, 0.0
        length = 1 / self.scale  # the preconditioner is the inverse up to boundaries and the contact's outline
        best, since, spacer, single = math.inf, 0, False, False
        known: tuple[float, float] | None = None  # change of the pressure asked for, at which gap
        cells = np.flatnonzero(grid)
        for iteration in range(max_iterations + 1):
            duality_gap, energy, level, converged = self.judge(cells, grid.take(cells), displacement)
            if approximate and (converged or self.hopeless or iteration == max_iterations):
                displacement, approximate = self.displacement(pressure), False
                duality_gap, energy, level, converged = self.judge(cells, grid.take(cells), displacement)
            if converged or self.hopeless or iteration == max_iterations:
                break
            if cells.size == grid.size and 0 < self.remaining < _NEARLY_FULL:
                # too much load for any gap; a uniform pressure displaces nothing, and the energy falls without it
                grid -= np.min(grid)
                cells, last_face = np.flatnonzero(grid), None
                continue
            if iteration == 0:
                single = self.room.size >= _SINGLE_FROM and duality_gap > _FAR * self.tolerance * energy
            best, since = (duality_gap, 0) if duality_gap < best / 2 else (best, since + 1)
            if since >= _PATIENCE:
                spacer, since, best = True, 0, duality_gap

            total = self.room
            face = self.face(pressure, total, level)
            residual = total.take(face)
            residual -= level if self.load is None else float(np.mean(residual))
            if spacer:
                trial, face, held, residual = self.projected_gradient(pressure, total, level)
            else:
                search = self.precondition(residual, face)
                if estimate_error:
                    known = float(np.sum(np.abs(search))), duality_gap
                if last_face is not None and change is not None:
                    self.room.fill(0)
                    self.room.reshape(-1)[last_face] = last_step
                    changed = change.take(face) * (unit / curvature)
                    search = self.conjugate(search, residual, changed, self.room.take(face))
                    del changed
                search *= -length
                held = grid.take(face)
                search += held
                trial = self.cut(search)
            step = trial - held
            slope = float(np.sum(step * residual))
            if not slope < 0:  # no descent: forget what is not exact, then the history, then the preconditioner too
                if approximate:
                    displacement, approximate, single = self.displacement(pressure), False, False
                    last_face = None
                    continue
                if spacer:
                    break  # the projected gradient does not descend either: this is the minimum, to rounding
                spacer, last_face, length = last_face is None, None, 1 / self.scale
                continue
            grid[face] = trial
            change = None  # its memory is needed
            if single:
                change, unit = self.rough_displacement(step, face)
            else:
                change, unit = self.displacement(pressure), 1.0
                change -= displacement
            curvature = unit * float(np.sum(step * change.take(face)))
            full = min(-slope / curvature, _FARTHEST) if curvature > 0 else _FARTHEST
            fraction, cut = self.fraction(held, trial, step, full)
            if fraction != 1:
                trial = fraction * step
                trial += held
                np.maximum(trial, 0, out=trial)
                grid[face] = trial
            displacement += np.multiply(change, fraction * unit, out=self.room)
            approximate = single
            cells = face[trial > 0]
            del trial, held, residual
            if spacer:
                spacer, last_face = False, None
            else:
                last_face, last_step = face if curvature > 0 else None, step
                length *= min(max(full, 0.3), _GROWTH if cut else 3.0)
        error = math.nan
        if estimate_error and (self.hopeless or not self.sees_load):
            error = self.error(pressure, displacement, level)
        elif estimate_error and known is not None:
            # what the last preconditioned step asked for, less as the bound has fallen since
            change_asked, gap_then = known
            asked = change_asked / self.scale / float(np.sum(pressure))
            error = _CAUTION * asked * math.sqrt(max(duality_gap, 0.0) / gap_then)
        elif estimate_error:
            error = _UNIMPROVED * max(duality_gap, 0.0) / energy if energy > 0 else 0.0
        return self.state(pressure, displacement, level, duality_gap, energy, converged, iteration, error)

    def feasible(self, start: Array | None, displacement: Array | None) -> tuple[Array, Array | None]:
        """Admissible pressure near a first guess, and its displacement where that of the guess is known."""
        if start is None or not np.any(start > 0):
            pressure, displacement = np.ones(self.halfspace.shape), None
            if self.load is None:
                pressure = np.where(self.gap < self.target, self.target - self.gap, 0.0)
        else:
            pressure = np.maximum(start, 0, out=start)
            pressure /= self.unit
        if self.present is not None:
            pressure = np.where(self.present, pressure, 0.0)
        factor = 1.0 if self.load is None else self.load / float(np.sum(pressure))
        pressure *= factor
        if displacement is not None:
            displacement *= factor / self.length
        return pressure, displacement

    def displacement(self, pressure: Array) -> Array:
        self.convolutions += 1
        displacement = self.halfspace.displacement(pressure)
        displacement *= self.scale
        return displacement

    def rough_displacement(self, step: Array, face: Cells) -> tuple[NDArray[np.float32], float]:
        """Displacement by a step on the face, in single precision, and its unit."""
        self.convolutions += 1
        spread, size = self.spread(step, face)
        unit = size * self.halfspace.largest_influence * self.scale
        return self.halfspace.rough_displacement(spread), unit

    def spread(self, values: Array, face: Cells) -> tuple[NDArray[np.float32], float]:
        """Values on the face over the whole grid, zero elsewhere, over the largest; and that: single underflows."""
        size = float(np.max(np.abs(values), initial=0.0)) or 1.0
        field = self.room.reshape(-1).view(np.float32)[: self.room.size]
        field.fill(0)
        field[face] = (values / size).astype(np.float32)
        return field.reshape(self.room.shape), size

    def judge(self, cells: Cells, pressure: Array, displacement: Array) -> tuple[float, float, float, bool]:
        """Bound on ``f(p) - min f``, ``p.Kp``, the level of the contact, and whether the bound is small enough.

        Leaves the gap with the displacement in ``room``.
        """
        total = np.add(self.gap, displacement, out=self.room)
        own, here = displacement.take(cells), total.take(cells)
        energy = float(np.sum(pressure * own))
        lowest = (
            float(np.min(total)) if self.present is None else float(np.min(total, where=self.present, initial=math.inf))
        )
        load = float(np.sum(pressure))
        self.hopeless = cells.size == total.size and self.remaining < -_ROUNDED  # no load is enough
        if self.load is not None:
            level = float(np.mean(here))
            gap = float(np.sum(pressure * (here - lowest)))
        else:
            level = self.target
            gap = self.gap_under_approach(pressure, displacement, here, lowest)
        # with rounding of the sums above; a pressure of nothing has no error to speak of
        largest = max(float(np.max(here, initial=1.0)), -float(np.min(here, initial=-1.0)))
        floor = 8 * _EPSILON * load * largest
        converged = gap <= self.tolerance * energy + floor and load > 0
        if converged and not self.sees_load:
            converged = self.load_is_certain(cells, here, load, 8 * _EPSILON * max(largest, float(np.max(own))))
        return gap, energy, level, converged

    def load_is_certain(self, cells: Cells, here: Array, load: float, rounding: float) -> bool:
        """Whether the load is, under given approach and periodic boundaries, as certain as the tolerance asks.

        A pressure in equilibrium with gaps that are off by ``e`` in the contact is exact for a surface that is off by
        as much. That changes the load by ``k`` times the mean of ``e``, near full contact, where ``k`` is the contact's
        stiffness, ``k = min w.(1/K)w / mean(w)^2`` over all ``w`` that vanish in the contact. The gap's own shape for
        ``w`` makes that a bound. With ``W ~ (1 - c gap^0.4)`` near full contact it is 1.6 times too large.
        """
        if self.remaining <= rounding:  # full contact: every load that is large enough has this approach
            self.hopeless = True
            return False
        total = self.room
        below = total < self.target
        if self.present is not None:
            below &= self.present
        amiss = self.target - total[below]
        inside, above = float(np.sum(amiss)), float(np.sum(np.maximum(here - self.target, 0)))
        limit = _LOAD_ERROR * self.tolerance + _ROUNDED
        if inside + above <= limit * (total.size * self.remaining + inside - above):
            return True  # not even relative to the mean gap: k mean(gap) is no more than the load near full contact
        error = self.stiffness(cells) * (inside + above) / total.size / load
        self.hopeless = error > limit and inside + above <= rounding * total.size
        return bool(error <= limit)

    def stiffness(self, cells: Cells) -> float:
        """Bound on the change of load with approach, with periodic boundaries; infinite where no cell is open."""
        opening, pressure = self.opened(cells, self.target)
        return float(np.sum(opening * pressure)) / self.scale if np.any(opening) else math.inf

    def opened(self, cells: Cells, level: float) -> tuple[Array, Array]:
        """Gap outside a contact over its mean, zero if there is none, and about the pressure that opens it."""
        opening = self.room - level
        np.maximum(opening, 0, out=opening)
        opening.reshape(-1)[cells] = 0
        if self.present is not None:  # any shape will do there
            opening[~self.present] = 0
            opening[~self.present] = np.max(opening) or 1.0
        mean = float(np.mean(opening))
        if not mean > 0:
            return opening, opening
        self.convolutions += 1
        opening /= mean
        largest = float(np.max(opening))
        shape = ((opening - 1) / largest).astype(np.float32)
        pressure = self.halfspace.approximate_inverse(shape).astype(float)
        pressure *= largest
        return opening, pressure

    def approach(self, pressure: Array, displacement: Array, level: float) -> float:
        """Approach under given load: the level of the contact, weighted by pressure.

        Near full contact with periodic boundaries what matters is the mean gap, far smaller than the displacements.
        There the weight ``q`` is about the pressure of a flat punch of the contact's outline, which is what more load
        would add: an error ``e`` of the pressure moves that level by ``q.Ke``, nothing where ``Kq`` is uniform.
        """
        cells = np.flatnonzero(pressure)
        total = np.add(self.gap, displacement, out=self.room)
        excess = total.take(cells) - level
        weight = pressure.take(cells)
        full = math.inf
        if not self.halfspace.definite and self.present is None:
            mean = float(np.mean(self.gap))  # no gap is left at this approach: the displacement has no mean
            if mean - level < _NEARLY_FULL * mean:
                full = mean
                opening, opens = self.opened(cells, level)
                if not np.any(opening):
                    return full
                outside = np.ones(opening.size, bool)
                outside[cells] = False
                weight = np.maximum(float(np.mean(opens.reshape(-1)[outside])) - opens.take(cells), 0)
        return min(level + float(np.sum(weight * excess)) / float(np.sum(weight)), full)

    def error(self, pressure: Array, displacement: Array, level: float) -> float:
        """Estimated relative L1 error of the pressure under a given approach with periodic boundaries.

        It is what the next preconditioned step would change: the preconditioner is nearly the inverse, in the contact
        and at its border. What a uniform residual does to the load it does not know, and that is added.
        """
        if self.hopeless:
            return math.inf
        total = np.add(self.gap, displacement, out=self.room)
        load = float(np.sum(pressure))
        face = self.face(pressure, total, level)
        residual = total.take(face) - level
        uniform = self.stiffness(np.flatnonzero(pressure)) * abs(float(np.sum(residual))) / total.size
        step = float(np.sum(np.abs(self.precondition(residual, face)))) / self.scale
        return (step + uniform) / load

    def gap_under_approach(self, pressure: Array, displacement: Array, here: Array, lowest: float) -> float:
        """The duality gap where the approach is given."""
        excess = float(np.sum(pressure * (here - self.target)))
        missing = max(0.0, self.target - lowest)
        if self.halfspace.definite and self.uniform[0] > 0:
            # a dual feasible point from q >= 0 with Kq >= 1: here q is uniform
            uniform, response = self.uniform
            gap = excess + missing * uniform * float(np.sum(displacement))
            return gap + 0.5 * missing**2 * uniform**2 * response
        # No such q exists, as a half-space's periodic kernel is singular. The pressure is certified under its own load,
        # and its own approach must be the one asked for.
        load = float(np.sum(pressure))
        own_gap = float(np.sum(pressure * (here - lowest)))
        return max(own_gap, abs(excess) + load * missing) if load > 0 else math.inf

    @property
    def uniform(self) -> tuple[float, float]:
        """Uniform pressure that displaces every present cell by at least one length, and the total displacement by one.

        The pressure is zero where there is none: under a kernel that bulges.
        """
        if not hasattr(self, "_uniform"):
            ones = np.ones(self.halfspace.shape) if self.present is None else self.present.astype(float)
            response = self.displacement(ones)
            inside = response if self.present is None else response[self.present]
            least = float(np.min(inside))
            self._uniform = (1 / least if least > 0 else 0.0, float(np.sum(inside)))
        return self._uniform

    def face(self, pressure: Array, total: Array, level: float) -> Cells:
        """Cells that may change pressure: those in contact and those that would penetrate."""
        mask = total < level
        if self.present is not None:
            mask &= self.present
        mask |= pressure > 0
        return np.flatnonzero(mask)

    def tangent(self, vector: Array) -> Array:
        """Part of a vector on the face that keeps a given load."""
        return vector if self.load is None else vector - float(np.mean(vector))

    def precondition(self, residual: Array, face: Cells) -> Array:
        self.convolutions += 1
        spread, size = self.spread(residual, face)
        pressure = self.halfspace.approximate_inverse(spread).take(face).astype(float)
        pressure *= size
        return self.tangent(pressure)

    def conjugate(self, search: Array, residual: Array, changed: Array, last_step: Array) -> Array:
        """Search direction conjugate to the last step; ``changed`` is its displacement over its curvature."""
        beta = float(np.sum(search * changed))
        if beta > 0:
            conjugate = search - beta * self.tangent(last_step)
            if float(np.sum(residual * conjugate)) > 0:
                return conjugate
        return search

    def cut(self, pressure: Array) -> Array:
        """The pressure made admissible in the manner of Polonsky and Keer: cut at zero, then scaled to the load."""
        np.maximum(pressure, 0, out=pressure)
        if self.load is not None:
            pressure *= self.load / float(np.sum(pressure))
        return pressure

    def projected_gradient(self, pressure: Array, total: Array, level: float) -> tuple[Array, Cells, Array, Array]:
        """Trial pressure on the cells that it changes, with these cells, what they hold and their residual."""
        stiffest = self.halfspace.largest_influence * self.scale
        moved = pressure - (total - level) / stiffest
        if self.present is not None:
            moved = np.where(self.present, moved, -math.inf)
        trial = np.maximum(moved, 0) if self.load is None else _onto_simplex(moved, self.load)
        face = np.flatnonzero((trial > 0) | (pressure > 0))
        return trial.reshape(-1)[face], face, pressure.reshape(-1)[face], (total - level).reshape(-1)[face]

    @staticmethod
    def fraction(held: Array, trial: Array, step: Array, full: float) -> tuple[float, bool]:
        """Fraction of the step to take, and whether the border of the feasible set cut it."""
        if np.any((held > 0) & (trial == 0)):
            # whole if f falls by it, so that these cells leave the contact
            return (1.0, full > 1) if full > 0.5 else (full, False)
        if full <= 1:
            return full, False
        with np.errstate(divide="ignore", invalid="ignore"):
            # of its own pressure, in the cell that reaches zero first
            steepest = float(np.fmin.reduce(step / held, initial=math.inf))
        limit = -1 / steepest if steepest < 0 else math.inf
        return min(full, limit), full > limit

    def state(
        self,
        pressure: Array,
        displacement: Array,
        level: float,
        duality_gap: float,
        energy: float,
        converged: bool,
        iterations: int,
        error: float,
    ) -> ContactState:
        load = float(np.sum(pressure))
        approach = level
        if self.load is not None:
            approach = self.approach(pressure, displacement, level)
        bound = math.sqrt(2 * max(duality_gap, 0.0) / energy) if energy > 0 else 0.0
        pressure *= self.unit
        displacement *= self.length
        return ContactState(
            pressure=pressure,
            displacement=displacement,
            approach=approach * self.length + self.lowest,
            load=load * self.unit,
            bound=bound,
            converged=converged,
            iterations=iterations,
            convolutions=self.convolutions,
            error=error,
        )


def _onto_simplex(values: Array, total: float) -> Array:
    """Nearest non-negative array of given sum."""
    largest = float(np.max(values))
    shifted = values - largest  # a small sum is lost beside large values otherwise
    ordered = np.sort(shifted, axis=None)[::-1]
    excess = (np.cumsum(ordered) - total) / np.arange(1, ordered.size + 1)
    last = int(np.count_nonzero(ordered > excess)) - 1
    return np.maximum(shifted - excess[last], 0)
