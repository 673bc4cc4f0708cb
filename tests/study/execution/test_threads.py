"""Cases in threads of one process, as ``dask.delayed(rv.run)`` computes them."""

import subprocess
import sys

import netCDF4
import pytest
from support import BALL

import roughvisc as rv
from roughvisc.study.statement.case import read_cases
from roughvisc.study.storage.store import NETCDF

#: A ball on a coarse grid: most of its time goes to files.
SMALL = BALL.replace("[24, 21]", "[12, 9]")
SCRIPT = """
import sys, dask, roughvisc as rv
cases = rv.read_cases("balls.toml")
found = dask.compute(
    *(dask.delayed(rv.run)(case, "results", progress=False) for case in cases), scheduler="threads", num_workers=4
)
print(len({float(ds.pressure.max()) for ds in found}))
"""


@pytest.mark.parametrize("count", [8, pytest.param(400, marks=pytest.mark.long)])
def test_run__in_four_threads(tmp_path, count):
    loads = ", ".join(f'"{4 + 0.01 * number} mN"' for number in range(count))
    (tmp_path / "balls.toml").write_text(f'{SMALL}[sweep]\n"program.0.load" = [{loads}]\n')
    done = subprocess.run([sys.executable, "-c", SCRIPT], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, f"{count}\n"), done.stderr


def test_run__touches_no_netcdf_file_outside_its_lock(tmp_path, monkeypatch):
    """A scan in NetCDF and a result: written, found finished, opened, read."""
    h = rv.self_affine((1e-3, 1e-3), (12, 9), hurst=0.8, rms_height=1e-6, seed=1)
    h.rename("height").to_netcdf(tmp_path / "rough.nc")
    surface = BALL[BALL.index("generate") : BALL.index("[material]")]
    text = BALL.replace(surface, 'file = "rough.nc"\nlevel = 1\n').replace('"free"', '"periodic"')
    (tmp_path / "rough.toml").write_text(text)
    touched, opened = [], netCDF4.Dataset

    class Watched:
        def __init__(self, path, *args, **settings):
            touched.append(("opened", NETCDF.locked()))
            self._file = opened(path, *args, **settings)

        def __getattr__(self, name):
            touched.append((name, NETCDF.locked()))
            return getattr(self._file, name)

        def __getitem__(self, name):
            return self._file[name]

        def __enter__(self):
            return self

        def __exit__(self, *how):
            self.close()

    monkeypatch.setattr(netCDF4, "Dataset", Watched)
    (case,) = read_cases(tmp_path / "rough.toml")
    for _ in range(2):
        with rv.run(case, tmp_path, progress=False) as ds:
            assert float(ds.pressure[-1].max()) > 0
    assert {locked for _, locked in touched} == {True}
    assert {"opened", "variables", "ncattrs", "createVariable", "close"} <= {what for what, _ in touched}
