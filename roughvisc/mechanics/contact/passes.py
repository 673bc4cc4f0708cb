"""Passes of the contact solver over the free cells.

On a GPU they are kernels of :mod:`roughvisc.mechanics.contact.kernels`, which has the same functions: the launch of a
kernel and the copy of a number to the host take longer than most passes. Each pass therefore copies all its sums at
once.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from roughvisc.mechanics.contact.free_cells import Free
from roughvisc.mechanics.contact.long_waves import LongWaves
from roughvisc.mechanics.grid import Grid, namespace

Array = Any  # an array of NumPy or CuPy
#: Cells [index], change, response (whole field) and curvature of the last step.
Last = tuple[Array, Array, Array, float]
#: Largest ratio of a step to its trial: the periodic kernel does not resist a uniform pressure.
LONGEST_STEP = 30.0
#: Number of cells in a block, so that intermediate results stay in the cache.
BLOCK = 1 << 15
#: Reduction of the residual of the equations of the blocks, and largest number of iterations. With four instead of
#: about eight iterations, creep on 1,024 x 1,024 cells needs 3 % more convolutions of the cells and 3 % less time.
BLOCK_TOLERANCE = 0.1
BLOCK_ITERATIONS = 4


def measure(
    pressure: Array, separation: Array, gap: Array, cells: Array, level: float, under_load: bool, present: Array | None
) -> Free:
    """Return the free cells with their pressure and residual.

    Parameters
    ----------
    pressure, separation : array, shape (nx ny,)
        Pressure, and separation at zero approach.
    gap : array, shape (nx, ny)
        Gap without pressure.
    cells : array of int
        Cells that contain the contact; only the kernels of a GPU use them.
    level : float
        Approach if it is given.
    under_load : bool
        Whether the approach follows from the present contact, equation (7) of the paper.
    present : array of bool, shape (nx ny,), or None
        Cells with material; None: all.
    """
    touches = pressure > 0
    contact = touches.nonzero()[0]
    level = float(separation.take(contact).sum()) / contact.size if under_load else level
    free = separation < level
    if present is not None:
        free &= present
    free |= touches
    cells = free.nonzero()[0]
    loads = pressure.take(cells)
    openings = separation.take(cells)
    residual = openings - level
    if not cells.size:
        return Free(cells, loads, residual, level, 0, 0.0, 0.0, 0.0, level, 0.0, 0.0, 0.0)
    mean = float(residual.sum()) / cells.size if under_load else 0.0
    residual -= mean
    highest = float(loads.max())
    least = float(openings.min())
    most = float(openings.max())
    size = max(most - level - mean, mean - (least - level))
    weighted = inner(loads, openings)
    energy = max(weighted - inner(loads, gap.reshape(-1).take(cells)), 0.0)
    total = float(loads.sum())
    return Free(cells, loads, residual, level, contact.size, size, total, highest, least, most, weighted, energy)


def preconditioned(grid: Grid, found: Free, waves: LongWaves | None, on_grid: Scatter) -> Array:
    """Return a pressure at the free cells that approximately removes the residual.

    Parameters
    ----------
    grid : Grid
        Cells.
    found : Free
        The free cells.
    waves : LongWaves or None
        Second level of the preconditioner.
    on_grid : Scatter
        Field on the cells.
    """
    xp = grid.xp
    rest = found.residual
    if waves is not None:
        rest = rest - (waves.left / xp.maximum(waves.free, 1))[waves.place]
    solution = grid.inverse(on_grid(rest, found.cells, found.largest_residual))
    direction = xp.multiply(solution.reshape(-1).take(found.cells), found.largest_residual, dtype=float)
    if waves is not None:
        total = xp.bincount(waves.place, direction, waves.blocks.size)
        direction += (block_pressure(waves) - total / xp.maximum(waves.free, 1))[waves.place]
    return direction


def conjugate(
    direction: Array, residual: Array, last: Last | None, on_grid: Scatter, cells: Array, under_load: bool
) -> tuple[Array, float]:
    """Return the direction of the step, and the L1 norm of the preconditioned residual.

    The direction is conjugate to the last step if it still descends then.

    Parameters
    ----------
    direction, residual : array, shape (n,)
        Preconditioned residual, which is overwritten, and residual, at the free cells.
    last : tuple or None
        The last step.
    on_grid : Scatter
        Field on the cells.
    cells : array of int, shape (n,)
        The free cells.
    under_load : bool
        Whether the direction may not change the load.
    """
    if under_load:
        direction -= direction.sum() / direction.size
    size = float(abs(direction).sum())
    if last is not None:
        old_cells, old_change, response, curvature = last
        beta = inner(direction, response.take(cells)) / curvature
        former = on_grid(old_change, old_cells).reshape(-1).take(cells)
        if under_load:
            former -= former.sum() / former.size
        turned = direction - beta * former
        if beta > 0 and inner(turned, residual) > 0:
            direction = turned
    return direction, size


def cut_step(
    held: Array, direction: Array, residual: Array, length: float, load: float | None
) -> tuple[Array, Array, float]:
    """Return the pressure after a step, cut at zero, the change of the pressure, and the slope of the energy.

    If a load is given, the new pressure is scaled to this sum; the slope is zero if no cell carries pressure.
    """
    trial = namespace(held).maximum(held - length * direction, 0)
    carried = 1.0 if load is None else float(trial.sum()) / load
    if carried == 0:
        return trial, trial - held, 0.0
    trial /= carried
    change = trial - held
    return trial, change, inner(change, residual)


def line_search(
    held: Array, trial: Array, change: Array, slope: float, response: Array, cells: Array
) -> tuple[float, float, float]:
    """Return the curvature of the energy along a trial, its fraction at the minimum, and the fraction to take.

    A trial that empties cells is taken whole if the energy is lower at its end, so that these cells leave the contact.
    A longer step ends where the pressure of a cell becomes zero.

    Parameters
    ----------
    held, trial, change : array, shape (n,)
        Pressure at the free cells before and after the trial, and its change.
    slope : float
        Slope of the energy along the trial.
    response : array, shape (nx ny,)
        Displacement due to the trial.
    cells : array of int, shape (n,)
        The free cells.
    """
    curvature = inner(change, response.take(cells))
    minimum = min(-slope / curvature, LONGEST_STEP) if curvature > 0 else LONGEST_STEP
    if bool(((held > 0) & (trial == 0)).any()):
        return curvature, minimum, 1.0 if minimum > 0.5 else minimum
    if minimum <= 1:
        return curvature, minimum, minimum
    steepest = float((-change / namespace(held).where(held > 0, held, math.inf)).max())
    return curvature, minimum, min(minimum, 1 / steepest) if steepest > 0 else minimum


class Scatter:
    """Fields of zeros that receive the values of some cells."""

    def __init__(self, zeros: Array) -> None:
        #: Field and its present values, in double and in single precision. The same values are not set again.
        self.fields = {False: (zeros, zeros), True: (zeros.astype(np.float32), zeros)}

    def __call__(self, values: Array, cells: Array, divisor: float | None = None) -> Array:
        """Return the field with these values, in single precision if they are divided; the next call overwrites it."""
        is_single = divisor is not None
        field, last = self.fields[is_single]
        if values is not last:
            field[...] = 0
            self.put(field.reshape(-1), values, cells, divisor)
            self.fields[is_single] = field, values
        return field

    def put(self, field: Array, values: Array, cells: Array, divisor: float | None) -> None:
        """Set the values of some cells."""
        field[cells] = values if divisor is None else (values / divisor).astype(np.float32)


def block_sums(grid: Grid, found: Free) -> tuple[Array, Array, Array, Array]:
    """Return number, pressure and residual of the free cells of each block, and the block of each free cell."""
    xp = grid.xp
    place = grid.block_of_cell.take(found.cells)
    count = grid.coarse.size
    free, loads, left = (xp.bincount(place, one, count) for one in (xp.ones(place.size), found.held, found.residual))
    return free, loads, left, place


def spot_sums(loads: Array, displaced: Array, free: Array, full: float) -> tuple[float, float, float]:
    """Return sums over the blocks: load times displacement, squared load over free cells, free cells of full blocks."""
    xp = namespace(free)
    spread = (loads * loads / xp.maximum(free, 1)).sum()
    whole = xp.where(free > full, free, 0).sum()
    return inner(loads, displaced), float(spread), float(whole)


def block_pressure(waves: LongWaves) -> Array:
    """Solve, by conjugate gradients, for the pressures that displace the blocks by their mean residual."""
    blocks = waves.blocks
    left = waves.left
    free = waves.free
    local = waves.local
    part = waves.part
    xp = blocks.xp
    diagonal = xp.where(free > 0, free * local + free * free * blocks.self_influence * part, 1)
    solution = xp.zeros_like(left)
    eased = left / diagonal
    search = eased
    squared = inner(left, eased)
    enough = BLOCK_TOLERANCE**2 * squared
    for _ in range(BLOCK_ITERATIONS):
        if not squared > enough:
            break
        displaced = blocks.displacement((free * search * part).reshape(blocks.shape)).reshape(-1)
        response = free * (displaced + local * search)
        length = squared / inner(search, response)
        solution += length * search
        left = left - length * response
        eased = left / diagonal
        before, squared = squared, inner(left, eased)
        search = eased + squared / before * search
    return solution


def advance(
    pressure: Array, separation: Array, cells: Array, step: tuple[Array, Array, Array], response: Array, fraction: float
) -> None:
    """Take a fraction of a trial step: change the pressure at the free cells, and the separation everywhere.

    Parameters
    ----------
    pressure, separation, response : array, shape (nx ny,)
        Pressure and separation, which are overwritten, and the displacement due to the step.
    cells : array of int, shape (n,)
        The free cells.
    step : tuple of array, shape (n,)
        Their pressure before and after the step, and its change.
    fraction : float
        Part of the step.
    """
    held, trial, change = step
    pressure[cells] = trial if fraction == 1 else namespace(held).maximum(held + fraction * change, 0)
    for start in range(0, separation.size, BLOCK):
        part = slice(start, start + BLOCK)
        separation[part] += fraction * response[part]


def inner(one: Array, other: Array) -> float:
    """Return the inner product. The last bits of the BLAS function would depend on the number of threads."""
    return float((one * other).sum())
