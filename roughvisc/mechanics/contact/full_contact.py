"""Near full contact with periodic boundaries: how load and approach depend on each other there.

A uniform pressure displaces nothing, so that the energy does not see the load; and what matters is the mean gap, far
smaller than the displacements.
"""

from __future__ import annotations

import math

import numpy as np

from roughvisc.mechanics.contact.influence import Array, Cells
from roughvisc.mechanics.contact.problem import Problem
from roughvisc.mechanics.fields import passes

# Under given approach and periodic boundaries the load is wrong by no more than this many times the tolerance.
# Measured: below 98 % of contact the duality gap makes it less, so that no iteration is added.
_LOAD_ERROR = 10.0
# ... and by this in any case: what rounding of the gap leaves.
ROUNDED = 1e-10
# So near full contact, in parts of the approach, a load that leaves no gap at all is cut at once: measured at 64
# squared, 7 iterations instead of 346.
_NEARLY_FULL = 1e-3


def carries_excess(problem: Problem, contact: Cells) -> bool:
    """Whether a given approach is nearly that of full contact, and the pressure leaves no gap at all."""
    return contact.size == problem.gap.size and 0 < problem.remaining < _NEARLY_FULL


def load_certainty(
    problem: Problem, contact: Cells, separation: Array, here: Array, load: float, rounding: float
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


def stiffness(problem: Problem, contact: Cells, separation: Array) -> float:
    """Bound on the change of load with a given approach; infinite where no cell is open."""
    opening, pressure = _opened(problem, contact, separation, problem.target)
    return float((opening * pressure).sum()) / problem.influence.scale if np.any(opening) else math.inf


def _opened(problem: Problem, contact: Cells, separation: Array, level: float) -> tuple[Array, Array]:
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


def approach_under_load(problem: Problem, pressure: Array, contact: Cells, displacement: Array, level: float) -> float:
    """Approach under given load: the level of the contact, weighted by pressure.

    Near full contact with periodic boundaries the weight ``q`` is about the pressure of a flat punch of the contact's
    outline, which is what more load would add: an error ``e`` of the pressure moves that level by ``q.Ke``, nothing
    where ``Kq`` is uniform.
    """
    threads = problem.influence.threads
    excess = problem.influence.at(problem.gap, contact)
    excess += problem.influence.at(displacement, contact)
    passes.lower(excess, level, threads)
    weight = problem.influence.at(pressure, contact)
    full = math.inf
    if not problem.definite and problem.present is None:
        # no gap is left at this approach: the displacement has no mean
        mean = passes.total(problem.gap.reshape(-1), threads) / problem.gap.size
        if mean - level < _NEARLY_FULL * mean:
            full = mean
            opening, opens = _opened(problem, contact, problem.separation(displacement), level)
            if not np.any(opening):
                return full
            outside = np.ones(opening.size, bool)
            outside[contact] = False
            weight = np.maximum(float(np.mean(opens.reshape(-1)[outside])) - opens.take(contact), 0)
    return min(level + float((weight * excess).sum()) / float(weight.sum()), full)
