"""The functions of :mod:`roughvisc.mechanics.contact.passes` for arrays of CuPy.

Each pass is one or two kernels in CUDA C++. A kernel adds up in a fixed order, so that its sums have the same bits in
each run.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import cupy
import numpy as np

from roughvisc.mechanics.contact.passes import Free, Last

Array = Any  # an array of CuPy
#: Threads of a block, and largest number of blocks.
THREADS, BLOCKS = 256, 264
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
    """A kernel over vectors: new vectors, sums and largest values of expressions.

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
        adding = [f"sums[{k}] += {one};" for k, one in enumerate(sums)]
        adding += [f"maxima[{len(sums) + k}] = fmax(maxima[{len(sums) + k}], {one});" for k, one in enumerate(maxima)]
        self._added, self._number, self._compiled = len(sums), max(len(adding), 1), dict[str, Any]()
        self._name, self._source = (
            name,
            SOURCE.format(
                name=name,
                arguments=arguments,
                body=body,
                adding=" ".join(adding),
                number=self._number,
                added=len(sums),
                threads=THREADS,
            ),
        )

    def __call__(self, count: int, *arguments: Any, real: Any = np.float64) -> list[float]:
        """Run the kernel, and return the sums and the largest values."""
        kind = "float" if real == np.float32 else "double"
        if kind not in self._compiled:
            self._compiled[kind] = cupy.RawKernel(self._source.replace("Real", kind), self._name)
        blocks = max(min(-(-count // THREADS), BLOCKS), 1)
        parts = cupy.empty((self._number, blocks))
        self._compiled[kind]((blocks,), (THREADS,), (count, *arguments, parts))
        found = parts.get()
        return [*found[: self._added].sum(axis=1).tolist(), *found[self._added :].max(axis=1).tolist()]


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
    "const double* direction, const double* residual, const Real* response, const double* last, "
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
_inner_at = Kernel(
    "inner_at",
    "const double* values, const Real* field, const long long* cells",
    "",
    sums=("values[i] * (double)field[cells[i]]",),
)
_limit = Kernel(
    "limit",
    "const double* held, const double* trial, const double* change",
    "const double h = held[i], c = change[i];",
    maxima=("h > 0 && trial[i] == 0 ? 1.0 : 0.0", "c < 0 ? -c / h : 0.0"),
)


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
    """Return the values of a field at some cells, times a factor, in double precision."""
    values = cupy.empty(cells.size)
    _take(cells.size, field, cells, factor, values, real=field.dtype)
    return values


def conjugate(
    direction: Array,
    residual: Array,
    last: Last | None,
    on_grid: Callable[[Array, Array], Array],
    cells: Array,
    under_load: bool,
) -> tuple[Array, float]:
    """Return the direction, conjugate to the last step if that descends, and the L1 norm of the direction before."""
    count, beta, former_mean, former = direction.size, 0.0, 0.0, direction
    if last is None:
        mean = float(direction.sum()) / count if under_load else 0.0
    else:
        old_cells, old_change, response, curvature = last
        former = cupy.empty(count)
        before = on_grid(old_change, old_cells)
        sums = _against_last(count, direction, residual, response, before, cells, former, real=response.dtype)
        along, crossed, responses, descent, residuals, changes, descended = sums
        mean = along / count if under_load else 0.0
        former_mean = changes / count if under_load else 0.0
        beta = (crossed - mean * responses) / curvature
        descent -= mean * residuals + beta * (descended - former_mean * residuals)
        beta = beta if beta > 0 and descent > 0 else 0.0
    (size,) = _turn(count, direction, former, mean, beta, former_mean)
    return direction, size


def cut_step(
    held: Array, direction: Array, residual: Array, length: float, under_load: bool
) -> tuple[Array, Array, float]:
    """Return a step along a direction, cut at zero pressure: new pressure, its change, and the slope of the energy."""
    trial, change = cupy.empty(held.size), cupy.empty(held.size)
    (carried,) = _cut(held.size, held, direction, length, trial)
    if under_load and carried == 0:
        return trial, trial - held, 0.0
    (slope,) = _change(held.size, held, residual, carried if under_load else 1.0, trial, change)
    return trial, change, slope


def inner_at(values: Array, field: Array, cells: Array) -> float:
    """Return the inner product of a vector and the values of a field at some cells."""
    return _inner_at(values.size, values, field, cells, real=field.dtype)[0]


def admissible_fraction(held: Array, trial: Array, change: Array, minimum: float) -> tuple[float, bool]:
    """Return the fraction of a trial to take, and whether the limit of zero pressure cut it."""
    empties, steepest = _limit(held.size, held, trial, change)
    if empties > 0:
        return (1.0, minimum > 1) if minimum > 0.5 else (minimum, False)
    limit = 1 / steepest if steepest > 0 else math.inf
    return (min(minimum, limit), minimum > limit) if minimum > 1 else (minimum, False)
