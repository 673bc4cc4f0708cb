"""Every kind of experiment gives results over its axis, has observables and figures, and takes any body."""

import numpy as np
import pytest
from samples import QUICK_RUBBER as RUBBER
from samples import Scaled
from support import at_rows

import roughvisc as rv
from roughvisc.plot.save import figures_of

SURFACE = rv.self_affine((1e-3, 0.9e-3), (23, 19), hurst=0.8, rms_slope=0.1, rolloff=5e-4, shortcut=2e-4, seed=3)
LOAD = rv.Program().pressure(1e4, over=2e-3)
SETTINGS = {"tolerance": 1e-2, "fields": ("pressure", "gap"), "progress": False}
IN_TIME = SETTINGS | {"boundary": "periodic", "times": [0.0, 3e-3, 8e-3]}
#: Kind -> axis of its rows, and its result for a body.
KINDS = {
    "load": ("time", lambda body: rv.simulate(SURFACE, body, LOAD.hold(6e-3), **IN_TIME)),
    "slide": ("time", lambda body: rv.simulate(SURFACE, body, LOAD.slide(4e-4, over=6e-3), **IN_TIME)),
    "friction": (
        "speed",
        lambda body: rv.friction(SURFACE, body, pressure=1e4, speeds=[0.01, 0.1, 1.0], **SETTINGS),
    ),
}


@pytest.mark.parametrize("kind", KINDS)
def test_result__has_rows_observables_and_figures_over_its_axis(kind):
    """Where the contact is larger it leaks less and conducts more, and its clusters add up."""
    axis, solve = KINDS[kind]
    ds = solve(RUBBER)
    known = at_rows(ds) if axis == "time" else ds
    assert dict(ds.sizes) == {axis: 3, "x": 23, "y": 19}
    np.testing.assert_allclose(ds.pressure.mean(("x", "y")), known.nominal_pressure, atol=1e-9)
    assert float(known.nominal_pressure[-1]) == pytest.approx(1e4)
    cell = 1e-3 * 0.9e-3 / (23 * 19)
    np.testing.assert_allclose((ds.pressure > 0).sum(("x", "y")) * cell, known.contact_area_counted)
    assert ("friction_coefficient" in ds) == (kind != "load")
    leaks = rv.observables.leakage(ds, viscosity="1 mPa s", pressure_drop="1 bar").leak_rate
    conductance = rv.observables.conductance(ds, ("1e-7 ohm m", "2e-7 ohm m")).electrical_conductance
    clusters = rv.observables.clusters(ds)
    assert leaks.dims == conductance.dims == clusters.cluster_count.dims == (axis,)
    order = np.argsort(ds.contact_area.values)
    assert (np.diff(leaks.values[order]) <= 0).all()
    assert (np.diff(conductance.values[order]) > 0).all()
    total = (clusters.cluster_count * clusters.cluster_area_mean).fillna(0)
    np.testing.assert_allclose(total, known.contact_area_counted)
    own = {"load": {"history"}, "slide": {"history", "slide"}, "friction": {"friction"}}[kind]
    assert {"maps", "section", "surface", *own} <= {name for name, *_ in figures_of(ds)}


@pytest.mark.parametrize("kind", ["slide", "friction"])
def test_twice_the_kernel__is_half_the_modulus(kind):
    _, solve = KINDS[kind]
    own, softer = (solve(body) for body in (rv.Body(RUBBER, Scaled(2.0)), rv.zener(0.5e6, 0.15e6, 0.15e3)))
    for name in ("contact_area", "approach", "friction_coefficient"):
        np.testing.assert_allclose(own[name], softer[name], rtol=1e-9)
