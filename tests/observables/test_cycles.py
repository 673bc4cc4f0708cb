"""Work of cycles against closed forms and loops whose area is known."""

import json

import numpy as np
import pytest
import xarray as xr
from references.half_space import punch_dissipation, punch_force
from samples import RUBBER
from scipy.integrate import cumulative_trapezoid
from support import BALL, case_of, refused

import roughvisc as rv
from roughvisc import observables
from roughvisc.errors import InputError

PERIOD, RADIUS = 0.5, 1e-4
THREE = rv.Program.cycle(2.0, 1.0, PERIOD, 3)


def histories(program, time, force, approach):
    """A result whose work is the trapezoidal integral of force over approach."""
    work = cumulative_trapezoid(force, approach, initial=0.0)
    values = {"force": ("time", force), "approach": ("time", approach), "work": ("time", work)}
    return xr.Dataset(values, {"time": time}, {"cycles": json.dumps(program.cycles)})


def ellipse(per_cycle, program=THREE, start=0.0):
    """A loop of area pi, whose force leads by a quarter of the period."""
    cycles = round((program.duration - start) / PERIOD)
    time = start + np.linspace(0.0, cycles * PERIOD, cycles * per_cycle + 1)
    angle = 2 * np.pi * (time - start) / PERIOD
    return histories(program, time, 2 + np.cos(angle), np.sin(angle))


def test_cycle_work__of_a_punch_settles_at_the_closed_form():
    mean, amplitude, per_cycle, cycles = 4e-6, 1e-6, 128, 8
    times = np.linspace(0.0, cycles * PERIOD, per_cycle * cycles + 1)
    approach = mean + amplitude * np.sin(2 * np.pi * times / PERIOD)
    table = rv.Program.table(np.r_[0.0, times], np.r_[0.0, approach], control="approach")
    force = punch_force(RADIUS, RUBBER, table, times)
    program = rv.Program.cycle(mean, amplitude, PERIOD, cycles, control="approach")
    work = observables.cycle_work(histories(program, times, force, approach))["cycle_work"]
    exact = punch_dissipation(RADIUS, RUBBER, amplitude, PERIOD)
    np.testing.assert_allclose(work[-1], exact, rtol=2e-3)
    assert abs(work[0] / exact - 1) > 1e-2, "a part of the work of the first cycle is stored"


@pytest.mark.parametrize("part", [0.01, 0.05, 0.2])
def test_cycle_work__of_taps_is_the_closed_form_within_its_error(part):
    """A flat punch, three cycles of a part of its approach."""
    punch, mean = rv.flat_punch(RADIUS, 2.6 * RADIUS, 7), 4e-6
    press = rv.Program().approach(mean, over=0.1)
    program = press.cycle(mean, part * mean, PERIOD, 3, control="approach")
    settings = {"tolerance": 1e-3, "fields": (), "progress": False}
    ds = rv.simulate(punch, RUBBER, program, **settings)
    elastic = rv.simulate(punch, rv.elastic(1.0), press, **settings)
    cells = float(elastic.force[-1]) / (8 * RADIUS * mean)  # force over that of a round punch, E* = 4 Pa
    exact = cells * punch_dissipation(RADIUS, RUBBER, part * mean, PERIOD)
    work = float(observables.cycle_work(ds)["cycle_work"][-1])
    stated = float(np.ptp(ds.work_error.sel(time=slice(program.duration - PERIOD - 1e-9, None)).values))
    assert work == pytest.approx(exact, abs=stated + 5e-3 * exact)
    assert stated < 0.3 * exact


def test_cycle_work__of_cycles_after_a_ramp_that_end_between_steps(tmp_path):
    """By a file of xarray: some rows, and all steps as the group `steps`. The rows alone are too few."""
    program = rv.Program().load(2.0, over=0.1) + rv.Program.cycle(2.0, 1.0, PERIOD, 3.8)
    loop = ellipse(200, program, start=0.1)
    steps, file = loop.assign_coords(time=loop.time - 0.3 * PERIOD / 200), tmp_path / "loop.nc"
    steps.isel(time=[30, 400]).to_netcdf(file)
    with refused("steps"):
        observables.cycle_work(rv.open_result(file))
    steps.reset_index("time").rename_dims(time="step").to_netcdf(file, mode="a", group="steps")
    found = observables.cycle_work(rv.open_result(file))
    np.testing.assert_allclose(found["cycle_start"], 0.1 + PERIOD * np.arange(3))
    np.testing.assert_allclose(found["cycle_work"], np.pi, rtol=1e-3)


def test_cycle_work__refuses_what_has_no_cycles():
    with refused("cycles", []):
        observables.cycle_work(ellipse(16, rv.Program().load(1.0, over=1.5)))
    with pytest.raises(InputError, match="choose one case"):
        observables.cycle_work(xr.concat([ellipse(16)] * 2, "case"))


def test_cycle_work__of_a_stored_result_is_that_of_a_fresh_one(tmp_path):
    """The cycles follow a ramp; the nominal pressure oscillates."""
    cycle = {"mean": 5e3, "amplitude": 2e3, "period": PERIOD, "cycles": 2}
    program = [{"pressure": 5e3, "over": 0.1}, {"cycle": cycle, "control": "pressure"}]
    case = case_of(tmp_path, BALL, program=program, keep__times=3)
    stored = observables.cycle_work(rv.run(case, progress=False))
    fresh = rv.simulate(case.height(), case.material, case.program, boundary="free", times=3, progress=False)
    xr.testing.assert_equal(stored, observables.cycle_work(fresh))
    np.testing.assert_allclose(stored["cycle_start"], [0.1, 0.1 + PERIOD])
    assert (stored["cycle_work"] > 0).all()
