"""Energy of cycles against closed forms and loops whose area is known."""

import json

import numpy as np
import pytest
import sample_results as made
import xarray as xr

import roughvisc as rv
from roughvisc import observables, plot
from roughvisc.errors import InputError
from roughvisc.study.execution.run import run_case

PERIOD, RADIUS = 0.5, 1e-4
RUBBER = rv.zener(3e6, 1e6, 1e5)


def histories(time, force, approach, **more):
    return xr.Dataset({"force": ("time", force), "approach": ("time", approach), **more}, {"time": time})


def ellipse(per_cycle, cycles=3, start=0.0):
    """A loop of area pi, whose force leads by a quarter of the period."""
    time = start + np.linspace(0.0, cycles * PERIOD, cycles * per_cycle + 1)
    angle = 2 * np.pi * (time - start) / PERIOD
    return histories(time, 2 + np.cos(angle), np.sin(angle))


def test_cycle_energy__of_an_ellipse_converges_at_order_two():
    program = rv.Program.cycle(2.0, 1.0, PERIOD, 3)

    def error(per_cycle):
        found = observables.cycle_energy(ellipse(per_cycle), program=program)
        assert found["cycle"].values.tolist() == [1, 2, 3]
        np.testing.assert_allclose(found["cycle_closure"], 0, atol=1e-12)
        np.testing.assert_allclose(found["cycle_start"], [0, PERIOD, 2 * PERIOD])
        return np.abs(found["cycle_dissipated_energy"].values / np.pi - 1).max()

    assert 1.9 < np.log2(error(32) / error(64)) < 2.1
    assert error(64) < 2e-3


def test_cycle_energy__of_a_punch_is_the_closed_form():
    mean, amplitude, per_cycle, cycles = 4e-6, 1e-6, 128, 8
    times = np.linspace(0.0, cycles * PERIOD, per_cycle * cycles + 1)
    approach = mean + amplitude * np.sin(2 * np.pi * times / PERIOD)
    table = rv.Program.table(np.r_[0.0, times], np.r_[0.0, approach], control="approach")
    force = rv.closed_forms.punch_force(RADIUS, RUBBER, table, times)
    assert force.min() > 0
    program = rv.Program.cycle(mean, amplitude, PERIOD, cycles, control="approach")
    found = observables.cycle_energy(histories(times, force, approach), program=program)
    exact = rv.closed_forms.punch_dissipation(RADIUS, RUBBER, amplitude, PERIOD)
    np.testing.assert_allclose(found["cycle_dissipated_energy"][-1], exact, rtol=2e-3)
    assert np.isnan(found["cycle_dissipated_energy"][0]), "the first loop is not closed: its work is no dissipation"
    assert np.isfinite(found["cycle_work"][0])
    assert found["cycle_closure"][-1] < 1e-9 < 1e-3 < found["cycle_closure"][0], "it settles"


def test_cycle_energy__of_an_elastic_loop_is_nothing():
    approach = 2 + np.sin(np.linspace(0.0, 4 * np.pi, 65))
    ds = histories(np.linspace(0.0, 2 * PERIOD, 65), 3 * approach, approach)
    found = observables.cycle_energy(ds, program=rv.Program.cycle(2.0, 1.0, PERIOD, 2))
    np.testing.assert_allclose(found["cycle_dissipated_energy"], 0, atol=1e-12)


def test_cycle_energy__ends_between_kept_times_and_cycles_after_a_ramp():
    ds = ellipse(200, 4, start=0.1).isel(time=slice(7, -9))
    program = rv.Program().load(2.0, over=0.1) + rv.Program.cycle(2.0, 1.0, PERIOD, 4.6)
    found = observables.cycle_energy(ds, program=program)
    assert found["cycle"].values.tolist() == [2, 3], "those that the kept times cover"
    np.testing.assert_allclose(found["cycle_start"], [0.1 + PERIOD, 0.1 + 2 * PERIOD])
    np.testing.assert_allclose(found["cycle_dissipated_energy"], np.pi, rtol=1e-3)


def test_cycle_energy__takes_the_work_of_every_step_where_the_result_has_it():
    ds = ellipse(12, 2)
    work = np.linspace(5.0, 5.0 + 2 * np.pi, ds.sizes["time"])
    program = rv.Program.cycle(2.0, 1.0, PERIOD, 2)
    exact = observables.cycle_energy(ds.assign(work=("time", work)), program=program)
    np.testing.assert_allclose(exact["cycle_dissipated_energy"], np.pi, rtol=1e-12)
    kept = observables.cycle_energy(ds, program=program)
    polygon = 6 * np.sin(np.pi / 6)  # area of a regular one
    np.testing.assert_allclose(kept["cycle_dissipated_energy"], polygon, rtol=1e-12)


