"""The grid's error on request: what it says against closed forms, and how a surface is made coarser."""

import numpy as np
import pytest
from samples import RUBBER
from support import EXACT, LOAD, PRESS, RADIUS, SIZE, TIMES, true_errors

import roughvisc as rv
from roughvisc import closed_forms


def pressed(shape, **settings):
    settings = {"times": TIMES, "tolerance": 1e-3, "progress": False, "grid_error": True, **settings}
    return rv.simulate(rv.sphere(RADIUS, SIZE, shape), RUBBER, PRESS, **settings)


@pytest.mark.parametrize("shape", [(47, 60), (33, 31), 64])
def test_grid_error__bounds_the_true_one_and_is_of_its_size(shape):
    ds = pressed(shape)
    true, true_area = true_errors(ds)
    assert true < float(ds.grid_error.max()) < 8 * true
    assert true_area < float(ds.grid_error_area.max()) < 10 * true_area


@pytest.mark.parametrize("control", ["load", "approach"])
def test_grid_error__of_the_approach_is_small_and_of_a_given_one_zero(control):
    """Under a ball."""
    exact = closed_forms.hertz(RADIUS, 4e6, LOAD)
    program = getattr(rv.Program(), control)(LOAD if control == "load" else exact.approach, over=0)
    ds = rv.simulate(rv.sphere(RADIUS, SIZE, (47, 60)), rv.elastic(1e6), program, grid_error=True, progress=False)
    if control == "load":
        off = abs(float(ds.approach[0]) / exact.approach - 1)
        assert off < float(ds.grid_error_approach[0]) < min(10 * off, 0.2 * float(ds.grid_error[0]))
    else:
        assert abs(float(ds.force[0]) / LOAD - 1) < float(ds.grid_error[0])
        assert float(ds.grid_error_approach[0]) == 0


@pytest.mark.parametrize(("control", "across", "cells"), [("load", 17.82, 50), ("approach", 9.82, 28)])
def test_grid_error__of_a_punch_holds_what_its_cells_are_short_of_a_circle(control, across, cells):
    """So many cells in a radius, where the coarser grids agree by chance."""
    radius = 1e-3
    exact = closed_forms.flat_punch(radius, 4e6, LOAD)
    program = getattr(rv.Program(), control)(LOAD if control == "load" else exact.approach, over=0)
    punch = rv.flat_punch(radius, cells * radius / across, cells)
    ds = rv.simulate(punch, rv.elastic(1e6), program, grid_error=True, progress=False, missing="absent", tolerance=1e-4)
    if control == "load":
        off = abs(float(ds.approach[0]) / exact.approach - 1)
        assert 0.003 < off < float(ds.grid_error_approach[0]) < min(10 * off, 0.1)
    else:  # of pressure and force together
        assert 0.003 < abs(float(ds.force[0]) / LOAD - 1) < float(ds.grid_error[0])


def test_grid_error__of_the_area_of_a_punch_holds_its_outline_in_cells():
    """Of 16 cells in a circle of 19.6, as on the coarser grid; a plate that fills its grid has no such error."""
    settings = {"grid_error": True, "progress": False, "boundary": "free"}
    press = rv.Program().load(LOAD, over=0)
    ds = rv.simulate(rv.flat_punch(2.5e-3, 8e-3, 8), rv.elastic(1e6), press, missing="absent", **settings)
    off = abs(float(ds.contact_area[0]) / (np.pi * 2.5e-3**2) - 1)
    assert 0.1 < off < float(ds.grid_error_area[0]) < 0.5
    plate = rv.from_array(np.zeros((7, 7)), 1e-3)
    assert float(rv.simulate(plate, rv.elastic(1e6), press, edge="accept", **settings).grid_error_area[0]) < 1e-12


def test_grid_error__of_the_gap_of_a_rough_surface_is_small():
    """Against cells a third as long, with the same waves: far below that of the approach, which hangs on the peak."""
    made = {"hurst": 0.8, "rms_slope": 0.1, "shortcut": 2e-4, "rolloff": 5e-4, "seed": 4}
    few, many = (rv.self_affine(1e-3, n, **made) for n in ((33, 30), (99, 90)))
    settings = {"boundary": "periodic", "tolerance": 1e-4, "progress": False}
    program = rv.Program().pressure(2e4, over=0)
    ds = rv.simulate(few, rv.elastic(1e6), program, grid_error=True, **settings)
    exact = rv.simulate(many, rv.elastic(1e6), program, **settings)
    off = abs(exact / ds - 1)
    assert float(off.approach[0]) < float(ds.grid_error_approach[0]) < 10 * float(off.approach[0])
    assert float(off.mean_gap[0]) < float(ds.grid_error_gap[0]) < 0.05
    assert 5 * float(ds.grid_error_gap[0]) < float(ds.grid_error_approach[0])


