"""First guess of the contact of a step: the best combination of pressures whose displacements are known.

The contact solver minimises the energy ``compliance p.Kp/2 + gap.p - approach sum(p)`` over the pressures ``p >= 0`` of
a step; under a load without the last term. The minimum over the combinations of a few pressures with known
displacements ``Kp`` costs no convolution [1]_. The combination may be negative in some cells: the solver sets them to
zero.

.. [1] P. F. Fischer, Projection techniques for iterative solution of Ax = b with successive right-hand sides, Computer
   Methods in Applied Mechanics and Engineering 163 (1998) 193.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from roughvisc.mechanics.contact.passes import inner
from roughvisc.mechanics.memory import Prediction
from roughvisc.mechanics.scene import Packed, Point, unpacked

Array = Any  # an array of NumPy or CuPy

#: A direction is left out if its energy is at most this part of the energy of the first pressure, or of its own energy
#: before it was made orthogonal to the others: the displacement is then less than 1e-6 of theirs, and mostly rounding.
NEGLIGIBLE = 1e-12


class Candidate(NamedTuple):
    """Pressure that a first guess may contain.

    Attributes
    ----------
    stored_pressure : array, shape (nx, ny), or Packed
        Pressure. [Pa]
    displacement : array, shape (nx, ny)
        Displacement per unit compliance, ``Kp``. If the kernel depends on the step, it is of no use. [m Pa]
    weight : float
        Weight in the guess if displacements are of no use.
    """

    stored_pressure: Array | Packed
    displacement: Array
    weight: float

    @property
    def pressure(self) -> Array:
        """Pressure at all cells, shape (nx, ny). [Pa]"""
        return unpacked(self.stored_pressure)


def last_two(here: Point, step: float) -> list[Candidate]:
    """Return the pressures at the start of a step [s] and at the point before it; their weights extrapolate in time."""
    displacement = here.history.fields[0]
    if here.previous is None or step == 0:
        return [Candidate(here.stored_pressure, displacement, 1.0)]
    then, stored, former_displacement = here.previous
    ratio = step / (here.time - then)
    return [
        Candidate(here.stored_pressure, displacement, 1 + ratio),
        Candidate(stored, former_displacement, -ratio),
    ]


def both_ends(start: Point, end: Point, time: float) -> list[Candidate]:
    """Return the pressures at both ends of a step, for a time inside it [s]; their weights interpolate."""
    weight = (time - start.time) / (end.time - start.time)
    return [
        Candidate(end.stored_pressure, end.history.fields[0], weight),
        Candidate(start.stored_pressure, start.history.fields[0], 1 - weight),
    ]


def around_coarse(end: Point, coarse: Point, start: Point) -> list[Candidate]:
    """Return the pressures for the first guess of the coarse solution at the end of a step.

    They are those of the fine solution there, and of both solutions at the start; their weights add the difference at
    the start. In a slide the pressure stays with the profile, so that all are in its frame.

    Parameters
    ----------
    end, start : Point
        Fine solution at the end and at the start.
    coarse : Point
        Coarse solution at the start.
    """
    points = [(end, 1.0)]
    if coarse is not start:
        points += [(coarse, 1.0), (start, -1.0)]
    return [Candidate(point.stored_pressure, point.history.fields[0], weight) for point, weight in points]


def first_guess(
    candidates: Sequence[Candidate], prediction: Prediction, gap: Array, **target: float
) -> dict[str, Array]:
    """Return the arguments of :func:`solve_contact` that state the first guess of a step; none from open surfaces.

    Parameters
    ----------
    candidates : sequence of Candidate
        Pressures that the guess combines.
    prediction : Prediction
        Elastic problem of the step.
    gap : array, shape (nx, ny)
        Gap without pressure in the step at zero approach; finite. [m]
    **target
        ``load``, the sum of the pressure over the cells [Pa], or ``approach`` [m].
    """
    candidates = [candidate for candidate in candidates if candidate.pressure.any()]
    if not candidates:
        return {}
    alpha = prediction.compliance
    has_displacements = prediction.grid is None
    weights = [candidate.weight for candidate in candidates]
    if has_displacements:
        weights = best_weights(candidates, alpha, gap, **target)
    weights = [alpha * weight for weight in weights]  # the solver takes pressures over the contact modulus, 1 / alpha
    start = combination(candidates, weights)
    if not has_displacements or start.min() < 0:  # the displacement would belong to the negative pressures too
        return {"start": start}
    return {"start": start, "start_displacement": combination(candidates, weights, of_displacement=True)}


def combination(candidates: Sequence[Candidate], weights: Sequence[float], *, of_displacement: bool = False) -> Array:
    """Return the combination of the pressures [Pa], or of the displacements [m Pa], with weights."""
    total: Array = 0.0
    for candidate, weight in zip(candidates, weights, strict=True):
        total = total + weight * (candidate.displacement if of_displacement else candidate.pressure)
    return total


def best_weights(
    candidates: Sequence[Candidate],
    compliance: float,
    gap: Array,
    *,
    load: float | None = None,
    approach: float | None = None,
) -> list[float]:
    """Return the weights of the combination that has the least energy, and the load if one is given.

    Parameters
    ----------
    candidates : sequence of Candidate
        Pressures with their displacements; the first pressure must not vanish.
    compliance : float
        Compliance of the step. [1/Pa]
    gap : array, shape (nx, ny)
        Gap without pressure in the step at zero approach; finite. [m]
    load, approach : float
        Sum of the pressure over the cells [Pa], or approach [m]; exactly one.
    """
    count = len(candidates)
    sums = np.zeros(count)
    descents = np.zeros(count)  # decrease of the energy with each weight, from zero pressure
    energies = np.zeros((count, count))
    for row, candidate in enumerate(candidates):
        pressure = candidate.pressure
        sums[row] = float(pressure.sum())
        descents[row] = (approach or 0.0) * sums[row] - inner(pressure, gap)
        pressure = compliance * pressure  # otherwise products with pressures of 1e200 Pa overflow
        for column, other in enumerate(candidates[: row + 1]):
            energies[row, column] = energies[column, row] = inner(pressure, other.displacement)
    # The first pressure carries the load. Along the other axes a multiple of it is subtracted: they carry no load.
    weights = np.zeros(count)
    axes = np.eye(count)
    axes[1:, 0] = -sums[1:] / sums[0]
    if load is not None:
        weights[0] = load / sums[0]
        axes = axes[1:]
    # Along directions of unit energy that are orthogonal to each other, the minima are independent.
    directions = list[np.ndarray]()
    for axis in axes:
        direction = axis
        for former in directions:
            direction = direction - (former @ energies @ direction) * former
        energy = float(direction @ energies @ direction)
        if energy > NEGLIGIBLE * max(float(axis @ energies @ axis), energies[0, 0]):
            directions.append(direction / math.sqrt(energy))
    slopes = descents - energies @ weights
    for direction in directions:
        weights = weights + (slopes @ direction) * direction
    return [float(weight) for weight in weights]
