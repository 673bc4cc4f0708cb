"""The undeformed gap counts from the apex of an indenter, wherever that lies between the cells."""

import numpy as np
import pytest
from references.half_space import Cone, Paraboloid
from samples import UNIT

import roughvisc as rv

INDENTERS = {
    "sphere": (lambda size, shape: rv.sphere(1.0, size, shape), Paraboloid(1.0)),
    "cone": (lambda size, shape: rv.cone(1.0, size, shape), Cone(1.0)),
}


def pressed(height, program, **settings):
    fields = ("pressure", "gap", "displacement")
    settings = {"boundary": "free", "tolerance": 1e-5, "progress": False, "fields": fields, **settings}
    return rv.simulate(height, UNIT, program, **settings)


def hertz_or_sneddon(name, radius=1.0):
    """Load and approach at a contact radius."""
    if name == "sphere":
        return 4 / 3 * radius**3, radius**2
    return np.pi / 2 * radius**2, np.pi / 2 * radius


@pytest.mark.parametrize("parity", [0, 1])
@pytest.mark.parametrize("name", INDENTERS)
def test_approach__is_of_second_order_on_even_and_odd_grids(name, parity):
    """From the highest cell it would be of first order under a cone, and -0.29 (h/a)^2 under a ball."""
    load, approach = hertz_or_sneddon(name)
    radii = np.array([4.0, 8.0, 16.0, 32.0])
    errors = []
    for radius in radii:
        cells = 2 * round(1.25 * radius) + parity
        ds = pressed(INDENTERS[name][0](cells / radius, cells), rv.Program().load(load, over=0), fields=())
        errors.append(abs(float(ds.approach[0]) / approach - 1))
    assert (errors < 0.08 / radii**2).all()
    assert -np.polyfit(np.log(radii), np.log(errors), 1)[0] > 1.3


def test_highest__is_the_apex_within_the_cells_of_an_unchanged_indenter():
    """On the border of the first or of the last row along either axis, and outside of it."""
    tip = rv.cone(0.5, 4.0, 8)
    cases = [(tip, 0.0), (tip + 1.0, float(tip.max()) + 1.0)]
    for axis in ("x", "y"):
        cases += [(tip.isel({axis: rows}), 0.0) for rows in (slice(4, None), slice(None, 4))]
        beside = [tip.isel({axis: rows}) for rows in (slice(5, None), slice(None, 3))]
        cases += [(height, float(height.max())) for height in beside]
    for height, highest in cases:
        assert pressed(height, rv.Program().load(1e-3, over=0), edge="accept").height.attrs["highest"] == highest


def test_open__the_approach_is_that_of_the_highest_cells():
    """An even grid touches where its cells do, later than its apex."""
    height, side = rv.cone(0.5, 1.0, 10), 0.1
    program = rv.Program().load(0.0, over=1.0)
    assert pressed(height, program).approach.values == pytest.approx(0.5 * side / np.sqrt(2), rel=1e-12)
    ds = pressed(height, rv.Program().approach(0.1, over=1.0), times=21)
    apart = ds.approach.values <= 0.5 * side / np.sqrt(2)
    assert np.array_equal(ds.force.values == 0, apart)
