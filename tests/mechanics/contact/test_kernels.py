"""The kernels of a GPU, compiled for the processor, give what the passes of NumPy give on random contacts."""

import ctypes
import re
import shutil
import subprocess
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from roughvisc.mechanics.contact import kernels as kernels_of_a_gpu
from roughvisc.mechanics.contact import long_waves, passes, solver
from roughvisc.mechanics.contact.long_waves import LongWaves
from roughvisc.mechanics.grid import Grid


@pytest.fixture(scope="module")
def kernels(tmp_path_factory):
    compiler, library = shutil.which("c++"), tmp_path_factory.mktemp("kernels") / "kernels.so"
    if compiler is None:
        pytest.skip("no C++ compiler")
    source = Path(kernels_of_a_gpu.__file__).with_suffix(".cu").read_text()
    parts = [Path(__file__).with_name("cuda.h").read_text(), source.replace('extern "C" __global__', "static")]
    for name, parameters in re.findall(r"__global__ void (\w+)\((.*?)\) \{", source, re.DOTALL):
        names = ", ".join(re.findall(r"(\w+)(?:,|$)", parameters)).replace("SUM_ARGUMENTS", "parts, ended, results")
        parts.append(f'extern "C" void run_{name}(int blocks, int threads, {parameters}) {{')
        parts.append(f"run(blocks, threads, [=] {{ {name}({names}); }}); }}")
    flags = ["-x", "c++", "-ffp-contract=off", "-pthread", "-shared", "-fPIC"]
    subprocess.run([compiler, *flags, "-o", library, "-"], input="\n".join(parts).encode(), check=True)

    def plain(value):
        if isinstance(value, np.ndarray):
            assert value.flags.c_contiguous
            return ctypes.c_void_p(value.ctypes.data)
        return ctypes.c_longlong(value) if isinstance(value, int) else ctypes.c_double(value)

    def get_function(name):
        call = getattr(ctypes.CDLL(str(library)), f"run_{name}")
        return lambda blocks, threads, arguments: call(*blocks, *threads, *map(plain, arguments))

    cupy = SimpleNamespace(empty=np.empty, zeros=np.zeros, cumsum=np.cumsum)
    cupy.RawModule = lambda code: SimpleNamespace(get_function=get_function)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kernels_of_a_gpu, "cupy", cupy)
        patch.setattr(kernels_of_a_gpu, "THREADS", 4)
        patch.setattr(kernels_of_a_gpu, "BLOCKS", 3)
        yield kernels_of_a_gpu
        for cached in (kernels_of_a_gpu.module, kernels_of_a_gpu.kernel, kernels_of_a_gpu.space):
            cached.cache_clear()


def same(kernels, call):
    """Compare what a call gives with the kernels and with the passes of NumPy, and return the latter."""
    found, expected = call(kernels), call(passes)
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12 * float(np.max(np.abs(other), initial=0)))
    return expected


@settings(max_examples=50, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    shape=st.tuples(st.integers(1, 6), st.integers(1, 20)),
    under_load=st.booleans(),
    partial=st.booleans(),
    old=st.booleans(),
)
def test_kernels__are_the_passes_of_numpy(kernels, seed, shape, under_load, partial, old):
    random, size = np.random.default_rng(seed), shape[0] * shape[1]
    pressure = np.maximum(random.normal(size=size), 0)
    separation, response, gap = random.normal(size=size), random.normal(size=size), random.random(shape)
    level, under_load = float(random.normal()), under_load and bool(pressure.any())
    present = (pressure > 0) | (random.random(size) > 0.3) if partial else None
    given = pressure, separation, gap, np.arange(size), level, under_load, present
    cells, held, residual, *_ = same(kernels, lambda one: one.measure(*given)[:-1])
    assume(cells.size > 0)
    old_cells = np.sort(random.choice(size, random.integers(1, size + 1), replace=False))
    last = (old_cells, random.normal(size=old_cells.size), response, 0.7) if old else None
    direction = random.normal(size=cells.size)
    rest = residual, last, passes.Scatter(np.zeros(size)), cells, under_load
    direction, _ = same(kernels, lambda one: one.conjugate(direction.copy(), *rest))
    load = 1.3 if under_load else None
    trial, change, _ = same(kernels, lambda one: one.cut_step(held, direction, residual, 0.3, load))
    for minimum in (0.2, 0.8, 1.5, 20.0):
        slope = -minimum * abs(float(change @ response[cells]))
        same(kernels, lambda one, slope=slope: one.line_search(held, trial, change, slope, response, cells))


@settings(max_examples=30, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    shape=st.tuples(st.integers(8, 50), st.integers(8, 50)),
    contact=st.floats(0.05, 0.9),
)
def test_kernels__precondition_as_numpy_does(kernels, seed, shape, contact):
    random, grid = np.random.default_rng(seed), Grid(shape, (1.0, 1.3), "periodic")
    fields = {one: one.Scatter(np.zeros(shape)) for one in (kernels, passes)}
    for divisor in (None, 0.3, None):  # the next field overwrites the last one of its precision
        cells, values = np.flatnonzero(random.random(grid.size) < 0.5), random.normal(size=grid.size)
        same(kernels, lambda one, chosen=(values[: cells.size], cells, divisor): [fields[one](*chosen)])
    pressure, separation = (random.random(grid.size) < contact).astype(float), random.normal(size=grid.size)
    given = pressure, separation, np.zeros(shape), np.arange(grid.size), 0.0, False, None
    found = {one: one.measure(*given) for one in (kernels, passes)}
    free, loads, left = same(kernels, lambda one: one.block_sums(grid, found[one])[:3])
    same(kernels, lambda one: one.spot_sums(loads, np.sqrt(abs(loads)), free, 50.0))
    for waves in (False, True):
        directions = []
        for one, on_grid in fields.items():
            place = one.block_sums(grid, found[one])[3]
            level = LongWaves(grid.coarse, place, free, left.copy(), 1 / 64, 0.4) if waves else None
            directions.append(one.preconditioned(grid, found[one], level, on_grid))
        np.testing.assert_allclose(*directions, rtol=1e-5, atol=1e-5 * float(abs(directions[1]).max()))


@pytest.mark.parametrize("given", [{"load": 2.0}, pytest.param({"approach": 0.8}, marks=pytest.mark.thorough)])
@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_kernels__solve_contact_as_numpy_does(kernels, monkeypatch, given, boundary):
    monkeypatch.setattr(solver, "BLOCKS_FROM", 30)
    monkeypatch.setattr(long_waves, "SPOTS", 1.0)
    random, (nx, ny) = np.random.default_rng(1), (47, 64)
    gap, present = random.random((nx, ny)), random.random((nx, ny)) < 0.9
    found = []
    for one in (passes, kernels):
        monkeypatch.setattr(solver, "host", one)
        grid = Grid((nx, ny), (0.9, 1.1), boundary)
        found.append(solver.solve_contact(grid, gap, tolerance=1e-10, present=present, **given))
    for one, other in zip(*(state[:4] for state in found), strict=True):  # pressure, displacement, approach, load
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9 * float(np.abs(other).max()))
    assert abs(found[0].iterations - found[1].iterations) <= 1
