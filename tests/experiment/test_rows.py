"""Stated accuracy of each row of a result."""

import numpy as np
import pytest
from support import at_rows

import roughvisc as rv

BALL = rv.sphere(1.0, 1.6, 17)
MATERIALS = {
    "elastic": rv.elastic(1.0),
    "zener": rv.zener(1.0, 1.0, 0.3),
    "maxwell": rv.maxwell(1.0, 1.0),
    "kelvin_voigt": rv.kelvin_voigt(1.0, 0.3),
    "power_law": rv.power_law(1.0, 1.0, 0.3),
}
PROGRAMS = {
    "loads": rv.Program().load(0.02, over=0.3).hold(0.3).load(0.0, over=0.2).hold(0.2).load(0.01, over=0.2),
    "approaches": rv.Program().approach(0.05, over=0.3).hold(0.3).approach(-0.01, over=0.2).approach(0.03, over=0.3),
    "jump": rv.Program().load(0.02, over=0).hold(0.5).load(0.01, over=0),
}


@pytest.mark.parametrize("program", PROGRAMS)
@pytest.mark.parametrize("material", MATERIALS)
def test_every_row__states_an_error(material, program):
    ds = rv.simulate(BALL, MATERIALS[material], PROGRAMS[program], tolerance=3e-2, fields=(), progress=False)
    assert ds.sizes["time"] > 1
    found = ds.assign(at_rows(ds)[["time_error", "residual"]].data_vars)
    for name in ("stated_error", "time_error", "residual", "approach_error", "contact_area_error", "work_error"):
        assert np.isfinite(found[name]).all(), name
        assert (found[name] >= 0).all(), name


def test_ancillary_variables__exist():
    ds = rv.simulate(BALL, MATERIALS["zener"], PROGRAMS["jump"], tolerance=3e-2, progress=False)
    named = {name: variable.attrs.get("ancillary_variables", "").split() for name, variable in ds.variables.items()}
    assert {other for others in named.values() for other in others} <= set(ds.variables)
    assert named["contact_area"] == ["contact_area_error"]


def test_dent_left_by_a_load__is_as_uncertain_as_the_load_made_it():
    # 1 % off in a compliance is 1 % of what it gave under load, however little of that is left
    program = rv.Program().load(0.02, over=0.3).hold(0.3).load(0.0, over=0.01).hold(30.0)
    ds = rv.simulate(BALL, MATERIALS["power_law"], program, times=[0.6, 30.6], tolerance=1e-2, progress=False)
    loaded, left = ds.approach.values
    assert left < 0.1 * loaded
    assert ds.approach_error[-1] > ds.attrs["series_error"] * loaded > 0
