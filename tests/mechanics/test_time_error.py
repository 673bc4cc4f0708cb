"""What is stated of the accuracy of each row, against marches at a fraction of the tolerance."""

from dataclasses import replace

import numpy as np
import pytest
import support

import roughvisc as rv
from roughvisc.experiment.rows import error_columns, meets_tolerance
from roughvisc.mechanics import stepping
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.memory import Memory
from roughvisc.mechanics.stepping import Scene, march

TOLERANCE, SHARPER = 1e-2, 30
MATERIALS = {
    "maxwell": rv.maxwell(1.0, 1.0),
    "zener": rv.zener(1.0, 1.0, 0.5),
    "two_branches": rv.Prony(1.0, 0.0, (1.0, 2.0), (0.1, 3.0)),
}
PROGRAMS = {
    "held_load": rv.Program().load(0.03, over=0).hold(2.0),
    "triangle": rv.Program().load(0.03, over=1.0).load(0.006, over=1.0),
    "held_approach": rv.Program().approach(0.06, over=0.5).hold(1.5),
    "pulled": rv.Program().approach(0.06, over=0.7).approach(0.02, over=1.3),
    "cycles": rv.Program.cycle(0.02, 0.01, 1.0, 2.0),
}
TIMES = (0.05, 0.2, 0.33, 0.5, 0.7, 0.77, 1.0, 1.1, 1.4, 1.7, 2.0)


def sphere(material, program, **settings):
    return support.scene(material, program, shape=(19, 16), size=1.5, **settings)


def rough(material, program, **settings):
    """Waves with random phases, pressed with periodic boundaries."""
    shape, spacing = (18, 15), (0.06, 0.07)
    rng = np.random.default_rng(5)
    x, y = (2 * np.pi * np.arange(n) / n for n in shape)
    height = np.zeros(shape)
    for i in range(4):
        for j in range(-3, 4):
            if i or j > 0:
                phase = i * x[:, None] + j * y[None, :] + 2 * np.pi * rng.random()
                height += 0.02 * (i**2 + j**2) ** -0.9 * np.cos(phase)
    gap = height.max() - height
    memory = Memory(material, program.duration)
    return Scene(Grid(shape, spacing, "periodic"), gap, memory, program, settings.pop("times", None), **settings)


SURFACES = {"sphere": sphere, "rough": rough}


def rows_of(scene, steps):
    """Steps, and the largest force and approach so far, by the time."""
    found, largest = {}, (0.0, 0.0)
    for step in steps:
        largest = max(largest[0], step.point.force), max(largest[1], abs(step.point.approach))
        found[step.point.time] = step, largest
    return found


def kept(scene):
    return {time: row for time, row in rows_of(scene, march(scene)).items() if scene.keeps(time)}


def true_errors(scene, found, exact):
    """Of each row: the largest of pressure, force and approach, over the largest of them so far."""
    return np.array([_true_error(scene, step, *exact[time]) for time, (step, _) in found.items()])


def _true_error(scene, step, exact, largest):
    one, other, (force, approach) = step.point, exact.point, largest
    pressure = scene.grid.cell_area * float(np.abs(one.pressure - other.pressure).sum())
    return max(pressure / force, abs(one.force - other.force) / force, abs(one.approach - other.approach) / approach)


def stated(scene, row):
    step, largest = row
    return error_columns(step, scene, 0.0, largest)


@pytest.fixture(scope="module")
def matrix():
    """Rows of all cases, and those of the same at a thirtieth of the tolerance; only the steps leave an error."""
    cases = {}
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(stepping, "SOLVER_SHARE", 1e-4)
        for name in ("maxwell", "two_branches"):
            for what, program in PROGRAMS.items():
                for surface, make in SURFACES.items():
                    coarse, fine = (
                        make(MATERIALS[name], program, times=TIMES, tolerance=t)
                        for t in (TOLERANCE, TOLERANCE / SHARPER)
                    )
                    cases[name, what, surface] = coarse, kept(coarse), kept(fine)
    return cases


