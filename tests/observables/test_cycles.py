"""Work of cycles against closed forms and loops whose area is known."""

import numpy as np
import pytest
import references
import xarray as xr
from samples import RUBBER
from scipy.integrate import cumulative_trapezoid
from support import refused

import roughvisc as rv
from roughvisc import observables
from roughvisc.errors import InputError

PERIOD, RADIUS = 0.5, 1e-4


def histories(time, force, approach):
    """A result whose work is the trapezoidal integral of force over approach."""
    work = cumulative_trapezoid(force, approach, initial=0.0)
    return xr.Dataset(
        {"force": ("time", force), "approach": ("time", approach), "work": ("time", work)}, {"time": time}
    )


def ellipse(per_cycle, cycles=3, start=0.0):
    """A loop of area pi, whose force leads by a quarter of the period."""
    time = start + np.linspace(0.0, cycles * PERIOD, cycles * per_cycle + 1)
    angle = 2 * np.pi * (time - start) / PERIOD
    return histories(time, 2 + np.cos(angle), np.sin(angle))


def test_cycle_work__of_an_ellipse_is_its_area():
    found = observables.cycle_work(ellipse(400), program=rv.Program.cycle(2.0, 1.0, PERIOD, 3))
    assert found["cycle"].values.tolist() == [1, 2, 3]
    np.testing.assert_allclose(found["cycle_start"], [0, PERIOD, 2 * PERIOD])
    np.testing.assert_allclose(found["cycle_work"], np.pi, rtol=1e-4)


def test_cycle_work__of_a_punch_settles_at_the_closed_form():
    mean, amplitude, per_cycle, cycles = 4e-6, 1e-6, 128, 8
    times = np.linspace(0.0, cycles * PERIOD, per_cycle * cycles + 1)
    approach = mean + amplitude * np.sin(2 * np.pi * times / PERIOD)
    table = rv.Program.table(np.r_[0.0, times], np.r_[0.0, approach], control="approach")
    force = references.punch_force(RADIUS, RUBBER, table, times)
    program = rv.Program.cycle(mean, amplitude, PERIOD, cycles, control="approach")
    work = observables.cycle_work(histories(times, force, approach), program=program)["cycle_work"]
    exact = references.punch_dissipation(RADIUS, RUBBER, amplitude, PERIOD)
    np.testing.assert_allclose(work[-1], exact, rtol=2e-3)
    assert abs(work[0] / exact - 1) > 1e-2, "a part of the work of the first cycle is stored"


def test_cycle_work__of_cycles_after_a_ramp_that_end_between_steps():
    ds = ellipse(200, 4, start=0.1).isel(time=slice(7, -9))
    program = rv.Program().load(2.0, over=0.1) + rv.Program.cycle(2.0, 1.0, PERIOD, 4.6)
    shifted = ds.assign_coords(time=ds.time + 0.3 * PERIOD / 200)
    for one in (ds, shifted):
        found = observables.cycle_work(one, program=program)
        assert found["cycle"].values.tolist() == [2, 3], "those that the result covers"
        np.testing.assert_allclose(found["cycle_start"], [0.1 + PERIOD, 0.1 + 2 * PERIOD])
        np.testing.assert_allclose(found["cycle_work"], np.pi, rtol=1e-3)


def test_cycle_work__refuses_what_has_no_cycles():
    ramp = rv.Program().load(1.0, over=1.0)
    with refused("program", ramp):
        observables.cycle_work(ellipse(16), ramp)
    with pytest.raises(InputError, match="choose one case"):
        observables.cycle_work(xr.concat([ellipse(16)] * 2, "case"), program=rv.Program.cycle(2.0, 1.0, PERIOD, 3))
