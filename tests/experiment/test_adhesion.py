"""Sticky contact: equilibrium of a state, pull-off, branches of an elastic body, and what is refused."""

import math
import re

import numpy as np
import pytest
from references.rings import retracted
from support import refused

import roughvisc as rv
from roughvisc.mechanics.grid import Grid

#: A soft ball at Tabor 1: radius, contact modulus, work and range.
RADIUS, MODULUS, WORK = 1e-5, 1e6, 5e-3
RANGE = (RADIUS * WORK**2 / MODULUS**2) ** (1 / 3)
STICKY = rv.adhesion(work=WORK, range=RANGE)
GEL = rv.elastic(shear_modulus=MODULUS / 4)
PULLED = rv.Program().approach(RANGE, over=1).approach(-4 * RANGE, over=1)


def ball(cells=26, size=140 * RANGE):
    return rv.sphere(radius=RADIUS, size=size, shape=cells)


def press(surface, program=PULLED, material=GEL, adhesion=STICKY, **options):
    return rv.simulate(surface, material, program, adhesion=adhesion, progress=False, **options)


@pytest.mark.parametrize("boundary", ["free", "periodic", "mirror"])
def test_state__is_in_equilibrium(boundary):
    """Open cells carry the tension of their gap, contact cells no larger one, and the displacement is that of both."""
    rng = np.random.default_rng(3)
    heights = 0.4 * RANGE * rng.standard_normal((13, 10))
    heights[3, 4:6] = np.nan
    side = 0.4 * RANGE**2 * MODULUS / WORK
    surface = rv.from_array(heights, spacing=side)
    program = rv.Program().approach(0.9 * RANGE, over=1).approach(0.1 * RANGE, over=1)
    ds = press(
        surface,
        program,
        boundary=boundary,
        missing="absent",
        tolerance=1e-7,
        times=[0.5, 2],
        fields=("pressure", "gap", "displacement"),
        edge="accept",
    )
    grid = Grid((13, 10), (side, side), boundary)
    for row in range(2):
        pressure, gap = ds.pressure.values[row], ds.gap.values[row]
        tension = STICKY.strength * np.exp(-gap / RANGE)
        contact, solid = gap == 0, np.isfinite(gap)
        assert 1 < contact.sum() < 120
        largest = np.abs(pressure).max()
        np.testing.assert_allclose(pressure[solid & ~contact], -tension[solid & ~contact], atol=1e-5 * largest)
        assert (pressure[contact] > -STICKY.strength * (1 + 1e-5)).all()
        assert (pressure[~solid] == 0).all()
        moved = grid.displacement(pressure) / MODULUS
        expected = (ds.approach.values[row] - (np.nanmax(heights) - heights) + gap)[solid]
        np.testing.assert_allclose(moved[solid], expected, atol=1e-5 * RANGE)
        assert float(ds.adhesive_force[row]) == pytest.approx(tension[solid].sum() * side**2, rel=1e-6)
        assert float(ds.contact_area[row]) < contact.sum() * side**2


@pytest.mark.parametrize(
    ("program", "lowest"),
    [
        (rv.Program.table([0, 1], [0, -1.0]), -1.0),
        (rv.Program.table([0], [-1.0], "pressure"), -1.0),
        (rv.Program.cycle(1.0, 2.0, 1.0, 3), -1.0),
    ],
)
def test_tension__needs_adhesion(program, lowest):
    with refused("program", lowest):
        press(ball(), program, adhesion=None)
    with refused("program", lowest):
        press(ball(), program, adhesion=rv.adhesion(work=0, range=RANGE))


def test_unsupported_bodies_and_motions__are_refused_by_name():
    wave = rv.wavy(RANGE, 20 * RANGE, 20 * RANGE, 40)
    slide = rv.Program().approach(0, over=0).slide(3 * RANGE, over=1)
    with refused("adhesion", STICKY):
        press(wave, slide)
    with refused("adhesion", STICKY):
        press(wave, material=rv.sheet(GEL, 1e-6))
    with refused("device", "gpu"):
        press(wave, numerics=rv.Numerics(device="gpu"))
    with refused("range", "both"):
        rv.adhesion(work=1, range=1, strength=1)