def test_grid_error__is_large_where_no_grid_sees_the_contact():
    """A ball on one cell and on four: all grids agree on the force there, and none on its shape."""
    for shape in (15, 16):
        few = rv.Program().load(LOAD * (0.4 * SIZE[0] / 15 / float(EXACT.radius(0.0))) ** 3, over=0)
        ball = rv.sphere(RADIUS, SIZE[0], shape)
        ds = rv.simulate(ball, rv.elastic(3e6), few, grid_error=True, progress=False)
        assert int((ds.pressure > 0).sum()) <= 4
        assert float(ds.grid_error[0]) > 0.8
        assert float(ds.grid_error_area[0]) > 0.3


@pytest.mark.parametrize("offset", [(0.5, 0.5), (0.1, -0.4), (0.0, 0.0)])
@pytest.mark.parametrize("control", ["load", "approach"])
def test_grid_error__holds_what_a_peak_between_the_cells_may_hide(offset, control):
    """A cone as data: its peak is in no cell's centre, and force and area under given approach follow from it."""
    cells, side, slope = 24, 1 / 7, 0.01
    exact = closed_forms.cone(slope, 1.0, np.pi / 2 * slope)
    x, y = ((np.arange(cells) - cells // 2 - shift) * side for shift in offset)
    height = rv.from_array(-slope * np.hypot(x[:, None], y), side)
    program = rv.Program().load(np.pi / 2 * slope, over=0)
    if control == "approach":
        program = rv.Program().approach(exact.approach, over=0)
    ds = rv.simulate(height, rv.elastic(0.25), program, boundary="free", grid_error=True, progress=False)
    force = abs(float(ds.force[0]) / (np.pi / 2 * slope) - 1)
    approach = abs(float(ds.approach[0]) / exact.approach - 1)
    assert float(ds.grid_error[0]) > max(force, approach)
    assert (float(ds.grid_error_approach[0]) == 0) == (control == "approach")
    assert float(ds.grid_error_area[0]) > abs(float(ds.contact_area[0]) / np.pi - 1)


def test_grid_error__is_missing_where_the_coarser_solve_fails():
    height = rv.sphere(RADIUS, SIZE, (24, 21)) * 1.0
    height.values[0, 0] -= 1e-9  # no longer the recipe's: it can neither grow nor be made anew
    at_border = {"boundary": "free", "times": TIMES, "progress": False, "grid_error": True, "tolerance": 1e-2}
    inside = 0.456 * SIZE[1]  # the border of these cells, and not of the coarser ones
    load = LOAD * (inside / float(EXACT.radius(0.2))) ** 3
    ds = rv.simulate(height, RUBBER, rv.Program().load(load, over=0).hold(0.2), **at_border)
    assert np.isnan(ds.grid_error).all()
    assert np.isnan(ds.grid_error_area).all()


@pytest.mark.parametrize(("cells", "offset", "along"), [(64, 0.5, "x"), (32, 0.45, "y")])
def test_grid_error__holds_an_opening_that_full_contact_hides(cells, offset, along):
    """Westergaard: at 0.999 of the pressure of full contact 2 % of a wave are open, between two cells."""
    side, amplitude, modulus = 1e-3, 1e-6, 1e6
    x = (np.arange(cells) + offset) / cells
    height = amplitude * np.cos(2 * np.pi * x)[:, None] * np.ones((1, 4))
    wave = rv.from_array(height if along == "x" else height.T, side / cells)
    full = np.pi * 4 * modulus * amplitude / side

    def pressed(part):
        program = rv.Program().pressure(part * full, over=0)
        return rv.simulate(
            wave, rv.elastic(modulus), program, boundary="periodic", grid_error=True, times=1, progress=False
        )

    nearly, well = pressed(0.999), pressed(1.5)
    closed = 2 / np.pi * np.arcsin(np.sqrt(0.999))
    assert float(nearly.contact_fraction[0]) == 1.0
    assert 1 - closed <= float(nearly.grid_error_area[0]) <= 5 * (1 - closed)
    assert float(nearly.mean_gap[0]) == 0
    assert np.isnan(nearly.grid_error_gap).all(), "a gap of zero has no relative error"
    assert float(well.grid_error_gap[0]) == 0
    assert float(well.grid_error_area[0]) < 1e-6
