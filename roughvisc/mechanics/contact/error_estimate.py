"""The estimated error of a pressure, in the L1 norm over the load."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from roughvisc.mechanics.contact.certificate import Certificate
from roughvisc.mechanics.contact.full_contact import stiffness
from roughvisc.mechanics.contact.influence import Array, Cells
from roughvisc.mechanics.contact.problem import Problem
from roughvisc.mechanics.fields import passes

# Safety factor of the estimated error elsewhere: without it, one estimate in fifty is below 0.8 of the true error.
_CAUTION = 1.25


class Asked(NamedTuple):
    """L1 norm of the change that a preconditioned step asked for, but for the scale, and the duality gap then."""

    change: float
    duality_gap: float


def estimated_error(
    problem: Problem,
    pressure: Array,
    contact: Cells,
    displacement: Array,
    certificate: Certificate,
    asked: Asked | None,
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
    asked : Asked or None
        By the last preconditioned step; None where there was no such step.
    """
    if certificate.hopeless:
        return math.inf
    if not certificate.energy > 0 and asked is None:
        return 0.0
    # a first guess that is good enough may be far off in few cells: its gap falls with the square of what is amiss
    if asked is None or not is_measured(problem, contact):
        return _of_next_step(problem, pressure, contact, displacement, certificate.level)
    return error_left(problem, pressure, certificate, asked)


def is_measured(problem: Problem, contact: Cells) -> bool:
    """Whether what a step asks for tells the error.

    In full contact with periodic boundaries the energy is that of the pressure's variation alone. Over that of a flat
    surface, which is nothing but rounding, an error would be any number.
    """
    return problem.sees_load and (problem.definite or contact.size < problem.gap.size)


def error_left(problem: Problem, pressure: Array, certificate: Certificate, asked: Asked) -> float:
    """What the last preconditioned step asked for, less as the bound has fallen since, over the pressure."""
    load = passes.total(pressure.reshape(-1), problem.influence.threads)
    if not load > 0:
        return math.inf
    relative = asked.change / problem.influence.scale / load
    fallen = max(certificate.duality_gap, 0.0) / asked.duality_gap if asked.duality_gap > 0 else 1.0
    return _CAUTION * relative * math.sqrt(fallen)


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
