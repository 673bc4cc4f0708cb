"""Studies of friction: a table ``[friction]`` from the file to results, sweeps, figures and tables."""

import json

import numpy as np
import pytest
import xarray as xr
from support import FRICTION

import roughvisc as rv
from roughvisc.runs.netcdf import open_result
from roughvisc.study.case import read_study, vary

pytestmark = pytest.mark.filterwarnings(
    "ignore:.*Sending large graph.*:UserWarning", "ignore::pytest.PytestUnraisableExceptionWarning"
)

BESIDE = '[solve]\ngrid_error = true\nboundary = "periodic"\n'
PRESSURES = '[sweep]\n"friction.pressure" = ["20 kPa", "40 kPa"]\n'
TEMPERATURES = FRICTION.replace(
    "[friction]",
    'temperature = "20 degC"\nreference_temperature = "20 degC"\nactivation_energy = "80 kJ/mol"\n[friction]',
)


@pytest.fixture
def case(tmp_path):
    """Writes a study of friction and reads its only case."""

    def read(text=FRICTION):
        path = tmp_path / "slide.toml"
        path.write_text(text)
        return read_study(path)

    return read


def with_beside(text=FRICTION):
    return text.replace('[solve]\nboundary = "periodic"\n', BESIDE)


def test_run__gives_what_the_function_gives(case, tmp_path):
    one = case(with_beside())
    ds = rv.run(one, tmp_path / "out", progress=False)
    surface = rv.self_affine((1e-3, 0.8e-3), (26, 21), hurst=0.8, rms_slope=0.1, rolloff=5e-4, shortcut=1.6e-4, seed=1)
    asked = {"pressure": 2e4, "speeds": [2e-3, 2e-2, 0.2, 2.0], "grid_error": True}
    fields = {"fields": ("pressure", "gap"), "progress": False}
    same = rv.friction(surface, rv.zener(1e6, 0.3e6, 0.3e3), **asked, **fields)
    assert set(same.data_vars) | {"reduced_speed"} == set(ds.data_vars)
    xr.testing.assert_equal(ds.drop_vars(["wall_time", "reduced_speed"]).load(), same.drop_vars("wall_time"))
    assert ds.attrs["case_key"] == one.key
    assert json.loads(ds.attrs["case"])["friction"]["speeds"] == [2e-3, 2e-2, 0.2, 2.0]
    assert ds.attrs["title"] == "Sliding"
    stamp = (tmp_path / "out" / f"{one.key}.nc").stat().st_mtime_ns
    rv.run(one, tmp_path / "out", progress=False)
    assert (tmp_path / "out" / f"{one.key}.nc").stat().st_mtime_ns == stamp, "finished, and not computed again"


def test_sweep__opens_as_one_and_as_a_table(tmp_path):
    (tmp_path / "slide.toml").write_text(FRICTION + PRESSURES)
    ds = rv.sweep(tmp_path / "slide.toml", tmp_path / "out", workers=0, progress=False)
    assert ds.friction_coefficient.dims == ("case", "speed")
    assert ds.pressure.dims == ("case", "speed", "x", "y")
    assert ds["friction_pressure"].values.tolist() == [2e4, 4e4]
    np.testing.assert_allclose(ds.pressure.mean(("x", "y")), ds.nominal_pressure)
    one = open_result(tmp_path / "out" / f"{ds.case_key.values[1]}.nc")
    xr.testing.assert_equal(ds.gap.isel(case=1, drop=True).variable.load(), one.gap.variable.load())
    table = rv.to_table(tmp_path / "out")
    peak = ds.friction_coefficient.argmax("speed")
    np.testing.assert_allclose(table["friction_coefficient"], ds.friction_coefficient.max("speed"))
    np.testing.assert_allclose(table["speed [m/s]"], ds.speed[peak])
    np.testing.assert_allclose(table["contact_area [m^2]"], ds.contact_area.isel(speed=peak))
    assert table["friction.pressure [Pa]"].tolist() == [2e4, 4e4]
    assert table["status"].tolist() == ["converged", "converged"]
    assert "time [s]" not in table
    assert (tmp_path / "out" / "cases.csv").read_text(encoding="utf-8-sig").count("converged") == 2
    rv.to_csv(one, tmp_path / "one.csv")
    assert (tmp_path / "one.csv").read_text().startswith("speed [m/s],")


def test_temperature__gives_the_reduced_speed_of_a_master_curve(case, tmp_path):
    """At 40 degrees the curve of 20 degrees lies at a speed that is larger by the shift factor."""
    reference = rv.run(case(TEMPERATURES), tmp_path, progress=False)
    np.testing.assert_allclose(reference.reduced_speed, reference.speed)
    factor = rv.arrhenius(313.15, 293.15, 80e3)
    faster = [speed / factor for speed in reference.speed.values.tolist()]
    warm = vary(case(TEMPERATURES), {"material.temperature": "40 degC", "friction.speeds": faster})
    shifted = rv.run(warm, tmp_path, progress=False)
    np.testing.assert_allclose(shifted.reduced_speed, reference.speed, rtol=1e-9)
    np.testing.assert_allclose(shifted.friction_coefficient, reference.friction_coefficient, rtol=1e-6)
    assert case(TEMPERATURES).body == case().body, "at the reference temperature nothing is shifted"
