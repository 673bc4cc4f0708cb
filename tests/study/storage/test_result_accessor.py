"""The accessor ``ds.roughvisc``: every observable and figure, wherever the result comes from."""

import inspect
import os
import subprocess
import sys

import pytest
import sample_results as made
import xarray as xr
from matplotlib.figure import Figure
from support import BALL

import roughvisc as rv
from roughvisc.study.storage.netcdf import write_result


def test_accessor__gives_observables_and_figures():
    ds = made.rough_creep((22, 16), frames=3)
    xr.testing.assert_identical(ds.roughvisc.clusters(), rv.observables.clusters(ds))
    figure = ds.roughvisc.plot_maps(times=[-1])
    assert isinstance(figure, Figure)
    assert [len(ax.images) for ax in figure.axes] == [len(ax.images) for ax in rv.plot.maps(ds, times=[-1]).axes]
    assert ds.roughvisc.history().sizes == {"time": 3}, "an observable, where a figure is of the same name"


def test_plot__of_a_file_that_xarray_alone_has_opened(tmp_path):
    ds = made.rough_creep((22, 16), frames=3)
    with xr.open_dataset(write_result(ds, tmp_path / "r.nc")) as plain:
        assert len(plain.roughvisc.plot_maps().axes) == len(rv.plot.maps(ds).axes)
        assert [one.number for one in rv.audit(plain)] == pytest.approx([o.number for o in rv.audit(ds)], nan_ok=True)


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


RESULTS = {
    "simulated": "ds = rv.simulate(rv.sphere(1e-3, 2e-4, (12, 9)), rv.elastic(1e6), rv.Program().load(1e-5, over=0), "
    "tolerance=1e-2, progress=False)",
    "run": "ds = rv.run('ball.toml', 'out', progress=False)",
    "opened": "ds = rv.open_results('there')",
    "xarray alone": "import roughvisc.study.storage; ds = xr.Dataset()",
}


@pytest.mark.thorough
@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks an interpreter that has imported both")
def test_accessor__is_there_wherever_results_are(tmp_path):
    """A new interpreter for each source, whose imports are made once; nothing heavy comes with the last."""
    (tmp_path / "ball.toml").write_text(BALL.replace("[24, 21]", "[12, 9]"))
    rv.run(tmp_path / "ball.toml", tmp_path / "there", progress=False)
    code = (
        f"import roughvisc as rv, xarray as xr, os, sys\nfor source in {list(RESULTS.values())!r}:\n"
        "    pid = os.fork()\n    if pid == 0:\n        exec(source)\n"
        "        print(type(ds.roughvisc).__name__, flush=True)\n"
        "        heavy = {'matplotlib', 'dask', 'netCDF4', 'pint'} if len(ds.variables) == 0 else set()\n"
        "        assert not heavy & set(sys.modules)\n        os._exit(0)\n"
        "    assert os.waitpid(pid, 0)[1] == 0, source\n"
    )
    command = [sys.executable, "-W", "error", "-W", "ignore::ImportWarning", "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["ResultAccessor"] * len(RESULTS)