def test_cycle_energy__of_too_few_kept_times_is_not_known():
    found = observables.cycle_energy(ellipse(4), program=rv.Program.cycle(2.0, 1.0, PERIOD, 3))
    assert np.isnan(found["cycle_work"]).all()
    assert np.isnan(found["cycle_dissipated_energy"]).all()


def test_cycle_energy__refuses_what_has_no_cycles():
    with pytest.raises(InputError, match="give program="):
        observables.cycle_energy(ellipse(16))
    with pytest.raises(InputError, match="no whole cycle"):
        observables.cycle_energy(ellipse(16), program=rv.Program().load(1.0, over=1.0))
    with pytest.raises(InputError, match="choose one case"):
        observables.cycle_energy(xr.concat([ellipse(16)] * 2, "case"), program=rv.Program.cycle(2.0, 1.0, PERIOD, 3))


STUDY = """
title = "Punch in cycles"
[surface]
generate = "flat_punch"
radius = "0.1 mm"
size = "0.25 mm"
shape = 40
[material]
model = "zener"
shear_modulus = "3 MPa"
kelvin_modulus = "1 MPa"
kelvin_viscosity = "0.1 MPa s"
[[program]]
cycle = { mean = "4 um", amplitude = "1 um", period = "0.5 s", cycles = 4 }
control = "approach"
[solve]
tolerance = 2e-3
[keep]
fields = []
times = 81
"""


@pytest.fixture(scope="module")
def punch(tmp_path_factory):
    folder = tmp_path_factory.mktemp("punch")
    (folder / "punch.toml").write_text(STUDY)
    return rv.open_result(run_case(rv.read_study(folder / "punch.toml"), folder)).load()


def test_cycle_energy__of_a_run_by_the_program_in_its_case(punch):
    found = observables.cycle_energy(punch, closed=0.02)
    exact = rv.closed_forms.punch_dissipation(RADIUS, RUBBER, 1e-6, PERIOD)
    assert found["cycle"].values.tolist() == [1, 2, 3, 4]
    np.testing.assert_allclose(found["cycle_dissipated_energy"][-1], exact, rtol=0.04)  # the circle is made of 40 cells
    for name in found.variables:
        assert found[name].attrs["long_name"]


def test_hysteresis__states_what_the_last_closed_cycle_dissipates(punch):
    energy = float(observables.cycle_energy(punch)["cycle_dissipated_energy"][-1])
    named = [text.get_text() for text in plot.hysteresis(punch).legends[0].get_texts()]
    assert f"cycle 4: {1e9 * energy:.3g} nJ dissipated" in named
    assert not any(
        "dissipated" in text.get_text() for text in plot.hysteresis(made.hertz_cycle()).legends[0].get_texts()
    )


def test_area_against_load__takes_the_contact_modulus_from_the_case(punch):
    case = json.loads(punch.attrs["case"])
    ds = made.rough_creep(absent=False)
    ds["force"] = ("time", np.geomspace(0.01, 10, 12))
    of_a_punch = ds.assign_attrs(case=punch.attrs["case"])
    assert len(plot.area_against_load(of_a_punch).axes[0].lines) == 1, "a punch is not rough"
    rough = {
        "generate": "self_affine",
        "size": [1e-3, 1e-3],
        "shape": [16, 16],
        "hurst": 0.8,
        "rms_slope": 0.1,
        "seed": 1,
    }
    ds = ds.assign_attrs(case=json.dumps(case | {"surface": rough}))
    drawn = {line.get_label(): line for line in plot.area_against_load(ds).axes[0].lines}
    given = {"at once": 12e6, "after 2.78 h": 4 * 0.75e6}  # springs of 3 MPa, and of 3 and 1 MPa in series; nu = 1/2
    by_hand = {line.get_label(): line for line in plot.area_against_load(ds, contact_modulus=given).axes[0].lines}
    assert set(drawn) == set(by_hand) > {"low loads, at once"}
    for name in given:
        ours, theirs = (lines[f"low loads, {name}"].get_ydata() for lines in (drawn, by_hand))
        np.testing.assert_allclose(ours, theirs, rtol=1e-9)
    assert len(plot.area_against_load(ds, contact_modulus={}).axes[0].lines) == 1
    assert len(plot.area_against_load(ds.assign_attrs(boundary="free")).axes[0].lines) == 1
    other = ds.assign_attrs(case=json.dumps(case | {"surface": rough, "material": {"model": "elastic"}}))
    assert len(plot.area_against_load([ds, other]).axes[0].lines) == 2, "two materials have no one line"