def test_coarse_cells__are_refused_with_the_cell_that_fits():
    side = 2.5 * RANGE**2 * MODULUS / WORK
    with refused("adhesion.range", RANGE) as error:
        press(ball(25, 25 * side), PULLED)
    assert "cells of at most" in str(error.value)
    assert math.isfinite(float(press(ball(25, 25 * side / 4)).force[-1]))


def test_elastic_body__follows_its_branch_and_states_what_its_jumps_dissipate():
    """Advancing and retracting surfaces jump at other approaches; a closed path dissipates the work done on it."""
    soft = rv.elastic(shear_modulus=MODULUS / 10)
    program = rv.Program().approach(-8 * RANGE, over=0).approach(0, over=1).approach(-8 * RANGE, over=2)
    ds = press(ball(35, 126 * RANGE), program, soft, tolerance=1e-2, edge="accept")
    steps = rv.observables.history(ds)
    jumps = np.flatnonzero(steps.status == 3)
    first, last = steps.approach.values[jumps[[0, -1]]]
    assert last < first - RANGE / 3
    assert (np.abs(np.diff(steps.approach))[jumps - 1] < 1e-2 * RANGE).all(), "a row before and one after"
    lost = np.diff(steps.dissipated_energy)[jumps - 1]
    assert (lost > 0).all()
    assert float(ds.work[-1]) == pytest.approx(lost.sum(), rel=2e-2)
    assert (ds.adhesive_force >= -ds.force * (1 - 1e-9)).all()
    found = rv.observables.pull_off(ds)
    assert float(found.pull_off_force[0]) == -float(steps.force.min())
    assert float(found.pull_off_time[0]) < float(steps.time[jumps[-1]])
    assert float(found.work_of_separation[0]) > lost.max()


@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_convolutions__are_less_than_three_times_those_without_adhesion(boundary):
    side = 0.4 * RANGE**2 * MODULUS / WORK
    rough = rv.self_affine(24 * side, 24, hurst=0.8, rms_height=RANGE, rolloff=12 * side, shortcut=4 * side, seed=1)
    surface = ball() if boundary == "free" else rough
    options = {"boundary": boundary, "times": 17, "tolerance": 1e-3, "edge": "accept"}
    program = rv.Program().approach(2 * RANGE, over=1).approach(RANGE, over=1)
    zener = rv.zener(MODULUS / 2, MODULUS / 2, MODULUS / 2)
    needed = [
        int(rv.observables.history(press(surface, program, zener, adhesion, **options)).convolutions.sum())
        for adhesion in (STICKY, None)
    ]
    assert needed[0] < 3 * needed[1]


def test_load_below_the_pull_off__is_refused_with_the_largest_tension():
    largest = 1.66 * math.pi * WORK * RADIUS  # at Tabor 1
    program = rv.Program().load(0, over=0).load(-2 * largest, over=1)
    with refused("load") as error:
        press(ball(), program, tolerance=1e-2, edge="accept")
    assert 0.95 < float(str(error.value).split("at least -")[1].split()[0]) * 1e-9 / largest < 1.02


def test_pull_off_of_an_elastic_ball__is_that_of_dense_rings():
    zero_load = (4.5 * math.pi * WORK / MODULUS * RADIUS**2) ** (1 / 3)
    depth = math.pi ** (2 / 3) * RANGE
    surface = rv.sphere(radius=RADIUS, size=4 * zero_load, shape=36)
    program = rv.Program().approach(0, over=0).approach(-depth, over=1)
    ds = press(surface, program, times=41, edge="accept", tolerance=1e-2)
    rings = retracted(1.0, 1.0, 1.0, 0, -depth / RANGE, hold=1e-2, count=150, steps=60)
    pull_off = -float(ds.force.min()) / (math.pi * WORK * RADIUS)
    assert pull_off == pytest.approx(-rings[:, 1].min(), rel=0.015)
    assert 1.5 < pull_off < 2, "between Johnson, Kendall, Roberts and Derjaguin, Muller, Toporov"


