"""Convergence certificate of the contact solver: the duality gap and the error bound that follows from it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from roughvisc.mechanics.contact.full_contact import ROUNDED, load_certainty
from roughvisc.mechanics.contact.influence import Array, Cells
from roughvisc.mechanics.contact.problem import Problem
from roughvisc.mechanics.fields import passes

# Rounding of a sum over the cells, in parts of the sum: pairwise summation errs by a few units in the last place.
_ROUNDING = 8 * float(np.finfo(float).eps)


@dataclass(frozen=True)
class Certificate:
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


def certify(problem: Problem, pressure: Array, contact: Cells, displacement: Array) -> tuple[Certificate, Array | None]:
    """Judge a pressure.

    Parameters
    ----------
    problem : Problem
        What is asked.
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
        excess = 0.0 if problem.load is not None else passes.summed(p * (here - problem.target))
        sums = passes.summed(p), excess, *map(passes.summed, (p * displaced.take(cells), here, p * (here - lowest)))
        return max(float(np.maximum.reduce(here, initial=1.0)), -float(np.minimum.reduce(here, initial=0.0))), *sums

    found = _together(passes.of_vectors(judged, problem.influence.threads, apart, contact))
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
    problem: Problem, displacement: Array, load: float, excess: float, own_duality_gap: float, lowest: float
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
