"""Result of the contact solver: pressure, displacement, approach, load and their errors."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


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
        Bound on the relative error of the pressure in the energy norm, ``sqrt(2 G / p.Kp)`` with the duality gap ``G``.
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

    pressure: NDArray[np.float64]
    displacement: NDArray[np.float64]
    approach: float
    load: float
    bound: float
    converged: bool
    iterations: int
    convolutions: int
    error: float = math.nan
