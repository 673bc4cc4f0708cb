"""First guess of the contact of a step: the best combination of pressures whose displacements are known.

The contact solver minimises the energy ``compliance p.Kp/2 + gap.p`` over the pressures ``p >= 0`` of a step. The
minimum over the combinations of a few pressures with known displacements ``Kp`` costs no convolution [1]_. The
combination may be negative in some cells: the solver sets them to zero.

.. [1] P. F. Fischer, Projection techniques for iterative solution of Ax = b with successive right-hand sides, Computer
   Methods in Applied Mechanics and Engineering 163 (1998) 193.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from roughvisc.mechanics.contact.passes import inner
from roughvisc.mechanics.scene import Packed, unpacked

Array = Any  # an array of NumPy or CuPy

#: A direction whose energy is at most this part of the energy of the first pressure is due to rounding.
ROUNDING = 1e-12


class Known(NamedTuple):
    """Pressure that a first guess may contain.

    Attributes
    ----------
    stored_pressure : array, shape (nx, ny), or Packed
        Pressure. [Pa]
    displacement : array, shape (nx, ny)
        Displacement per unit compliance, ``Kp``; not used if the kernel depends on the step. [m Pa]
    weight : float
        Weight in the guess if displacements are not used.
    """

    stored_pressure: Array | Packed
    displacement: Array
    weight: float

    @property
    def pressure(self) -> Array:
        """Pressure at all cells, shape (nx, ny). [Pa]"""
        return unpacked(self.stored_pressure)


def combination(known: Sequence[Known], weights: Sequence[float], *, of_displacement: bool = False) -> Array:
    """Return the combination of the pressures [Pa], or of the displacements [m Pa], with weights."""
    total: Array = 0.0
    for one, weight in zip(known, weights, strict=True):
        total = total + weight * (one.displacement if of_displacement else one.pressure)
    return total


def best_weights(
    known: Sequence[Known], compliance: float, gap: Array, *, load: float | None = None, approach: float | None = None
) -> list[float]:
    """Return the weights of the combination that has the least energy, and the load if one is given.

    Parameters
    ----------
    known : sequence of Known
        Pressures with their displacements; the first pressure must not vanish.
    compliance : float
        Compliance of the step. [1/Pa]
    gap : array, shape (nx, ny)
        Gap without pressure in the step at zero approach; finite. [m]
    load, approach : float
        Sum of the pressure over the cells [Pa], or approach [m]; exactly one.
    """
    sums, slopes = np.zeros((2, len(known)))
    energies = np.zeros((len(known), len(known)))
    for row, one in enumerate(known):
        pressure = one.pressure
        sums[row] = float(pressure.sum())
        slopes[row] = (approach or 0.0) * sums[row] - inner(pressure, gap)
        energies[row] = [inner(pressure, other.displacement) for other in known]
    energies = compliance * (energies + energies.T) / 2
    # The first pressure, which carries the load, and directions that do not change the load.
    directions = np.eye(len(known))
    directions[0, 1:] = -sums[1:] / sums[0]
    begin = np.zeros(len(known))
    if load is not None:
        begin[0] = load / sums[0]
        directions = directions[:, 1:]
    sizes = np.sqrt(np.maximum(np.einsum("ij,ik,kj->j", directions, energies, directions), 0.0))
    counts = sizes**2 > ROUNDING * energies[0, 0]
    directions = directions[:, counts] / sizes[counts]
    parts = np.linalg.lstsq(
        directions.T @ energies @ directions, directions.T @ (slopes - energies @ begin), rcond=ROUNDING
    )[0]
    return [float(weight) for weight in begin + directions @ parts]
