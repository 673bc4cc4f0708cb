"""Convergence certificate of the contact solver: the duality gap and the error bound that follows from it."""

from __future__ import annotations

import math
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


def certify(problem: Problem, pressure: Array, contact: Cells, displacement: Array) -> Certificate:
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
    """
    carried, displaced = pressure.reshape(-1), displacement.reshape(-1)

    def judged(part: slice, few: slice) -> tuple[float, ...]:
        apart, cells = problem.separation_of(displaced, part), contact[few]
        lowest = problem.lowest_of(apart, part)
        if part.start:
            cells = cells - part.start
        here = apart.take(cells)
        del apart
        p, u = carried[part].take(cells), displaced[part].take(cells)
        excess = 0.0 if problem.load is not None else passes.summed(p * (here - problem.target))
        sums = passes.summed(p), excess, *map(passes.summed, (p * u, here, p * (here - lowest)))
        return lowest, float(np.maximum.reduce(here, initial=1.0)), -float(np.minimum.reduce(here, initial=-1.0)), *sums

    found = passes.with_cells(judged, pressure.size, contact, problem.influence.threads)
    lows, highest, deepest, loads, *sums = zip(*found, strict=True)
    lowest, load = min(lows), float(sum(loads))
    excess, energy, height, above = (float(sum(each)) for each in sums)
    # above the lowest of each part, and that above the lowest of all: nothing cancels
    own_duality_gap = above + sum(
        (low - lowest) * carrying for low, carrying in zip(lows, loads, strict=True) if carrying
    )
    if problem.load is not None:
        level = height / contact.size
        duality_gap = own_duality_gap
    else:
        level = problem.target
        duality_gap = _under_approach(problem, displacement, load, excess, own_duality_gap, lowest)
    # with rounding of the sums above; a pressure of nothing has no error to speak of
    largest = max(*highest, *deepest)
    converged = duality_gap <= problem.tolerance * energy + _ROUNDING * load * largest and load > 0
    hopeless = contact.size == pressure.size and problem.remaining < -ROUNDED  # no load is enough
    if converged and not problem.sees_load:
        rounding = _ROUNDING * max(largest, float(problem.influence.at(displacement, contact).max()))
        separation = problem.separation(displacement)
        here = problem.influence.at(separation, contact)
        converged, hopeless = load_certainty(problem, contact, separation, here, load, rounding)
    return Certificate(duality_gap, energy, level, converged, hopeless)


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
