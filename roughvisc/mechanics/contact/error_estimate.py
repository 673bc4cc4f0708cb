"""The estimated error of a pressure, in the L1 norm over the load."""

from __future__ import annotations

import math

import numpy as np

from roughvisc.mechanics.contact.certificate import Certificate
from roughvisc.mechanics.contact.full_contact import stiffness
from roughvisc.mechanics.contact.influence import Array, Cells
from roughvisc.mechanics.contact.problem import Problem

# Error of a first guess that is good enough, over its relative duality gap: 1 in the median, 7 in one of fifty.
_UNIMPROVED = 3.5
# Safety factor of the estimated error elsewhere: without it, one estimate in fifty is below 0.8 of the true error.
_CAUTION = 1.25


def estimated_error(
    problem: Problem,
    pressure: Array,
    contact: Cells,
    displacement: Array,
    certificate: Certificate,
    asked: tuple[float, float] | None,
) -> float:
    """Estimated relative L1 error of the pressure.

    Parameters
    ----------
    problem : Problem
        What is asked.
    pressure, displacement : ndarray, shape (nx, ny)
        The pressure, and its displacement.
    contact : ndarray of int
        Cells that carry pressure, as flat indices.
    certificate : Certificate
        Of this pressure.
    asked : tuple of float, or None
        L1 norm of the change that the last preconditioned step asked for, but for the scale, and the duality gap then;
        None where there was no such step.
    """
    if certificate.hopeless:
        return math.inf
    # In full contact with periodic boundaries the energy is that of the pressure's variation alone. Over that of a flat
    # surface, which is nothing but rounding, an error would be any number.
    full = not problem.definite and contact.size == pressure.size
    if full or not problem.sees_load:
        return _of_next_step(problem, pressure, contact, displacement, certificate.level)
    duality_gap = max(certificate.duality_gap, 0.0)
    if asked is None:
        return _UNIMPROVED * duality_gap / certificate.energy if certificate.energy > 0 else 0.0
    # what the last preconditioned step asked for, less as the bound has fallen since
    change_asked, duality_gap_then = asked
    relative = change_asked / problem.influence.scale / float(pressure.sum())
    return _CAUTION * relative * math.sqrt(duality_gap / duality_gap_then)


def _of_next_step(problem: Problem, pressure: Array, contact: Cells, displacement: Array, level: float) -> float:
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
    step = float(np.abs(problem.preconditioned(residual, free_set)).sum()) / problem.influence.scale
    return (step + uniform) / load
