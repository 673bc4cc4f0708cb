"""The contact area: its interval, its rate of convergence, and the edge of contact where the material ends."""

import math

import numpy as np
import pytest
from samples import UNIT
from support import at_rows

import roughvisc as rv
from roughvisc.mechanics import stepping

SHAPE, SIZE, APEX = (35, 32), (1.6, 1.5), (0.81, 0.735)
CELL = SIZE[0] * SIZE[1] / (SHAPE[0] * SHAPE[1])
X, Y = ((np.arange(n) + 0.5) * side / n for n, side in zip(SHAPE, SIZE, strict=True))
#: A ball of unit radius whose apex lies anywhere between the cells: they come into contact one by one.
BALL = rv.from_array(-0.5 * ((X[:, None] - APEX[0]) ** 2 + (Y - APEX[1]) ** 2), (X[1] - X[0], Y[1] - Y[0]))
MATERIAL = rv.Prony(1.0, 0.0, (1.0, 2.0), (0.1, 3.0))
PULLED = rv.Program().approach(0.06, over=0.8).approach(0.02, over=1.2)
TIMES = tuple(0.1 * n for n in range(1, 21))


def pressed(material, program, **settings):
    return rv.simulate(
        BALL, material, program, **{"boundary": "free", "fields": (), "tolerance": 1e-2, "progress": False} | settings
    )


def cells(ds, name):
    return np.round(ds[name].values / CELL, 6)


@pytest.fixture(scope="module")
def pulled():
    """Areas in cells, one column per instant: found, error, true; in steps of a tenth and a fortieth.

    True are those in steps of an eightieth. Only the steps leave an error: the contact is solved sharply.
    """
    names = ("contact_area", "contact_area_error")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(stepping, "SOLVER_PART", 1e-4)
        runs = {
            step: pressed(MATERIAL, PULLED, times=TIMES, numerics=rv.Numerics(time_step=step))
            for step in (0.1, 0.025, 1 / 80)
        }
    true = cells(runs.pop(1 / 80), "contact_area")
    return {step: np.array([*(cells(ds, name) for name in names), true]) for step, ds in runs.items()}


def test_true_area__lies_in_an_interval_that_shrinks_with_the_steps(pulled):
    """Steps move the edge of the contact by less than a cell: in doubt are few of the cells along it."""
    for found, error, true in pulled.values():
        assert np.all(np.abs(found - true) <= error)
    found, error, true = pulled[0.1]
    assert 0 < error.max() < 10 * np.abs(found - true).max(), "the area alone would be wrong"
    undecided = {step: rows[1] for step, rows in pulled.items()}
    edge = 4 * np.sqrt(pulled[0.1][2])  # faces of a square of so many cells, the fewest that any shape has
    assert np.all(undecided[0.1] <= 0.25 * edge)
    assert undecided[0.1].sum() >= 5
    assert undecided[0.025].sum() <= 0.3 * undecided[0.1].sum()


def test_interval__holds_what_the_contact_solver_leaves_in_doubt():
    scan = rv.self_affine((1.0, 1.1), (40, 44), hurst=0.8, rms_slope=0.2, shortcut=0.1, seed=10)
    loads = np.linspace(0.04, 0.13, 10)
    press = rv.Program()
    for load in loads:
        press = press.load(load, over=1.0)
    settings = {"boundary": "periodic", "times": np.arange(1.0, 11.0), "fields": (), "progress": False}
    found, true = (
        rv.simulate(scan, rv.elastic(1.0), press, tolerance=tolerance, **settings) for tolerance in (5e-2, 1e-6)
    )
    off = abs(found.contact_area - true.contact_area)
    assert (off > 0).any(), "it is put to the test"
    assert (off <= found.contact_area_error).all()
    assert (found.contact_area_error / true.contact_area).mean() < 0.05


def hertz_errors(cells, count=12):
    """Root mean squares of the relative errors of the area and of the count, over places of the apex in its cell."""
    sides, places = (3.2 / cells, 3.2 / (cells - 1)), np.random.default_rng(0).random((count, 2))
    load, exact = 0.1, math.pi * (0.75 * 10.0 * 0.1) ** (2 / 3)  # of a ball of radius 10 and unit contact modulus
    found = []
    for place in places:
        x, y = ((np.arange(n) - n / 2 + at) * d for n, at, d in zip((cells, cells - 1), place, sides, strict=True))
        ball = rv.from_array(-(x[:, None] ** 2 + y**2) / 20.0, sides)
        press = rv.Program().load(load, over=0)
        ds = rv.simulate(ball, rv.elastic(0.25), press, boundary="free", fields=(), progress=False)
        found.append([float(at_rows(ds)[name][0]) / exact - 1 for name in ("contact_area", "contact_area_counted")])
    return np.sqrt(np.mean(np.square(found), axis=0))


def test_area_of_a_hertzian_circle__converges_faster_than_the_count():
    """The count with the side of the cell, the area with its power 1.5: what is left is the scatter of the count."""
    coarse, fine = hertz_errors(12), hertz_errors(96)
    area, count = np.log(coarse / fine) / math.log(8)
    assert area > 1.3
    assert 0.9 < count < 1.2
    assert fine[0] < fine[1] / 4


def pillars():
    """Two by two pillars of four by four cells, four apart; nothing between them."""
    x = np.arange(16) % 8
    inside = (x >= 2) & (x < 6)
    return rv.from_array(np.where(inside[:, None] & inside, 0.0, np.nan), 1.0)


@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_pillars__have_the_area_of_their_cells(boundary):
    ds = rv.simulate(
        pillars(), UNIT, rv.Program().load(1.0, over=0), boundary=boundary, missing="absent", progress=False
    )
    assert at_rows(ds).contact_area_counted.values == pytest.approx(64.0)
    assert ds.contact_area.values == pytest.approx(64.0)
