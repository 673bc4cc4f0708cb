"""The functions of :mod:`roughvisc.mechanics.contact.passes` for arrays of CuPy.

Each pass is a few kernels in CUDA C++. A kernel adds up in a fixed order, so that its sums have the same bits in each
run. Sums that only other kernels need stay on the device: a copy to the host waits for all kernels before it.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from roughvisc.mechanics.contact import passes
from roughvisc.mechanics.contact.free_cells import Free
from roughvisc.mechanics.contact.long_waves import LongWaves
from roughvisc.mechanics.contact.passes import BLOCK_ITERATIONS, BLOCK_TOLERANCE, LONGEST_STEP, Last
from roughvisc.mechanics.grid import COARSE, Grid

try:
    import cupy
except ImportError:  # tools that import every module must work without a GPU
    cupy = None

Array = Any  # an array of CuPy
#: Threads of a block, largest number of blocks, and largest number of sums of a kernel.
THREADS = 256
BLOCKS = 528
SUMS = 10


@cache
def module() -> Any:
    """Return the compiled kernels of ``kernels.cu``."""
    return cupy.RawModule(code=Path(__file__).with_suffix(".cu").read_text())


@cache
def kernel(name: str) -> Any:
    """Return a kernel."""
    return module().get_function(name)


@cache
def space() -> tuple[Array, Array]:
    """Return memory for the sums of the blocks of threads, and for the number of blocks that have ended."""
    return cupy.empty(SUMS * BLOCKS), cupy.zeros(1, np.uint32)


def launch(name: str, count: int, *arguments: Any) -> None:
    """Run a kernel on a number of elements."""
    blocks = max(min(-(-count // THREADS), BLOCKS), 1)
    kernel(name)((blocks,), (THREADS,), (count, *arguments))


def summed(name: str, count: int, *arguments: Any) -> Array:
    """Run a kernel on a number of elements, and return its sums on the device; unused ones are undefined."""
    results = cupy.empty(SUMS)
    launch(name, count, *arguments, *space(), results)
    return results


def measure(
    pressure: Array, separation: Array, gap: Array, cells: Array, level: float, under_load: bool, present: Array | None
) -> Free:
    """Return the free cells with their pressure and residual."""
    ny = gap.shape[1]
    my = -(-ny // COARSE)
    segments = gap.shape[0] * my
    numbers = cupy.empty(segments, np.int64)
    surface = pressure, separation, numbers if present is None else present, int(present is None), ny, my
    contact = summed("contact_level", cells.size, pressure, separation, cells)
    sums = summed("find", segments, *surface, gap, contact, level, int(under_load), numbers).tolist()
    free, touching, total, separations, weighted, undeformed, level, highest, most, least = sums
    count = int(free)
    ends = cupy.cumsum(numbers)
    cells = cupy.empty(count, np.int64)
    loads = cupy.empty(count)
    residual = cupy.empty(count)
    if count == 0:
        return Free(cells, loads, residual, level, 0, 0.0, 0.0, 0.0, level, 0.0, 0.0, 0.0, ends)
    mean = separations / count if under_load else level
    launch("gather", segments, *surface, level, mean, ends, cells, loads, residual)
    size = max(most - mean, mean + least)
    energy = max(weighted - undeformed, 0.0)
    return Free(
        cells, loads, residual, level, int(touching), size, total, highest, -least, most, weighted, energy, ends
    )


class Scatter(passes.Scatter):
    """Fields of zeros that receive the values of some cells."""

    def put(self, field: Array, values: Array, cells: Array, divisor: float | None) -> None:
        """Set the values of some cells."""
        if divisor is None:
            launch("spread", cells.size, field, cells, values)
        else:
            launch("spread_single", cells.size, field, cells, values, divisor)


def block_sums(grid: Grid, found: Free) -> tuple[Array, Array, Array, Array]:
    """Return number, pressure and residual of the free cells of each block, and where the segments of blocks end."""
    blocks = grid.coarse
    free, loads, left = cupy.empty((3, blocks.size))
    shapes = *grid.shape, *blocks.shape
    launch("block_sums", blocks.size, found.held, found.residual, found.ends, *shapes, free, loads, left)
    return free, loads, left, found.ends


def spot_sums(loads: Array, displaced: Array, free: Array, full: float) -> tuple[float, float, float]:
    """Return sums over the blocks: load times displacement, squared load over free cells, free cells of full blocks."""
    along, spread, whole, *_ = summed("spot_sums", loads.size, loads, displaced, free, full).tolist()
    return along, spread, whole


def preconditioned(grid: Grid, found: Free, waves: LongWaves | None, on_grid: Scatter) -> Array:
    """Return a pressure at the free cells that approximately removes the residual."""
    if waves is None:
        return passes.preconditioned(grid, found, None, on_grid)
    cells = found.cells
    count = found.cells.size
    size = found.largest_residual
    direction = cupy.empty(count)
    shapes = (*grid.shape, *waves.blocks.shape)
    launch("rest", count, found.residual, waves.left, waves.free, cells, *shapes, direction)
    solution = grid.inverse(on_grid(direction, cells, size))
    eased = block_pressure(waves)
    total = cupy.empty(waves.blocks.size)
    launch("field_sums", waves.blocks.size, solution, size, cells, waves.place, *shapes, total)
    launch("join", count, solution, size, eased, total, waves.free, cells, *shapes, direction)
    return direction


def block_pressure(waves: LongWaves) -> Array:
    """Solve, by conjugate gradients, for the pressures that displace the blocks by their mean residual.

    The form of [1]_ has one sum less to wait for, and gives the same pressures to rounding.

    References
    ----------
    .. [1] A. T. Chronopoulos, C. W. Gear, J. Comput. Appl. Math. 25 (1989) 153.
    """
    blocks = waves.blocks
    free = waves.free
    local = waves.local
    count = waves.blocks.size
    found, search, moved, response, eased, loads, zeros = cupy.zeros((7, count))
    settings = response, free, local, blocks.self_influence * waves.part, waves.part
    vectors = found, search, moved, waves.left, eased, loads
    first = last = summed("step", count, *settings, zeros, zeros, zeros, zeros, 0.0, *vectors)  # it has no length
    before = zeros
    for _ in range(BLOCK_ITERATIONS):  # once the residual is small, steps have no length
        displaced = blocks.displacement(loads.reshape(blocks.shape))
        curvature = summed("respond", count, displaced, eased, free, local, response)
        taken = summed("step", count, *settings, curvature, last, before, first, BLOCK_TOLERANCE**2, *vectors)
        before, last = last, taken
    return found


def conjugate(
    direction: Array, residual: Array, last: Last | None, on_grid: Scatter, cells: Array, under_load: bool
) -> tuple[Array, float]:
    """Return the direction of the step, and the L1 norm of the preconditioned residual."""
    count = direction.size
    curvature = 0.0
    before = direction
    if last is None:
        sums = direction.sum(keepdims=True)
    else:
        old_cells, old_change, response, curvature = last
        before = on_grid(old_change, old_cells)
        sums = summed("against_last", count, direction, residual, response, before, cells)
    size, *_ = summed("turn", count, direction, before, cells, sums, curvature, int(under_load)).tolist()
    return direction, size


def cut_step(
    held: Array, direction: Array, residual: Array, length: float, load: float | None
) -> tuple[Array, Array, float]:
    """Return the pressure after a step, cut at zero, the change of the pressure, and the slope of the energy."""
    trial = cupy.empty(held.size)
    change = cupy.empty(held.size)
    carried = summed("cut", held.size, held, direction, length, trial)
    slope, ratio, *_ = summed("scale", held.size, held, residual, carried, load or 0.0, trial, change).tolist()
    return trial, change, slope if ratio > 0 else 0.0


def line_search(
    held: Array, trial: Array, change: Array, slope: float, response: Array, cells: Array
) -> tuple[float, float, float]:
    """Return the curvature of the energy along a trial, its fraction at the minimum, and the fraction to take."""
    curvature, empties, steepest, *_ = summed("line_search", held.size, held, trial, change, response, cells).tolist()
    minimum = min(-slope / curvature, LONGEST_STEP) if curvature > 0 else LONGEST_STEP
    if empties > 0:
        return curvature, minimum, 1.0 if minimum > 0.5 else minimum
    return curvature, minimum, min(minimum, 1 / steepest) if minimum > 1 and steepest > 0 else minimum


def advance(
    pressure: Array, separation: Array, cells: Array, step: tuple[Array, Array, Array], response: Array, fraction: float
) -> None:
    """Take a fraction of a trial step: change the pressure at the free cells, and the separation everywhere."""
    launch("put", cells.size, pressure, cells, *step, fraction)
    launch("add", separation.size, separation, response, fraction)
