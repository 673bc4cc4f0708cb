"""Nominal pressure: what it is a load on, where it is told, and when full contact is foreseen."""

import math

import numpy as np
import pytest
from rich.console import Console
from support import told as words_of

import roughvisc as rv
from roughvisc.study.cost.full_contact import full_contact_pressure, full_contact_warning
from roughvisc.study.statement.case import read_cases, read_study
from roughvisc.study.statement.identity import identity
from roughvisc.views.console.result_tables import result_table
from roughvisc.views.console.tables import plan_tables

RUBBER = rv.elastic(shear_modulus=1e6)
STUDY = """
title = "wave"
[surface]
generate = "wavy"
amplitude = "1 um"
wavelength = "0.1 mm"
size = ["0.2 mm", "0.1 mm"]
shape = [24, 9]
waves = 1
[material]
model = "elastic"
shear_modulus = "1 MPa"
[[program]]
pressure = "20 kPa"
over = 0
[solve]
boundary = "periodic"
"""


def printed(table):
    console = Console(width=300)
    with console.capture() as capture:
        console.print(table)
    return capture.get()


def test_pressure__is_the_load_over_the_whole_area():
    height = rv.self_affine((3e-4, 2e-4), (15, 12), hurst=0.8, rms_slope=0.1, seed=2)
    options = {"boundary": "periodic", "progress": False, "fields": ("pressure",)}
    by_pressure = rv.simulate(height, RUBBER, rv.Program().pressure("0.1 MPa", over=0).hold("1 s"), **options)
    by_load = rv.simulate(height, RUBBER, rv.Program().load(0.1e6 * 6e-8, over=0).hold(1.0), **options)
    np.testing.assert_allclose(by_pressure.pressure, by_load.pressure, rtol=1e-9)
    np.testing.assert_allclose(by_pressure.nominal_pressure, 0.1e6, rtol=1e-9)
    np.testing.assert_allclose(by_pressure.pressure.mean(("x", "y")), 0.1e6, rtol=1e-9)


def test_pressure__counts_absent_cells():
    punch = rv.flat_punch(2e-5, (9e-5, 6e-5), (9, 6))
    ds = rv.simulate(punch, RUBBER, rv.Program().pressure(1e3, over=0), times=[0], progress=False)
    assert float(ds.force[0]) == pytest.approx(1e3 * 9e-5 * 6e-5)


def test_pressure__refers_to_the_surface_as_given_where_the_grid_grows():
    ball = rv.sphere(1e-3, 1e-4, 16)
    ds = rv.simulate(ball, RUBBER, rv.Program().pressure("0.2 MPa", over=0), times=[0], progress=False)
    assert ds.sizes["x"] > 16
    assert float(ds.force[0]) == pytest.approx(0.2e6 * 1e-8)
    assert float(ds.nominal_pressure[0]) == pytest.approx(0.2e6)


def test_grid_error__presses_coarser_grids_by_the_same_load():
    wave = rv.wavy(1e-6, 1e-4, (1e-4, 1e-4), (25, 9), waves=1)
    ds = [
        rv.simulate(wave, RUBBER, program, boundary="periodic", times=[0], grid_error=True, progress=False)
        for program in (rv.Program().pressure(3e4, over=0), rv.Program().load(3e4 * 1e-8, over=0))
    ]
    np.testing.assert_allclose(ds[0].grid_error, ds[1].grid_error, rtol=1e-6)


def test_study__sweeps_over_surfaces_of_different_sizes(tmp_path):
    study = tmp_path / "study.toml"
    study.write_text(STUDY + '[sweep]\n"surface.size" = [["0.2 mm", "0.1 mm"], ["0.4 mm", "0.1 mm"]]')
    results = [rv.run(case, tmp_path / "out", progress=False) for case in read_cases(study)]
    assert [float(ds.nominal_pressure[-1]) for ds in results] == pytest.approx([2e4, 2e4])
    assert [float(ds.force[-1]) for ds in results] == pytest.approx([2e4 * 2e-8, 2e4 * 4e-8])


def test_key__is_as_it_was_without_pressures(tmp_path):
    study = tmp_path / "study.toml"
    study.write_text(STUDY.replace('pressure = "20 kPa"', 'load = "0.4 mN"'))
    case = read_study(study)
    segments = [[s.control, s.duration, s.end, s.amplitude, s.period] for s in case.program().segments]
    assert segments == [["load", 0.0, 4e-4, 0.0, math.inf]]
    study.write_text(STUDY)
    assert read_study(study).key == rv.vary(read_study(study), {"program.0.pressure": 2e4}).key
    assert read_study(study).key != identity(case.settings)[0]


def test_result__tells_it(tmp_path):
    study = tmp_path / "study.toml"
    study.write_text(STUDY)
    ds = rv.run(study, tmp_path / "out", progress=False)
    lines = printed(result_table(ds)).splitlines()
    assert next(line for line in lines if line.startswith("Nominal pressure at the end")).split()[-2:] == ["20", "kPa"]
    told = ds.drop_vars([name for name in ds.data_vars if name not in ("force", "nominal_pressure")])  # quick to draw
    page = rv.report(told, tmp_path / "page.html").read_text()
    assert '<td class="number">20 kPa</td>' in page
    assert any("Nominal pressure 20 kPa" in text.replace("\u00a0", " ") for text in words_of(rv.plot.maps(ds)))
    ds.attrs["boundary"] = "free"  # the grid of an indenter is as large as one likes
    assert not any("nominal" in text.lower() for text in words_of(rv.plot.maps(ds)))


def test_plan__warns_of_full_contact_in_megapascals(tmp_path):
    study = tmp_path / "study.toml"
    study.write_text(STUDY.replace('pressure = "20 kPa"', 'load = "2 N"'))
    costs = rv.plan(study)
    assert float(costs.nominal_pressure[0]) == pytest.approx(2 / 2e-8)
    assert "Full contact is expected: the nominal pressure comes to 100 MPa." in printed(plan_tables(costs))
    study.write_text(STUDY)
    costs = rv.plan(study)
    assert float(costs.nominal_pressure[0]) == pytest.approx(2e4)
    text = printed(plan_tables(costs))
    assert "Warning" not in text
    assert "20 kPa" in next(line for line in text.splitlines() if line.startswith("Largest nominal pressure"))
    study.write_text(STUDY.replace('pressure = "20 kPa"', 'approach = "0.5 um"'))
    costs = rv.plan(study)  # the force is that of the coarse march
    assert 0 < float(costs.nominal_pressure[0]) < math.pi * 4e6 * 1e-6 / 1e-4


def test_full_contact__persson():
    """At the foreseen pressure Persson's erf is 95 %; a material that creeps counts by its softest."""
    soft = rv.zener(shear_modulus=3e6, kelvin_modulus=1e6, kelvin_viscosity=1e5)  # 0.75 MPa in the end: E* = 4 G
    full = full_contact_pressure(0.2, soft, 100.0)
    assert full == pytest.approx(0.2 * 4 * 0.75e6)
    assert full_contact_pressure(0.2, soft, 0.0) == pytest.approx(0.2 * 4 * 3e6)
    assert math.erf(math.sqrt(2) * full / (4 * 0.75e6 * 0.2)) == pytest.approx(0.954, abs=1e-3)
    assert full_contact_warning(1.1e6, 1e6)
    assert not full_contact_warning(0.9e6, 1e6)
    assert not full_contact_warning(1.0, 0.0)
    assert not full_contact_warning(math.nan, 1e6)
    assert full_contact_pressure(0.2, rv.kelvin_voigt(1e6, 1e5), 0.0) == math.inf  # it has not crept yet
