"""The functions of :mod:`roughvisc.mechanics.contact.passes` for arrays of CuPy.

Each pass is one or two kernels in CUDA C++. A kernel adds up in a fixed order, so that its sums have the same bits in
each run.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from roughvisc.mechanics.contact.passes import BLOCK_ITERATIONS, BLOCK_TOLERANCE, LONGEST_STEP, Free, Last
from roughvisc.mechanics.grid import Grid

try:
    import cupy
except ImportError:  # tools that import every module need no GPU
    cupy = None

Array = Any  # an array of CuPy
#: Threads of a block, and largest number of blocks.
THREADS, BLOCKS = 256, 528
#: A kernel: each thread adds up its elements, then each block its threads; the sums of the blocks go to the host.
SOURCE = """
extern "C" __global__ void {name}(const long long count, {arguments}, double* parts) {{
    double sums[{number}], maxima[{number}];
    for (int k = 0; k < {number}; ++k) {{ sums[k] = 0; maxima[k] = -1.0 / 0.0; }}
    for (long long i = blockIdx.x * (long long)blockDim.x + threadIdx.x; i < count;
         i += (long long)gridDim.x * blockDim.x) {{
        {body}
        {adding}
    }}
    __shared__ double shared[{threads}];
    for (int k = 0; k < {number}; ++k) {{
        const bool is_sum = k < {added};
        shared[threadIdx.x] = is_sum ? sums[k] : maxima[k];
        for (int half = {threads} / 2; half > 0; half /= 2) {{
            __syncthreads();
            if (threadIdx.x < half) {{
                const double mine = shared[threadIdx.x], other = shared[threadIdx.x + half];
                shared[threadIdx.x] = is_sum ? mine + other : fmax(mine, other);
            }}
        }}
        if (threadIdx.x == 0) parts[k * gridDim.x + blockIdx.x] = shared[0];
        __syncthreads();
    }}
}}
"""


class Kernel:
    """Kernel that computes new vectors, and returns sums and largest values of expressions.

    Parameters
    ----------
    name : str
        Name.
    arguments : str
        Parameters in CUDA C++ after the number of elements; ``Real`` is the type of a field in either precision.
    body : str
        Statements for the element ``i``.
    sums, maxima : sequence of str
        Expressions of an element, of which the sum and the largest value are returned.
    """

    def __init__(
        self, name: str, arguments: str, body: str, sums: Sequence[str] = (), maxima: Sequence[str] = ()
    ) -> None:
        lines = [f"sums[{k}] += {one};" for k, one in enumerate(sums)]
        lines += [f"maxima[{k}] = fmax(maxima[{k}], {one});" for k, one in enumerate(maxima, len(sums))]
        number, adding = max(len(lines), 1), " ".join(lines)
        self._name, self._sums, self._returned = name, len(sums), len(lines)
        self._compiled: dict[str, Any] = {}
        self._source = SOURCE.format(
            name=name, arguments=arguments, body=body, adding=adding, number=number, added=len(sums), threads=THREADS
        )

    def __call__(self, count: int, *arguments: Any, real: Any = np.float64) -> list[float]:
        """Run the kernel, and return the sums and the largest values."""
        kind = "float" if real == np.float32 else "double"
        if kind not in self._compiled:
            self._compiled[kind] = cupy.RawKernel(self._source.replace("Real", kind), self._name)
        blocks = max(min(-(-count // THREADS), BLOCKS), 1)
        parts = cupy.empty((max(self._returned, 1), blocks))
        self._compiled[kind]((blocks,), (THREADS,), (count, *arguments, parts))
        if not self._returned:
            return []  # without waiting for the device
        found = parts.get()
        return [*found[: self._sums].sum(axis=1).tolist(), *found[self._sums :].max(axis=1).tolist()]


_contact_level = Kernel(
    "contact_level",
    "const double* pressure, const double* separation, const long long* cells",
    "const long long cell = cells[i]; const bool touches = pressure[cell] > 0;",
    sums=("touches ? separation[cell] : 0.0", "touches ? 1.0 : 0.0"),
)
_may_change = Kernel(
    "may_change",
    "const double* pressure, const double* separation, const double level, bool* free",
    "free[i] = separation[i] < level || pressure[i] > 0;",
)
_clear = Kernel("clear", "Real* field, const long long* cells", "field[cells[i]] = 0;")
_spread = Kernel(
    "spread",
    "Real* field, const long long* cells, const double* values, const double divisor",
    "field[cells[i]] = (Real)(values[i] / divisor);",
)
_measure = Kernel(
    "measure",
    "const double* pressure, const double* separation, const double* gap, const long long* cells, "
    "double* held, double* residual",
    "const long long cell = cells[i]; const double p = pressure[cell], s = separation[cell], g = gap[cell]; "
    "held[i] = p; residual[i] = s;",
    sums=("p", "s", "p * s", "p * g"),
    maxima=("p", "s", "-s"),
)
_take = Kernel(
    "take",
    "const Real* field, const long long* cells, const double factor, double* values",
    "values[i] = factor * (double)field[cells[i]];",
)
_against_last = Kernel(
    "against_last",
    "const double* direction, const double* residual, const double* response, const double* last, "
    "const long long* cells, double* former",
    "const double d = direction[i], r = residual[i], f = last[cells[i]]; const double u = response[cells[i]]; "
    "former[i] = f;",
    sums=("d", "d * u", "u", "d * r", "r", "f", "f * r"),
)
_turn = Kernel(
    "turn",
    "double* direction, const double* former, const double mean, const double beta, const double former_mean",
    "const double d = direction[i] - mean; direction[i] = beta > 0 ? d - beta * (former[i] - former_mean) : d;",
    sums=("fabs(d)",),
)
_cut = Kernel(
    "cut",
    "const double* held, const double* direction, const double length, double* trial",
    "const double t = fmax(held[i] - length * direction[i], 0.0); trial[i] = t;",
    sums=("t",),
)
_change = Kernel(
    "change",
    "const double* held, const double* residual, const double carried, double* trial, double* change",
    "const double t = trial[i] / carried, c = t - held[i]; trial[i] = t; change[i] = c;",
    sums=("c * residual[i]",),
)
_line_search = Kernel(
    "line_search",
    "const double* held, const double* trial, const double* change, const double* response, const long long* cells",
    "const double h = held[i], c = change[i];",
    sums=("c * response[cells[i]]",),
    maxima=("h > 0 && trial[i] == 0 ? 1.0 : 0.0", "c < 0 ? -c / h : 0.0"),
)
_put = Kernel(
    "put",
    "double* pressure, const long long* cells, const double* held, const double* trial, const double* change, "
    "const double fraction",
    "pressure[cells[i]] = fraction == 1 ? trial[i] : fmax(held[i] + fraction * change[i], 0.0);",
)
_add = Kernel("add", "double* field, const double* change, const double fraction", "field[i] += fraction * change[i];")
_block_sums = Kernel(
    "block_sums",
    "const double* field, const long long nx, const long long ny, const long long mx, const long long my, "
    "double* found",
    "const long long x = i / my, y = i % my; double total = 0; "
    "for (long long r = (x * nx + mx - 1) / mx; r < ((x + 1) * nx + mx - 1) / mx; ++r) "
    "for (long long c = (y * ny + my - 1) / my; c < ((y + 1) * ny + my - 1) / my; ++c) total += field[r * ny + c]; "
    "found[i] = total;",
)
_spot_sums = Kernel(
    "spot_sums",
    "const double* loads, const double* displaced, const double* free",
    "const double l = loads[i];",
    sums=("l * displaced[i]", "l * l / fmax(free[i], 1.0)"),
)
_respond = Kernel(
    "respond",
    "const double* displaced, const double* search, const double* free, const double local, double* response",
    "const double r = free[i] * (displaced[i] + local * search[i]); response[i] = r;",
    sums=("search[i] * r",),
)
_advance = Kernel(
    "advance",
    "const double* search, const double* response, const double* free, const double local, const double own, "
    "const double length, double* found, double* left, double* eased",
    "const double n = free[i], l = left[i] - length * response[i], e = l / (n > 0 ? n * local + n * n * own : 1.0); "
    "found[i] += length * search[i]; left[i] = l; eased[i] = e;",
    sums=("l * e",),
)
_turn_search = Kernel(
    "turn_search",
    "const double* eased, const double ratio, const double* free, const double part, double* search, double* loads",
    "const double s = eased[i] + ratio * search[i]; search[i] = s; loads[i] = free[i] * s * part;",
)


def free_cells(
    pressure: Array, separation: Array, cells: Array, level: float, under_load: bool, present: Array | None
) -> tuple[Array, float, int]:
    """Return the cells that carry pressure or penetrate, the approach, and the number of cells in contact."""
    separations, touching = _contact_level(cells.size, pressure, separation, cells)
    level = separations / touching if under_load else level
    free = cupy.empty(pressure.size, bool)
    _may_change(pressure.size, pressure, separation, level, free)
    if present is not None:
        free &= present
    return cupy.flatnonzero(free), level, int(touching)


def measure(pressure: Array, separation: Array, gap: Array, cells: Array, level: float, under_load: bool) -> Free:
    """Return pressure and residual at the free cells; under a load the residual has no mean."""
    count, held, residual = cells.size, cupy.empty(cells.size), cupy.empty(cells.size)
    sums = _measure(count, pressure, separation, gap, cells, held, residual)
    total, separations, weighted, undeformed, highest, most, least = sums
    if count == 0:
        return Free(held, residual, 0.0, 0.0, 0.0, level, 0.0, 0.0, 0.0)
    level = separations / count if under_load else level
    residual -= level
    size = max(most - level, level + least)
    return Free(held, residual, size, total, max(highest, 0.0), -least, most, weighted, max(weighted - undeformed, 0.0))


def taken(field: Array, cells: Array, factor: float) -> Array:
    """Return the values of a field at given cells, multiplied by a factor, in double precision."""
    values = cupy.empty(cells.size)
    _take(cells.size, field, cells, factor, values, real=field.dtype)
    return values


def conjugate(
    direction: Array, residual: Array, last: Last | None, on_grid: Scatter, cells: Array, under_load: bool
) -> tuple[Array, float]:
    """Return the direction of the step, and the L1 norm of the preconditioned residual."""
    count, beta, former_mean, former = direction.size, 0.0, 0.0, direction
    if last is None:
        mean = float(direction.sum()) / count if under_load else 0.0
    else:
        old_cells, old_change, response, curvature = last
        former = cupy.empty(count)
        before = on_grid(old_change, old_cells)
        sums = _against_last(count, direction, residual, response, before, cells, former)
        along, crossed, responses, descent, residuals, changes, descended = sums
        mean = along / count if under_load else 0.0
        former_mean = changes / count if under_load else 0.0
        beta = (crossed - mean * responses) / curvature
        descent -= mean * residuals + beta * (descended - former_mean * residuals)
        beta = beta if beta > 0 and descent > 0 else 0.0
    (size,) = _turn(count, direction, former, mean, beta, former_mean)
    return direction, size


def cut_step(
    held: Array, direction: Array, residual: Array, length: float, load: float | None
) -> tuple[Array, Array, float]:
    """Return the pressure after a step, cut at zero, the change of the pressure, and the slope of the energy."""
    trial, change = cupy.empty(held.size), cupy.empty(held.size)
    (carried,) = _cut(held.size, held, direction, length, trial)
    if load is not None and carried == 0:
        return trial, trial - held, 0.0
    (slope,) = _change(held.size, held, residual, 1.0 if load is None else carried / load, trial, change)
    return trial, change, slope


def line_search(
    held: Array, trial: Array, change: Array, slope: float, response: Array, cells: Array
) -> tuple[float, float, float]:
    """Return the curvature of the energy along a trial, the fraction of it at the minimum, and the fraction to take."""
    curvature, empties, steepest = _line_search(held.size, held, trial, change, response, cells)
    minimum = min(-slope / curvature, LONGEST_STEP) if curvature > 0 else LONGEST_STEP
    if empties > 0:
        return curvature, minimum, 1.0 if minimum > 0.5 else minimum
    return curvature, minimum, min(minimum, 1 / steepest) if minimum > 1 and steepest > 0 else minimum


def advance(
    pressure: Array, separation: Array, cells: Array, step: tuple[Array, Array, Array], response: Array, fraction: float
) -> None:
    """Take a fraction of a trial step: change the pressure at the free cells, and the separation everywhere."""
    _put(cells.size, pressure, cells, *step, fraction)
    _add(separation.size, separation, response, fraction)


class Scatter:
    """Field of zeros that receives the values of some cells."""

    def __init__(self, zeros: Array) -> None:
        self.zeros, self.flat, self.cells = zeros, zeros.reshape(-1), cupy.empty(0, int)

    def __call__(self, values: Array, cells: Array, divisor: float | None = None) -> Array:
        """Return the field with these values, in single precision if they are divided; the next call overwrites it."""
        _clear(self.cells.size, self.flat, self.cells, real=self.flat.dtype)
        kind = np.float64 if divisor is None else np.float32
        self.flat, self.cells = self.zeros.reshape(-1).view(kind)[: self.zeros.size], cells
        _spread(cells.size, self.flat, cells, values, 1.0 if divisor is None else divisor, real=kind)
        return self.flat.reshape(self.zeros.shape)


def block_sums(grid: Grid, cells: Array, block: Array, on_grid: Scatter) -> Callable[[Array], Array]:
    """Return a function that sums the values of the free cells over the blocks of the coarse grid."""

    def sums(values: Array) -> Array:
        found = cupy.empty(grid.coarse.size)
        _block_sums(found.size, on_grid(values, cells), *grid.shape, *grid.coarse.shape, found)
        return found

    return sums


def spot_sums(loads: Array, displaced: Array, free: Array) -> tuple[float, float]:
    """Return the sums of the loads of blocks times their displacement, and of their squares over the free cells."""
    along, spread = _spot_sums(loads.size, loads, displaced, free)
    return along, spread


def block_pressure(blocks: Grid, left: Array, free: Array, local: float, part: float) -> Array:
    """Solve, by conjugate gradients, for the pressures that displace the blocks by their mean residual."""
    count, own, ratio = left.size, blocks.self_influence * part, 0.0
    found, search, response, eased, loads = (cupy.zeros(count) for _ in range(5))
    (squared,) = _advance(count, search, response, free, local, own, 0.0, found, left, eased)
    enough = BLOCK_TOLERANCE**2 * squared
    for _ in range(BLOCK_ITERATIONS):
        if not squared > enough:
            break
        _turn_search(count, eased, ratio, free, part, search, loads)
        displaced = blocks.displacement(loads.reshape(blocks.shape))
        (curvature,) = _respond(count, displaced, search, free, local, response)
        length, before = squared / curvature, squared
        (squared,) = _advance(count, search, response, free, local, own, length, found, left, eased)
        ratio = squared / before
    return found
