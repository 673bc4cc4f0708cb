"""The algorithm of the paper, with its errors corrected. Tests compare this package with it; no solve uses it.

"A robust algorithm for the contact of viscoelastic materials" presses a profile in equal steps of time: rectangle rule,
one convolution for each past increment of pressure, plain conjugate gradients from uniform pressure, stopped when the
pressure stagnates. Numbers in brackets are the equations of the paper; "printed" marks a corrected statement
(docs/theory.md, "Errors in the paper").
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import ConvergenceError
from roughvisc.mechanics.grid import Grid

Array = NDArray[np.float64]


def press(
    grid: Grid,
    gap: Array,
    compliance: Callable[[float], float],
    load: Callable[[float], float],
    times: Sequence[float],
    *,
    epsilon: float = 1e-5,
) -> Iterator[tuple[float, Array, float]]:
    """Press a profile on a viscoelastic half-space under a given load.

    The rectangle rule is stable only while ``sum J_i tanh(h / 2 tau_i) + phi h / 2 < J_0``, with a step ``h``,
    retardation times ``tau_i``, and a fluidity ``phi``.

    Parameters
    ----------
    grid : Grid
        Cells of the half-space.
    gap : ndarray, shape (nx, ny)
        Undeformed gap. [m]
    compliance : callable
        Contact compliance [1/Pa] by the age [s]; half of the compliance in the paper.
    load : callable
        Normal force [N] by the time [s].
    times : sequence of float
        Times in equal steps from zero, at which the load may jump. [s]
    epsilon : float
        A contact is solved once an iteration changes the pressure by less than this part of the load.

    Yields
    ------
    time : float
        Time of the step. [s]
    pressure : ndarray, shape (nx, ny)
        Pressure. [Pa]
    approach : float
        Level of the rigid profile. [m]

    Raises
    ------
    ConvergenceError
        If the pressure of a step does not stagnate.
    """
    # (17) Printed: C at the first lag. The present increment has lag 0, and the load may jump.
    at_once = compliance(0.0)
    pressure = np.zeros_like(gap)
    increments: list[Array] = []  # (5) Printed: from n = 2. The first increment is applied at the first time.
    for time in times:
        # (5) Printed: up to the last step, with a kernel of unit force. An increment acts from its step on. The present
        # increment is new pressure minus last pressure, and only the second part is known yet.
        past = -at_once * grid.displacement(pressure)
        for began, increment in zip(times, increments, strict=False):
            past += grid.displacement(compliance(time - began) * increment)
        solution, approach, _ = conjugate_gradients(grid, gap + past, at_once, load(time), epsilon=epsilon)
        increments.append(solution - pressure)
        pressure = solution
        yield time, pressure, approach


def conjugate_gradients(
    grid: Grid,
    gap: Array,
    compliance: float,
    load: float,
    *,
    epsilon: float = 1e-5,
    sign: float = 1.0,
    most: int = 3000,
) -> tuple[Array, float, int]:
    """Elastic contact under a load, (1) to (4), by the iteration (6) to (16).

    Returns the pressure [Pa], the level of the rigid profile [m] and the number of iterations, at most ``most``.
    ``gap`` excludes the displacement by the present pressure [m]; ``compliance`` is for the present increment [1/Pa].
    ``sign`` is the sign in (9); with the printed sign, -1, the iteration does not converge.
    """
    if load == 0:
        return np.zeros_like(gap), float(np.min(gap)), 0
    pressure = np.full(gap.shape, load / (grid.cell_area * gap.size))  # (1), uniform
    direction = np.zeros_like(gap)
    last = 1.0
    restart = True
    for iteration in range(1, most + 1):
        touching = pressure > 0  # (3) Printed: all points
        opening = gap + compliance * grid.displacement(pressure)  # (2)
        opening -= np.mean(opening[touching])  # (7) Printed: mean over all points
        residual = np.where(touching, opening, 0.0)
        norm = float(np.sum(residual**2))  # (8)
        # (9) Printed: a minus. The residual is the gradient, and (12) goes against the direction.
        factor = 0.0 if restart else sign * norm / last
        direction, last = np.where(touching, residual + factor * direction, 0.0), norm
        # (11) Printed: the kernel at the lag of the whole time, which makes steps too short.
        change = compliance * grid.displacement(direction)
        change -= np.mean(change[touching])  # (10) Printed: no mean
        curvature = float(np.sum(direction * change))
        length = float(np.sum(residual * direction)) / curvature if curvature else 0.0  # (11)
        before = pressure
        pressure = np.maximum(pressure - length * direction, 0.0)  # (12), (13)
        penetrating = (pressure == 0) & (opening < 0)  # (4) Printed: opening > 0 outside. It may be 0.
        pressure[penetrating] -= length * opening[penetrating]  # (14)
        restart = bool(np.any(penetrating))
        total = grid.cell_area * float(np.sum(pressure))
        if total == 0:
            break
        pressure *= load / total  # (15) Printed: without the cell's area, as (16)
        if grid.cell_area * np.sum(np.abs(pressure - before)) <= epsilon * load:  # (16)
            displaced = gap + compliance * grid.displacement(pressure)
            return pressure, float(np.mean(displaced[pressure > 0])), iteration
    raise ConvergenceError(f"the paper's iteration does not stagnate in {iteration} steps: expected a larger epsilon")
