"""The contact area with the interval that it is stated in, and with the error of its grid."""

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.mechanics import closed_forms
from roughvisc.mechanics.stepping import attempt

SHAPE, SIZE, APEX = (35, 32), (1.6, 1.5), (0.81, 0.735)
CELL = SIZE[0] * SIZE[1] / (SHAPE[0] * SHAPE[1])
X, Y = ((np.arange(n) + 0.5) * side / n for n, side in zip(SHAPE, SIZE, strict=True))
#: A ball of unit radius whose apex lies anywhere between the cells: they come into contact one by one.
BALL = rv.from_array(-0.5 * ((X[:, None] - APEX[0]) ** 2 + (Y - APEX[1]) ** 2), (X[1] - X[0], Y[1] - Y[0]))
MATERIALS = {
    "zener": rv.zener(1.0, 1.0, 0.3),
    "two_branches": rv.Prony(1.0, 0.0, (1.0, 2.0), (0.1, 3.0)),
}
PULLED = rv.Program().approach(0.06, over=0.8).approach(0.02, over=1.2)
TIMES = tuple(0.1 * n for n in range(1, 21))


def pressed(material, program, **settings):
    return rv.simulate(BALL, material, program, **{"fields": (), "tolerance": 1e-2, "progress": False} | settings)


def cells(ds, name):
    return np.rint(ds[name].values / CELL).astype(int)


@pytest.fixture(scope="module", params=MATERIALS)
def pulled(request):
    """Counts of cells, one column an instant: lower, counted, upper, true; in steps of a tenth and a fortieth.

    True are those in steps of an eightieth. Only the steps leave an error: the contact is solved sharply.
    """
    names = ("contact_area_solver_lower", "contact_area", "contact_area_solver_upper")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(attempt, "_ALGEBRAIC", 1e-6)
        runs = {
            step: pressed(MATERIALS[request.param], PULLED, times=TIMES, time_step=step)
            for step in (0.1, 0.025, 1 / 80)
        }
    true = cells(runs.pop(1 / 80), "contact_area")
    return {step: np.array([*(cells(ds, name) for name in names), true]) for step, ds in runs.items()}


@pytest.mark.parametrize("step", [0.1, 0.025])
def test_true_count__lies_in_the_interval(pulled, step):
    lower, counted, upper, true = pulled[step]
    assert np.all((lower <= true) & (true <= upper)), pulled[step]
    if step == 0.1:  # it is put to the test: the count alone would be wrong
        assert np.any(true != counted)


def test_interval__is_narrow_and_shrinks_with_the_steps(pulled):
    """Steps move the edge of the contact by less than a cell: in doubt are few of the cells along it."""
    undecided = {step: rows[2] - rows[0] for step, rows in pulled.items()}
    edge = 4 * np.sqrt(pulled[0.1][3])  # faces of a square of so many cells, the fewest that any shape has
    assert np.all(undecided[0.1] <= 0.25 * edge)
    assert undecided[0.1].sum() >= 5
    assert undecided[0.025].sum() <= 0.3 * undecided[0.1].sum()


def test_elastic__leaves_no_cell_in_doubt_on_account_of_the_steps(monkeypatch):
    monkeypatch.setattr(attempt, "_ALGEBRAIC", 1e-6)  # nor on account of the solver
    ds = pressed(rv.elastic(1.0), rv.Program().load(0.03, over=1.0).load(0.003, over=1.0), times=TIMES)
    assert np.array_equal(ds.contact_area_solver_lower, ds.contact_area)
    assert np.array_equal(ds.contact_area_solver_upper, ds.contact_area)


def test_interval__holds_what_the_contact_solver_leaves_in_doubt():
    scan = rv.self_affine((1.0, 1.1), (40, 44), hurst=0.8, rms_slope=0.2, shortcut=0.1, seed=3)
    loads = {"boundary": "periodic", "times": [1.0], "fields": (), "progress": False}
    found, true = (
        rv.simulate(scan, rv.elastic(1.0), rv.Program().load(0.03, over=1.0), tolerance=tolerance, **loads)
        for tolerance in (1e-2, 1e-6)
    )
    assert float(found.contact_area[-1]) != float(true.contact_area[-1]), "it is put to the test"
    assert found.contact_area_solver_lower[-1] <= true.contact_area[-1] <= found.contact_area_solver_upper[-1]
    assert found.contact_area_solver_upper[-1] - found.contact_area_solver_lower[-1] < 0.05 * true.contact_area[-1]


@pytest.mark.parametrize("material", [rv.elastic(1.0), MATERIALS["zener"]], ids=["elastic", "zener"])
def test_corrected_area__is_that_of_the_closed_form_within_its_error(material):
    """Under a constant load a ball's contact grows as Hertz's with the compliance of that time (Lee and Radok)."""
    load, times = 0.03, np.array([0.1, 0.4, 1.5])
    ball = rv.sphere(1.0, (1.3, 1.2), (35, 31))
    ds = rv.simulate(
        ball, material, rv.Program().load(load, over=0).hold(1.5), times=times, grid_error=True, progress=False
    )
    exact = np.pi * closed_forms.lee_radok_step(1.0, material, load).radius(times) ** 2
    off = np.abs(ds.contact_area.values / exact - 1)
    assert np.all(off <= ds.grid_error_area)
    assert np.all(ds.grid_error_area <= 0.1)