@pytest.mark.thorough
def test_time_error__covers_the_true_one_and_not_by_far(matrix):
    true = np.concatenate([true_errors(*rows) for rows in matrix.values()])
    said = np.array([stated(scene, row)["time_error"] for scene, found, _ in matrix.values() for row in found.values()])
    seen = true > 1e-3 * TOLERANCE
    assert np.count_nonzero(seen) > 150
    assert np.mean(said[seen] >= 0.8 * true[seen]) >= 0.97, np.sort(said[seen] / true[seen])[:10]
    assert np.median(said[seen] / true[seen]) <= 5
    assert np.mean(true <= TOLERANCE) >= 0.98


@pytest.mark.thorough
def test_approach_error__is_zero_if_the_approach_is_given(matrix):
    for (_, what, _), (scene, found, _) in matrix.items():
        rows = [stated(scene, row) for row in found.values() if row[0].point.force > 0]
        is_given = what in ("held_approach", "pulled")
        assert all((row["approach_error"] == 0) is is_given for row in rows)


def test_approach_error__is_not_zero_if_a_hold_keeps_the_force_that_was_found():
    program = rv.Program().approach(0.06, over=0.5).hold(1.0, control="load")
    scene = sphere(MATERIALS["zener"], program, times=(0.25, 1.0, 1.5), tolerance=TOLERANCE)
    rows = [stated(scene, row) for row in kept(scene).values()]
    assert [row["approach_error"] > 0 for row in rows] == [False, True, True]


@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("what", PROGRAMS)
def test_every_step_that_is_a_row__keeps_the_tolerance(what, surface):
    scene = SURFACES[surface](MATERIALS["zener"], PROGRAMS[what], tolerance=TOLERANCE)
    rows = rows_of(scene, march(scene))
    found = {t: row for t, row in rows.items() if meets_tolerance(row[0], scene, stated(scene, row)["stated_error"])}
    exact = kept(replace(scene, kept=tuple(found), tolerance=TOLERANCE / SHARPER))
    later = {time: row for time, row in found.items() if row[0].point.force > 0}
    assert len(later) > 5
    assert true_errors(scene, later, exact).max() <= TOLERANCE


def test_row_right_after_a_corner__is_judged():
    """The program of docs/howto/programs.md: pulled back from a hold, and asked a fifth of the way."""
    times = (0.1, 0.3, 0.5, 0.6)
    program = rv.Program.table([0.0, 0.1, 0.5, 1.0], [0.0, 40e-6, 40e-6, 10e-6], control="approach")
    ball, rubber = rv.sphere(10e-3, 2.4e-3, 31), rv.zener(3e6, 1e6, 1e5)
    coarse, fine = (
        rv.simulate(ball, rubber, program, times=times, tolerance=t, progress=False, fields=()) for t in (1e-2, 1e-4)
    )
    off = np.abs(coarse.force - fine.force).values
    assert off[-1] < 1e-2 * float(fine.force.max())
    assert np.all(off <= coarse.stated_error.values * float(coarse.force.max()) / 0.8)


@pytest.mark.parametrize("what", ["triangle", "pulled"])
def test_material_that_relaxes_at_once__takes_the_steps_of_an_elastic_one(what):
    """A Kelvin element 1e8 times faster than the program is a spring."""
    settings = {"times": TIMES, "tolerance": 1e-3}
    quick = list(march(sphere(rv.zener(1.0, 1.0, 1e-8), PROGRAMS[what], **settings)))
    limit = list(march(sphere(rv.elastic(0.5), PROGRAMS[what], **settings)))
    assert len(quick) <= 3 * len(limit)
    found, exact = ({step.point.time: step.point for step in steps} for steps in (quick, limit))
    for name in ("force", "approach"):
        one, other = (np.array([getattr(rows[t], name) for t in TIMES]) for rows in (found, exact))
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-3 * other.max())