def test_viscoelastic_pull_off__is_that_of_dense_rings():
    """Pulled off fast the body is stiff behind the contact line, and carries more than at rest."""
    program = rv.Program().approach(RANGE, over=0).hold(5).approach(-8 * RANGE, over=0.9)
    zener = rv.zener(MODULUS, MODULUS / 3, MODULUS / 3)  # a quarter of the compliance at once
    ds = press(ball(), program, zener, times=[5, *np.linspace(5.1, 5.9, 17)], tolerance=1e-2, edge="accept")
    rings = retracted(1.0, 0.25, 10.0, 1.0, -8.0, hold=5.0, count=120, steps=150)
    found = ds.force.values / (math.pi * WORK * RADIUS)
    assert found[0] == pytest.approx(rings[60, 1], rel=0.03)
    assert found.min() == pytest.approx(rings[:, 1].min(), rel=0.02)
    assert found.min() < -1.05 * 1.664


def test_no_work__is_no_adhesion():
    program = rv.Program().approach(2 * RANGE, over=0.2).hold(0.3)
    zener = rv.zener(MODULUS, MODULUS, MODULUS)
    none, zero = (press(ball(), program, zener, adhesion=one, times=4) for one in (None, rv.adhesion(work=0, range=1)))
    np.testing.assert_array_equal(zero.pressure, none.pressure)
    little = press(ball(), program, zener, adhesion=rv.adhesion(work=1e-9 * WORK, range=RANGE), times=4, tolerance=1e-5)
    np.testing.assert_allclose(little.force, none.force, atol=2e-3 * float(none.force.max()))


def test_study_with_adhesion__is_read_swept_and_planned(study):
    text = f"""
[surface]
generate = "sphere"
radius = {RADIUS}
size = {140 * RANGE}
shape = 26
[material]
model = "elastic"
shear_modulus = {MODULUS / 4}
[adhesion]
work = "5 mJ/m2"
range = "{RANGE * 1e9} nm"
[[program]]
load = "-1 nN"
over = "1 s"
[solve]
tolerance = 0.1
[keep]
times = [0, 1]
[sweep]
"adhesion.work" = ["5 mJ/m2", "50 mJ/m^2"]
"""
    first, second = study(text)
    assert first.settings.adhesion == rv.adhesion(work=WORK, range=float(f"{RANGE:.15g}"))
    assert first.key != second.key
    assert rv.Case.from_json(first.to_json()).key == first.key
    planned = rv.plan([first, second])
    assert planned.refusal.values[0] == ""
    assert "adhesion.range" in str(planned.refusal.values[1])
    without = re.sub(r"\[adhesion\].*?(?=\[\[)", "", text.partition("[sweep]")[0], flags=re.S)
    with refused("program.0.load", "-1 nN"):
        study(without)


def test_maps_of_tension__have_zero_in_the_middle_of_their_scale():
    program = rv.Program().approach(RANGE, over=0).approach(-2 * RANGE, over=1)
    ds = press(ball(), program, times=[0, 0.5, 1], tolerance=1e-2, edge="accept")
    figure = rv.plot.maps(ds, times=[0, 0.5, 1], fields="pressure")
    images = [image for axes in figure.axes for image in axes.images]
    assert [image.norm(0.0) for image in images[:3]] == [0.5, 0.5, 0.5]
    assert all(image.norm.vmin < 0 < image.norm.vmax for image in images[:3])
    cells = rv.observables.contact(ds).sum(("x", "y")).values
    assert cells[0] > (ds.pressure[0] > 0).sum(), "contact cells may be under tension"


def test_work_of_a_fast_retraction_after_a_hold__is_that_at_a_sharper_tolerance():
    """The tension passes its largest value soon after the corner, and is gone at the end of the segment."""
    side, rubber = 7e-6, rv.zener(0.3e6, 0.1e6, 5e4)
    surface = rv.self_affine(side, 48, hurst=0.8, rms_height=4e-8, rolloff=3.5e-6, shortcut=6e-7, seed=2)
    sticky = rv.adhesion(work="5 mJ/m2", range="60 nm")
    program = rv.Program().approach(6e-8, over=0).hold(0.3).approach(-4e-7, over=0.1)
    loose, sharp = (
        press(surface, program, rubber, sticky, boundary="periodic", tolerance=one, fields=(), times=24)
        for one in (1e-2, 3e-3)
    )
    off = abs(float(loose.work[-1] - sharp.work[-1]))
    assert off <= float(loose.work_error[-1] + sharp.work_error[-1])
    assert off < 0.02 * float(sharp.work[-1])
