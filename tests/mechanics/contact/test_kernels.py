"""The kernels of a GPU, compiled for the processor, give what the passes of NumPy give on random contacts."""

import ctypes
import shutil
import subprocess
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from roughvisc.mechanics.contact import kernels as kernels_of_a_gpu
from roughvisc.mechanics.contact import passes
from roughvisc.mechanics.grid import Grid

#: One thread of one block, on the processor.
SHIM = """
extern "C" double fmax(double, double);
extern "C" double fabs(double);
#define __global__
#define __shared__
static inline void __syncthreads() {}
static struct { int x; } blockIdx = {0}, blockDim = {1}, threadIdx = {0}, gridDim = {1};
"""


@pytest.fixture(scope="module")
def kernels(tmp_path_factory):
    compiler, folder = shutil.which("c++"), tmp_path_factory.mktemp("kernels")
    if compiler is None:
        pytest.skip("no C++ compiler")

    class RawKernel:
        def __init__(self, source, name):
            library = folder / f"{name}{'float' in source}.so"
            subprocess.run(
                [compiler, "-x", "c++", "-ffp-contract=off", "-shared", "-fPIC", "-o", library, "-"],
                input=(SHIM + source).encode(),
                check=True,
            )
            self.call = getattr(ctypes.CDLL(str(library)), name)

        def __call__(self, blocks, threads, arguments):
            def plain(value):
                if isinstance(value, np.ndarray):
                    assert value.flags.c_contiguous
                    return ctypes.c_void_p(value.ctypes.data)
                return ctypes.c_longlong(value) if isinstance(value, int) else ctypes.c_double(value)

            self.call(*map(plain, arguments))

    class Parts(np.ndarray):
        def get(self):
            return np.asarray(self)

    cupy = SimpleNamespace(
        RawKernel=RawKernel,
        empty=lambda shape, kind=float: np.empty(shape, kind).view(Parts),
        zeros=np.zeros,
        flatnonzero=np.flatnonzero,
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kernels_of_a_gpu, "cupy", cupy)
        patch.setattr(kernels_of_a_gpu, "BLOCKS", 1)
        threads = kernels_of_a_gpu.THREADS
        for value in vars(kernels_of_a_gpu).values():
            if isinstance(value, kernels_of_a_gpu.Kernel):
                source = value._source.replace(f"shared[{threads}]", "shared[1]")
                patch.setattr(value, "_source", source.replace(f"half = {threads} / 2", "half = 0"))
                patch.setattr(value, "_compiled", {})
        yield kernels_of_a_gpu


def same(found, expected):
    for one, other in zip(found, expected, strict=True):
        other = np.asarray(other, dtype=float)
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12 * float(abs(other).max(initial=0)))


@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    seed=st.integers(0, 10**6),
    size=st.integers(1, 60),
    under_load=st.booleans(),
    single=st.booleans(),
    old=st.booleans(),
)
def test_kernels__are_the_passes_of_numpy(kernels, seed, size, under_load, single, old):
    random = np.random.default_rng(seed)
    pressure = np.maximum(random.normal(size=size), 0)
    separation, gap = random.normal(size=size), random.random(size)
    response = random.normal(size=size)
    cells = np.flatnonzero(pressure >= 0)
    level, under_load = float(random.normal()), under_load and bool(pressure.any())
    present = pressure >= 0 if single else None
    both = [one.free_cells(pressure, separation, cells, level, under_load, present) for one in (kernels, passes)]
    same(*both)
    cells, level, _ = both[1]
    both = [one.measure(pressure, separation, gap, cells, level, under_load) for one in (kernels, passes)]
    same(*both)
    if not cells.size:
        return
    held, residual = both[1].held, both[1].residual
    eased = response.astype(np.float32 if single else np.float64)
    same(*([one.taken(eased, cells, 3.0)] for one in (kernels, passes)))
    old_cells = np.sort(random.choice(size, random.integers(1, size + 1), replace=False))
    last = (old_cells, random.normal(size=old_cells.size), response, 0.7) if old else None

    def on_grid(values, places):
        field = np.zeros(size)
        field[places] = values
        return field

    direction = random.normal(size=cells.size)
    both = [one.conjugate(direction.copy(), residual, last, on_grid, cells, under_load) for one in (kernels, passes)]
    same(*both)
    direction = both[1][0]
    load = 1.3 if under_load else None
    both = [one.cut_step(held, direction, residual, 0.3, load) for one in (kernels, passes)]
    same(*both)
    trial, change, _ = both[1]
    for minimum in (0.2, 0.8, 1.5, 20.0):
        slope = -minimum * abs(float(change @ response[cells]))
        same(*(one.line_search(held, trial, change, slope, response, cells) for one in (kernels, passes)))
    for fraction in (0.4, 1.0):
        both = [(pressure.copy(), separation.copy()) for _ in range(2)]
        kernels.advance(*both[0], cells, (held, trial, change), response, fraction)
        passes.advance(*both[1], cells, (held, trial, change), response, fraction)
        same(*both)


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 10**6), shape=st.tuples(st.integers(8, 50), st.integers(8, 50)))
def test_kernels__solve_for_the_blocks_as_numpy_does(kernels, seed, shape):
    random, grid = np.random.default_rng(seed), Grid(shape, (1.0, 1.3), "periodic")
    cells = np.sort(random.choice(grid.size, grid.size // 3, replace=False))
    block, values = grid.block_of_cell.take(cells), random.normal(size=cells.size)
    fields = [one.Scatter(np.zeros(shape)) for one in (kernels, passes)]
    for divisor in (None, 0.3, None):  # the next field overwrites the last one, in another precision
        few = np.sort(random.choice(cells, cells.size // 2, replace=False))
        same(*([one(values[: few.size], few, divisor)] for one in fields))
    sums = [one.block_sums(grid, cells, block, field) for one, field in zip((kernels, passes), fields, strict=True)]
    same(*([one(values)] for one in sums))
    free, loads = sums[1](np.ones(cells.size)), sums[1](abs(values))
    same(*(one.spot_sums(loads, np.sqrt(loads), free) for one in (kernels, passes)))
    left = sums[1](values)
    same(*([one.block_pressure(grid.coarse, left.copy(), free, 0.4, 1 / 64)] for one in (kernels, passes)))
