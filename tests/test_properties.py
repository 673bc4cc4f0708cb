"""Properties of whole runs, over random materials, programs and surfaces: symmetries, scaling, monotony, optimality."""

import importlib
import pathlib

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from strategies import boundaries, decades, of_whole_runs, stiffened, surfaces

import roughvisc as rv

TOLERANCE = 1e-3


def load_for(material):
    return 5e-3 / float(material.contact_compliance(2.0))


def simulate(height, material, program, boundary, **options):
    settings = {"edge": "accept", "times": 4, "tolerance": TOLERANCE, "progress": False}
    return rv.simulate(height, material, program, boundary=boundary, **{**settings, **options})


def ramp(load):
    return rv.Program().load(load, over=0.5).hold(1.0).load(0.3 * load, over=0.5)


def differs(one, other):
    """Difference of a quantity: in the sum over the grid, over its largest."""
    apart, whole = (np.abs(a).reshape(len(a), -1).sum(axis=1) for a in (one - other, one))
    return float(np.max(apart) / np.max(whole))


@of_whole_runs
@given(surfaces(), stiffened(), boundaries, decades, decades)
def test_turned_mirrored_and_scaled_problem__has_the_turned_mirrored_and_scaled_result(height, make, boundary, e, h):
    """Stiffness and load together change the pressure alone; heights and load together scale the approach as well."""
    load = load_for(make(1.0))
    one = simulate(height, make(1.0), ramp(load), boundary)
    turned = height.T.rename(x="y", y="x")
    turned = turned.copy(data=h * turned.values[::-1])
    other = simulate(turned, make(e), ramp(load * e * h), boundary)
    back = other.pressure.values[:, ::-1].swapaxes(1, 2) / (e * h)
    assert differs(one.pressure.values, back) < 2 * TOLERANCE
    assert differs(one.approach.values, other.approach.values / h) < 2 * TOLERANCE


@of_whole_runs
@given(surfaces(), stiffened(), boundaries)
def test_more_load__presses_every_cell_at_least_as_much(height, make, boundary):
    """Elastic contact is monotone in the load; so is a growing viscoelastic one in approach and area."""
    load = load_for(make(1.0))
    less, more = (simulate(height, make(1.0), rv.Program().load(f * load, over=1.0), boundary) for f in (1.0, 1.5))
    slack = 2 * TOLERANCE * float(more.approach.max())
    assert (more.approach >= less.approach - slack).all()
    assert (more.contact_area >= less.contact_area).all()
    assert (np.diff(more.approach) >= -slack).all()


@of_whole_runs
@given(surfaces(), stiffened(), boundaries)
def test_work_from_rest__is_never_negative(height, make, boundary):
    load = load_for(make(1.0))
    program = (
        rv.Program().load(load, over=0.3).load(0, over=0).hold(0.4).load(2 * load, over=0).load(0.1 * load, over=1)
    )
    ds = simulate(height, make(1.0), program, boundary, times=9)
    assert (ds.work >= -TOLERANCE * float(ds.force.max()) * float(abs(ds.approach).max())).all()


def test_random_cases__are_contact_states(monkeypatch, capsys):
    """A few of the cases of workflows/benchmarks/random_cases.py."""
    monkeypatch.syspath_prepend(str(pathlib.Path(__file__).parents[1] / "workflows" / "benchmarks"))
    random_cases = importlib.import_module("random_cases")
    assert random_cases.main(15, seed=7) == 0, capsys.readouterr().out
    ds = simulate(rv.sphere(1.0, 1.0, 9), rv.elastic(1.0), rv.Program().load(0.1, over=0), "free",
                  fields=("pressure", "gap", "displacement"), times=1)  # fmt: skip
    assert random_cases.violations(ds) == []
    for name, wrong in [("pressure", -ds.pressure), ("force", 2 * ds.force), ("displacement", 0 * ds.displacement),
                        ("work", -ds.work), ("approach", ds.approach * np.nan)]:  # fmt: skip
        assert random_cases.violations(ds.assign({name: wrong})), name


@of_whole_runs
@given(surfaces(), stiffened(), boundaries, st.floats(0.1, 0.9), st.sampled_from([0.0, 0.1]))
def test_area__never_shrinks_while_a_lower_load_is_held(height, make, boundary, part, over):
    """Of a linear viscoelastic half-space (arXiv 2511.19402), after any drop of the load.

    Area is counted in cells. A cell at the edge is in contact or not within the stated error, so that the cells which
    are not certainly out of contact at a later time have to be no fewer than those certainly in contact at an earlier
    one. Without these bounds it can fail: 323 runs had one area that was a cell smaller later, within the bounds. A
    material without instantaneous compliance would also fail at a drop itself, of which its result keeps the state
    before it.
    """
    material = make(1.0)
    load = load_for(material)
    program = rv.Program().load(load, over=0.3).hold(0.7).load(part * load, over=over).hold(3.0)
    begin = 1.0 + over
    times = [begin + after for after in (0.0, 0.01, 0.03, 0.1, 0.3, 0.7, 1.4, 3.0)]
    ds = simulate(height, material, program, boundary, times=times, fields=())
    certain, possible = (ds.contact_area.values + sign * ds.contact_area_error.values for sign in (-1, 1))
    cell = 1 / height.size
    assert (possible + 1e-9 * cell >= np.maximum.accumulate(certain)).all()
    assert (certain > 0).any(), "the bounds say something"
