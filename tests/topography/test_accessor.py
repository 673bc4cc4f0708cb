"""The accessor ``h.roughvisc``."""

import inspect
import os
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr
from scan_files import CELL, tilted

import roughvisc as rv
from roughvisc.topography.accessor import METHODS


def test_accessor__chains_steps():
    h = rv.from_array(tilted(), CELL)
    xr.testing.assert_identical(h.roughvisc.level().roughvisc.fill(), rv.fill(rv.level(h)))
    xr.testing.assert_identical(h.roughvisc.crop(x=(0, 1e-5)), rv.crop(h, x=(0, 1e-5)))
    xr.testing.assert_identical(h.roughvisc.combine(h, flip="x"), rv.combine(h, h, flip="x"))
    xr.testing.assert_identical(h.roughvisc.parameters(), rv.parameters(h))


def test_accessor__has_every_step_and_number_with_its_docstring():
    from roughvisc.topography import conditioning

    assert {*conditioning.__all__, "parameters", "psd", "fit_self_affine", "surrogates"} == set(METHODS)
    h = rv.from_array(tilted(), CELL)
    for name in METHODS:
        assert name in dir(h.roughvisc)
        method = getattr(h.roughvisc, name)
        assert method.func is getattr(rv, name)
        assert method.__doc__ == getattr(rv, name).__doc__
        assert "h" not in inspect.signature(method).parameters
    with pytest.raises(AttributeError, match=r"'smooth'.*level"):
        h.roughvisc.smooth  # noqa: B018


HEIGHTS = {
    "a recipe": "h = rv.sphere(1e-3, 2e-4, 5)",
    "an array": "h = rv.from_array([[0.0, 1.0], [1.0, 0.0]], spacing=1.0)",
    "the engine": "h = xr.open_dataarray('scan.sdf', engine='roughvisc')",
    "xarray alone": "import roughvisc.topography; h = xr.DataArray([[0.0, 1.0]])",
}


@pytest.mark.thorough
@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks an interpreter that has imported both")
@pytest.mark.parametrize("first", ["roughvisc as rv, xarray as xr", "xarray as xr, roughvisc as rv"])
def test_accessor__is_there_wherever_heights_are(first, tmp_path):
    """A new interpreter for each source, whose imports are made once."""
    rv.save_scan(rv.sphere(1e-3, 2e-4, 5), tmp_path / "scan.sdf")
    code = (
        f"import {first}\nimport os\nfor source in {list(HEIGHTS.values())!r}:\n"
        "    pid = os.fork()\n    if pid == 0:\n        exec(source)\n"
        "        print(type(h.roughvisc).__name__, flush=True)\n        os._exit(0)\n"
        "    assert os.waitpid(pid, 0)[1] == 0, source\n"
    )
    command = [sys.executable, "-W", "error", "-W", "ignore::ImportWarning", "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert (done.stderr, done.stdout.split()) == ("", ["HeightAccessor"] * len(HEIGHTS))


def test_accessor__is_registered_without_heavy_libraries():
    heavy = {"matplotlib", "dask", "distributed", "SurfaceTopography", "x3pio", "sdfio", "netCDF4", "scipy", "pint"}
    code = (
        "import sys, xarray; before = set(sys.modules); import roughvisc.topography; "
        "assert hasattr(xarray.DataArray, 'roughvisc'); print(*sorted(set(sys.modules) - before))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    added = done.stdout.split()
    assert "roughvisc.topography.accessor" in added
    assert not heavy & {name.split(".")[0] for name in added}


def test_import__leaves_xarray_alone_until_it_is_wanted():
    code = "import sys; finders = [*sys.meta_path]; import roughvisc; " + (
        "print('xarray' in sys.modules, 'numpy' in sys.modules, sys.meta_path == finders)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False False True"


def test_accessor__of_an_array_that_is_no_grid():
    with pytest.raises(rv.InputError, match="level: found dimensions"):
        xr.DataArray(np.eye(3)).roughvisc.level()
