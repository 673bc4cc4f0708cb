"""What is known of a pressure: its duality gap, the bound that follows from it, and an estimate of its error.

Near full contact with periodic boundaries load and approach depend on each other: a uniform pressure displaces nothing,
so that the energy does not see the load, and what matters is the mean gap, far smaller than the displacements.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from roughvisc.mechanics.arrays import blockwise, summed, total
from roughvisc.mechanics.contact.problem import Array, Cells, ContactProblem

# Under given approach and periodic boundaries the load is wrong by no more than this many times the tolerance.
# Measured: below 98 % of contact the duality gap makes it less, so that no iteration is added.
_LOAD_ERROR = 10.0
# ... and by this in any case: what rounding of the gap leaves.
ROUNDED = 1e-10
# So near full contact, in parts of the approach, a load that leaves no gap at all is cut at once: measured at 64
# squared, 7 iterations instead of 346.
_NEARLY_FULL = 1e-3


def carries_excess(problem: ContactProblem, contact: Cells) -> bool:
    """Whether a given approach is nearly that of full contact, and the pressure leaves no gap at all."""
    return contact.size == problem.gap.size and 0 < problem.remaining < _NEARLY_FULL


def load_certainty(
    problem: ContactProblem, contact: Cells, separation: Array, here: Array, load: float, rounding: float
) -> tuple[bool, bool]:
    """Whether the load is as certain as the tolerance asks, and whether the approach does not determine it.

    Under given approach and periodic boundaries. A pressure in equilibrium with gaps that are off by ``e`` in the
    contact is exact for a surface that is off by as much. That changes the load by ``k`` times the mean of ``e``, near
    full contact, where ``k`` is the contact's stiffness, ``k = min w.(1/K)w / mean(w)^2`` over all ``w`` that vanish in
    the contact. The gap's own shape for ``w`` makes that a bound. With ``W ~ (1 - c gap^0.4)`` near full contact it is
    1.6 times too large.
    """
    if problem.remaining <= rounding:  # full contact: every load that is large enough has this approach
        return False, True
    below = separation < problem.target
    if problem.present is not None:
        below &= problem.present
    amiss = problem.target - separation[below]
    inside, above = float(amiss.sum()), float(np.maximum(here - problem.target, 0).sum())
    limit = _LOAD_ERROR * problem.tolerance + ROUNDED
    if inside + above <= limit * (separation.size * problem.remaining + inside - above):
        return True, False  # not even relative to the mean gap: k mean(gap) is no more than the load near full contact
    error = stiffness(problem, contact, separation) * (inside + above) / separation.size / load
    return error <= limit, error > limit and inside + above <= rounding * separation.size


def stiffness(problem: ContactProblem, contact: Cells, separation: Array) -> float:
    """Bound on the change of load with a given approach; infinite where no cell is open."""
    opening, pressure = _opened(problem, contact, separation, problem.target)
    return float((opening * pressure).sum()) / problem.influence.scale if np.any(opening) else math.inf


def _opened(problem: ContactProblem, contact: Cells, separation: Array, level: float) -> tuple[Array, Array]:
    """Gap outside a contact over its mean, zero if there is none, and about the pressure that opens it."""
    opening = separation - level
    np.maximum(opening, 0, out=opening)
    opening.reshape(-1)[contact] = 0
    if problem.present is not None:  # any shape will do there
        opening[~problem.present] = 0
        opening[~problem.present] = opening.max() or 1.0
    mean = float(np.mean(opening))
    if not mean > 0:
        return opening, opening
    opening /= mean
    largest = float(opening.max())
    pressure = problem.influence.approximate_pressure_field(((opening - 1) / largest).astype(np.float32))
    pressure *= largest
    return opening, pressure


def approach_under_load(
    problem: ContactProblem, pressure: Array, contact: Cells, displacement: Array, level: float
) -> float:
    """Approach under given load: the level of the contact, weighted by pressure.

    Near full contact with periodic boundaries the weight ``q`` is about the pressure of a flat punch of the contact's
    outline, which is what more load would add: an error ``e`` of the pressure moves that level by ``q.Ke``, nothing
    where ``Kq`` is uniform.
    """
    threads = problem.influence.threads
    excess = problem.influence.at(problem.gap, contact)
    excess += problem.influence.at(displacement, contact)
    excess -= level
    weight = problem.influence.at(pressure, contact)
    full = math.inf
    if not problem.definite and problem.present is None:
        # no gap is left at this approach: the displacement has no mean
        mean = total(problem.gap.reshape(-1), threads) / problem.gap.size
        if mean - level < _NEARLY_FULL * mean:
            full = mean
            opening, opens = _opened(problem, contact, problem.separation(displacement), level)
            if not np.any(opening):
                return full
            outside = np.ones(opening.size, bool)
            outside[contact] = False
            weight = np.maximum(float(np.mean(opens.reshape(-1)[outside])) - opens.take(contact), 0)
    return min(level + summed(weight * excess) / summed(weight), full)


# Rounding of a sum over the cells, in parts of the sum: pairwise summation errs by a few units in the last place.
_ROUNDING = 8 * float(np.finfo(float).eps)


class Certificate(NamedTuple):
    """What is known of a pressure.

    Attributes
    ----------
    duality_gap : float
        Bound on ``f(p) - min f``.
    energy : float
        ``p.Kp``.
    level : float
        Approach that the contact has: the given one, or the mean over the contact.
    converged : bool
        Whether the duality gap is small enough, and the load certain.
    hopeless : bool
        Whether the approach does not determine the load.
    """

    duality_gap: float
    energy: float
    level: float
    converged: bool
    hopeless: bool

    @property
    def settled(self) -> bool:
        """Whether there is nothing more to find."""
        return self.converged or self.hopeless

    @property
    def bound(self) -> float:
        """On the relative error of the pressure in the energy norm; zero of no pressure."""
        return math.sqrt(2 * max(self.duality_gap, 0.0) / self.energy) if self.energy > 0 else 0.0


def certify(
    problem: ContactProblem, pressure: Array, contact: Cells, displacement: Array
) -> tuple[Certificate, Array | None]:
    """Judge a pressure.

    Parameters
    ----------
    problem : ContactProblem
        The problem.
    pressure, displacement : ndarray, shape (nx, ny)
        The pressure, and its displacement.
    contact : ndarray of int
        Cells that carry pressure, as flat indices.

    Returns
    -------
    Certificate
    ndarray, shape (nx * ny,), or None
        Gap under pressure at zero approach; None of a wide field, where it is as soon had again as fetched.
    """
    carried, displaced = pressure.reshape(-1), displacement.reshape(-1)
    lowest, apart, separation = problem.separated(displacement, contact)

    def judged(here: Array, cells: Cells) -> tuple[float, ...]:
        p = carried.take(cells)
        excess = 0.0 if problem.load is not None else summed(p * (here - problem.target))
        sums = summed(p), excess, *map(summed, (p * displaced.take(cells), here, p * (here - lowest)))
        return max(float(np.maximum.reduce(here, initial=1.0)), -float(np.minimum.reduce(here, initial=0.0))), *sums

    found = _together(blockwise(judged, apart, contact, threads=problem.influence.threads))
    largest, load, excess, energy, height, own_duality_gap = found
    if problem.load is not None:
        level = height / contact.size
        duality_gap = own_duality_gap
    else:
        level = problem.target
        duality_gap = _under_approach(problem, displacement, load, excess, own_duality_gap, lowest)
    # with rounding of the sums above; a pressure of nothing has no error to speak of
    converged = duality_gap <= problem.tolerance * energy + _ROUNDING * load * largest and load > 0
    hopeless = contact.size == pressure.size and problem.remaining < -ROUNDED  # no load is enough
    if converged and not problem.sees_load:
        rounding = _ROUNDING * max(largest, float(problem.influence.at(displacement, contact).max()))
        field = problem.separation(displacement)
        converged, hopeless = load_certainty(problem, contact, field, apart, load, rounding)
    return Certificate(duality_gap, energy, level, converged, hopeless), separation


def _together(parts: Sequence[tuple[float, ...]]) -> tuple[float, ...]:
    """What was found of parts, of all of them: the largest of the first, and the sums of the others."""
    if len(parts) == 1:
        return parts[0]
    first, *others = zip(*parts, strict=True)
    return max(first), *map(sum, others)


def _under_approach(
    problem: ContactProblem, displacement: Array, load: float, excess: float, own_duality_gap: float, lowest: float
) -> float:
    """The duality gap where the approach is given; its own is that of the pressure under its own load."""
    missing = max(0.0, problem.target - lowest)
    if problem.definite and problem.uniform[0] > 0:
        # a dual feasible point from q >= 0 with Kq >= 1: here q is uniform over the cells that are there
        uniform, response = problem.uniform
        displaced = displacement if problem.present is None else displacement[problem.present]
        duality_gap = excess + missing * uniform * float(displaced.sum())
        return duality_gap + 0.5 * missing**2 * uniform**2 * response
    # No such q exists, as a half-space's periodic kernel is singular. The pressure is certified under its own load, and
    # its own approach must be the one asked for.
    return max(own_duality_gap, abs(excess) + load * missing) if load > 0 else math.inf


# Safety factor of the estimated error elsewhere: without it, one estimate in fifty is below 0.8 of the true error.
_CAUTION = 1.25


class RequestedChange(NamedTuple):
    """L1 norm of the preconditioned residual, which is not scaled, and the duality gap at that iteration."""

    change: float
    duality_gap: float


def estimated_error(
    problem: ContactProblem,
    pressure: Array,
    contact: Cells,
    displacement: Array,
    certificate: Certificate,
    requested: RequestedChange | None,
) -> float:
    """Estimated relative L1 error of the pressure.

    Parameters
    ----------
    problem : ContactProblem
        The problem.
    pressure, displacement : ndarray, shape (nx, ny)
        The pressure, and its displacement.
    contact : ndarray of int
        Cells that carry pressure, as flat indices.
    certificate : Certificate
        Of this pressure.
    requested : RequestedChange or None
        By the last preconditioned step; None where there was no such step.
    """
    if certificate.hopeless:
        return math.inf
    if not certificate.energy > 0 and requested is None:
        return 0.0
    # a first guess that is good enough may be far off in few cells: its gap falls with the square of what is amiss
    if requested is None or not is_measured(problem, contact):
        return _of_next_step(problem, pressure, contact, displacement, certificate.level)
    return error_left(problem, pressure, certificate, requested)


def is_measured(problem: ContactProblem, contact: Cells) -> bool:
    """Whether what a step asks for tells the error.

    In full contact with periodic boundaries the energy is that of the pressure's variation alone. Over that of a flat
    surface, which is nothing but rounding, an error would be any number.
    """
    return problem.sees_load and (problem.definite or contact.size < problem.gap.size)


def error_left(problem: ContactProblem, pressure: Array, certificate: Certificate, requested: RequestedChange) -> float:
    """The last preconditioned residual over the pressure, reduced as the bound has fallen since."""
    load = total(pressure.reshape(-1), problem.influence.threads)
    if not load > 0:
        return math.inf
    relative = requested.change / problem.influence.scale / load
    fallen = max(certificate.duality_gap, 0.0) / requested.duality_gap if requested.duality_gap > 0 else 1.0
    return _CAUTION * relative * math.sqrt(fallen)


def _of_next_step(problem: ContactProblem, pressure: Array, contact: Cells, displacement: Array, level: float) -> float:
    """The estimate under a given approach with periodic boundaries, and in full contact.

    It is what the next preconditioned step would change: the preconditioner is nearly the inverse, in the contact
    and at its border. What a uniform residual does to the load it does not know, and that is added.
    """
    separation = problem.separation(displacement)
    load = float(pressure.sum())
    free_set, residual, _ = problem.free_set(pressure, displacement, level)
    residual -= level
    amiss = 0.0 if problem.load is not None else abs(float(residual.sum())) / separation.size
    uniform = stiffness(problem, contact, separation) * amiss if amiss else 0.0
    change = problem.influence.approximate_pressure(residual, free_set)
    step = float(np.abs(change - problem.excess(change)).sum()) / problem.influence.scale
    return (step + uniform) / load
