"""Every service for every kind of experiment: none refuses a kind, unless physics does."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from samples import Scaled
from support import assert_same, at_rows, numbers

import roughvisc as rv
from roughvisc.study.case import read_cases, read_study, vary
from roughvisc.study.execution.run import run_case

HEAD = """
title = "Every service"
[surface]
generate = "self_affine"
size = ["1 mm", "0.9 mm"]
shape = [23, 19]
hurst = 0.8
rms_slope = 0.1
rolloff = "0.5 mm"
shortcut = "0.2 mm"
seed = 3
[material]
model = "zener"
shear_modulus = "1 MPa"
kelvin_modulus = "0.5 MPa"
kelvin_viscosity = "1 kPa s"
[solve]
boundary = "periodic"
tolerance = 1e-2
"""
TIMES = '[keep]\ntimes = [0, "3 ms", "8 ms"]\n'
LOAD = '[[program]]\npressure = "10 kPa"\nover = "2 ms"\n'


@dataclass(frozen=True)
class Kind:
    """A kind of experiment: its part of a study, its axis, and what of it is doubled where a load is to be larger."""

    text: str
    axis: str
    pressed: str
    curve: str  # what tells most of it
    moves: bool = True


KINDS = {
    "load": Kind(LOAD + '[[program]]\nhold = "6 ms"\n' + TIMES, "time", "program.0.pressure", "approach", moves=False),
    "slide": Kind(
        LOAD + '[[program]]\nslide = "0.4 mm"\nover = "6 ms"\n' + TIMES,
        "time",
        "program.0.pressure",
        "friction_coefficient",
    ),
    "friction": Kind(
        '[friction]\npressure = "10 kPa"\nspeeds = ["10 mm/s", "0.1 m/s", "1 m/s"]\n',
        "speed",
        "friction.pressure",
        "friction_coefficient",
    ),
}
ROWS = 3


@pytest.fixture(scope="module", params=KINDS)
def kind(request):
    return KINDS[request.param]


@pytest.fixture(scope="module")
def done(kind, tmp_path_factory):
    """A study of this kind, its case, and its result in a folder."""
    folder = tmp_path_factory.mktemp("services")
    study = folder / "study.toml"
    study.write_text(HEAD + kind.text)
    result = rv.run(study, folder / "out", progress=False)
    return SimpleNamespace(study=study, case=read_study(study), out=folder / "out", result=result)


def over_the_rows(variable, kind):
    """Its values, finite, one for each row."""
    assert variable.dims == (kind.axis,)
    values = variable.values
    assert len(values) == ROWS
    assert np.isfinite(values).all()
    return values


def computed(case, body=None, **settings):
    """What the function gives that does the same as a study."""
    solving = case.settings
    shared = {"tolerance": solving.tolerance, "fields": solving.fields, "progress": False} | settings
    body = case.body if body is None else body
    if asked := case.tables.get("friction"):
        return rv.friction(case.height(), body, **asked, **shared)
    return rv.simulate(case.height(), body, case.program, boundary="periodic", times=solving.times, **shared)


def test_run__gives_rows_over_the_axis(kind, done):
    ds = done.result
    assert dict(ds.sizes) == {kind.axis: ROWS, "x": 23, "y": 19}
    known = at_rows(ds) if kind.axis == "time" else ds
    assert (known.status == 0).sum() >= ROWS - 1, "nothing is pressed at the beginning of a program"
    pressed = over_the_rows(known.nominal_pressure, kind)
    np.testing.assert_allclose(ds.pressure.mean(("x", "y")), pressed, atol=1e-9)
    assert pressed[-1] == pytest.approx(1e4)
    cell = 1e-3 * 0.9e-3 / (23 * 19)
    np.testing.assert_allclose((ds.pressure > 0).sum(("x", "y")) * cell, known.contact_area_counted)
    found = ds[kind.curve].where(ds.force > 0, 0.0)  # nothing rubs before anything is pressed
    assert over_the_rows(found, kind).max() > 0
    assert ("friction_coefficient" in ds) == kind.moves


def test_resume__ends_with_the_same_bits(kind, done, tmp_path):
    asked, seen = [], []

    def stop():
        asked.append(1)
        return len(asked) == 2

    with pytest.raises(KeyboardInterrupt):
        run_case(done.case, tmp_path, stop=stop)
    assert not list(tmp_path.glob("*.nc"))
    run_case(done.case, tmp_path, progress=lambda now, end: seen.append(now / end))
    whole = []
    run_case(done.case, tmp_path / "whole", progress=lambda now, end: whole.append(now / end))
    assert len(seen) <= len(whole) - 2, "two rows at least are not computed again"
    assert seen == whole[-len(seen) :]
    assert_same(numbers(tmp_path), numbers(done.out))


def test_sweep_and_table__have_a_row_for_each_load(kind, done, tmp_path):
    study = tmp_path / "study.toml"
    study.write_text(HEAD + kind.text + f'[sweep]\n"{kind.pressed}" = ["10 kPa", "20 kPa"]\n')
    results = rv.sweep(read_cases(study), out=tmp_path / "out", workers=0, progress=False)
    assert results.contact_area.dims == ("case", kind.axis)
    np.testing.assert_array_equal(results.contact_area[0], done.result.contact_area)
    assert (results.contact_area[1, -1] > 1.5 * results.contact_area[0, -1]).all()
    table = rv.to_table(tmp_path / "out")
    assert isinstance(table, pd.DataFrame)
    assert table[f"{kind.pressed} [Pa]"].tolist() == [1e4, 2e4]
    assert table["status"].tolist() == ["converged"] * 2
    row = int(done.result[kind.curve].argmax(kind.axis)) if kind.axis == "speed" else -1
    unit = done.result[kind.axis].attrs["units"]
    assert table[f"{kind.axis} [{unit}]"].iloc[0] == float(done.result[kind.axis][row])
    assert table["contact_area [m^2]"].iloc[0] == float(done.result.contact_area[row])


@pytest.mark.thorough
def test_figures__are_drawn_of_rows_and_fields(kind, done, tmp_path, coarse_pictures):
    drawn = rv.plot.save_figures(done.result, tmp_path, "one")
    names = {path.stem.rpartition("-")[2] for path in drawn}
    assert {"section", "surface", "friction" if kind.axis == "speed" else "history"} <= names
    assert names & {"maps", "pressure_maps"}
    assert ("slide" in names or "friction" in names) == kind.moves


def test_observables__follow_the_contact(kind, done):
    """It leaks less, conducts more, and its clusters add up."""
    order = np.argsort(done.result.contact_area.values)
    leaks = rv.observables.leakage(done.result, viscosity="1 mPa s", pressure_drop="1 bar")
    rate = over_the_rows(leaks.leak_rate, kind)[order]
    assert rate[0] > 0
    assert (np.diff(rate) <= 0).all()
    assert (leaks.leak_rate_error <= 1e-9 * leaks.leak_rate).all()
    conductance = rv.observables.conductance(done.result, ("1e-7 ohm m", "2e-7 ohm m")).electrical_conductance
    assert (np.diff(over_the_rows(conductance, kind)[order]) > 0).all()
    found = rv.observables.clusters(done.result)
    assert over_the_rows(found.cluster_count, kind).max() > 1
    total = (found.cluster_count * found.cluster_area_mean).fillna(0)
    known = at_rows(done.result) if kind.axis == "time" else done.result
    np.testing.assert_allclose(total, known.contact_area_counted)


def test_grid_error__is_stated_in_every_row(kind, done):
    """And holds what the same on twice as many cells each way has otherwise, whose surface has the same waves."""
    few = computed(done.case, grid_error=True)
    area = over_the_rows(few.grid_error_area, kind)
    assert 0 < area.max() < 2
    own = over_the_rows(few["grid_error_friction" if kind.axis == "speed" else "grid_error"], kind)
    assert 0 < own.max() < 2
    finer = vary(done.case, {"surface.shape": [69, 57]})
    fine = computed(finer)
    off = abs(few.contact_area.values - fine.contact_area.values) / few.contact_area.values.max()
    scale = few.contact_area.values / few.contact_area.values.max() if kind.axis == "speed" else 1.0
    assert (off <= area * scale + 1e-12).all()
    one, other = (run.friction_coefficient if kind.axis == "speed" else run.approach for run in (few, fine))
    unit = one.values if kind.axis == "speed" else one.values.max()
    assert (abs(one.values - other.values) <= own * unit).all()


def test_own_body__is_what_its_kernel_says(kind, done):
    """A kernel of twice the compliance is a material of half the moduli, and no half-space of the material."""
    own = computed(done.case, rv.Body(done.case.material, Scaled(2.0)))
    softer = computed(done.case, rv.zener(0.5e6, 0.25e6, 0.5e3))
    for name in ("contact_area", "approach", kind.curve):
        np.testing.assert_allclose(own[name], softer[name], rtol=1e-9)
    plain = done.result
    assert float(own.contact_area[-1]) > 1.5 * float(plain.contact_area[-1])
