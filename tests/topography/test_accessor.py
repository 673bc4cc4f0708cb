"""The accessor ``h.roughvisc``."""

import inspect
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

    assert {*conditioning.__all__, "parameters", "psd", "fit_self_affine"} == set(METHODS)
    h = rv.from_array(tilted(), CELL)
    for name in METHODS:
        assert name in dir(h.roughvisc)
        method = getattr(h.roughvisc, name)
        assert method.func is getattr(rv, name)
        assert method.__doc__ == getattr(rv, name).__doc__
        assert "h" not in inspect.signature(method).parameters
    with pytest.raises(AttributeError, match=r"'smooth'.*level"):
        h.roughvisc.smooth  # noqa: B018


@pytest.mark.parametrize("order", ["roughvisc, xarray", "xarray, roughvisc"])
def test_accessor__is_there_after_the_import_in_either_order(order):
    code = (
        f"import sys, importlib.util; importlib.util.find_spec('xarray'); import {order}; import numpy as np; "
        "h = xarray.DataArray(np.eye(4), dims=('x', 'y'), coords={'x': np.arange(4.), 'y': np.arange(4.)}); "
        "print(h.roughvisc.level().shape, [f for f in sys.meta_path if 'Xarray' in type(f).__name__])"
    )
    done = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "(4, 4) []"


def test_import__registers_the_accessor_without_heavy_libraries():
    heavy = {"matplotlib", "dask", "distributed", "SurfaceTopography", "x3pio", "sdfio", "netCDF4", "scipy", "pint"}
    code = (
        "import sys, xarray; before = set(sys.modules); import roughvisc; "
        "assert hasattr(xarray.DataArray, 'roughvisc'); print(*sorted(set(sys.modules) - before))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    added = done.stdout.split()
    assert "roughvisc.topography.accessor" in added
    assert not heavy & {name.split(".")[0] for name in added}


def test_import__leaves_xarray_alone_until_it_is_wanted():
    code = "import sys, roughvisc; print('xarray' in sys.modules, 'numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False False"


def test_accessor__of_an_array_that_is_no_grid():
    with pytest.raises(rv.InputError, match="level: found dimensions"):
        xr.DataArray(np.eye(3)).roughvisc.level()
