"""The accessor ``ds.roughvisc``: every observable and figure, wherever the result comes from."""

import inspect

import numpy as np
import pytest
import sample_results as made
import xarray as xr
from matplotlib.figure import Figure

import roughvisc as rv
from roughvisc.runs.netcdf import write_result


def test_accessor__gives_observables_and_figures():
    ds = made.rough_creep((22, 16), frames=3)
    xr.testing.assert_identical(ds.roughvisc.clusters(), rv.observables.clusters(ds))
    figure = ds.roughvisc.plot_maps(times=[-1])
    assert isinstance(figure, Figure)
    assert [len(ax.images) for ax in figure.axes] == [len(ax.images) for ax in rv.plot.maps(ds, times=[-1]).axes]


def test_plot__of_a_file_that_xarray_alone_has_opened(tmp_path):
    ds = made.rough_creep((22, 16), frames=3)
    with xr.open_dataset(write_result(ds, tmp_path / "r.nc")) as plain:
        assert len(plain.roughvisc.plot_maps().axes) == len(rv.plot.maps(ds).axes)
        np.testing.assert_allclose(rv.audit(plain).number, rv.audit(ds).number, rtol=1e-6)


def test_accessor__has_every_name_with_its_docstring():
    accessor = made.one_frame().roughvisc
    for start, module in (("", rv.observables), ("plot_", rv.plot)):
        for name in module.__all__:
            assert f"{start}{name}" in dir(accessor)
            method = getattr(accessor, f"{start}{name}")
            assert method.func is getattr(module, name)
            assert method.__doc__ == getattr(module, name).__doc__
            assert len(inspect.signature(method).parameters) < len(inspect.signature(method.func).parameters)
    for name in ("plot_everything", "smooth", "_repr_html_"):
        with pytest.raises(AttributeError, match=name):
            getattr(accessor, name)
