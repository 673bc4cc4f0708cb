"""The stated error of each row, compared with runs at a fraction of the tolerance."""

import numpy as np
import pytest
from support import at_rows, relative_errors, scene

import roughvisc as rv
from roughvisc.mechanics import stepping
from roughvisc.mechanics.step_control import Controller
from roughvisc.mechanics.stepping import march

TOLERANCE, SHARPER = 1e-2, 30
MATERIALS = {
    "maxwell": rv.maxwell(1.0, 1.0),
    "zener": rv.zener(1.0, 1.0, 0.5),
    "soft": rv.zener(100.0, 1.0, 0.5),
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
SURFACES = {
    "sphere": (rv.sphere(1.0, (1.5, 1.45), (19, 16)), "free"),
    "rough": (rv.self_affine((1.1, 1.05), (18, 15), hurst=0.8, rms_height=0.04, shortcut=0.35, seed=5), "periodic"),
}


def pressed(surface, material, program, tolerance=TOLERANCE, times=TIMES):
    height, boundary = SURFACES[surface]
    settings = {"boundary": boundary, "fields": ("pressure",), "progress": False}
    return rv.simulate(height, material, program, times=times, tolerance=tolerance, **settings)


@pytest.mark.thorough
def test_time_error__covers_the_true_one_and_not_by_far(monkeypatch):
    """If only the steps leave an error. That of a given approach is zero."""
    monkeypatch.setattr(stepping, "SOLVER_PART", 1e-4)
    true, stated = [], []
    for material in ("maxwell", "two_branches"):
        for name, program in PROGRAMS.items():
            for surface in SURFACES:
                found, exact = (
                    pressed(surface, MATERIALS[material], program, one) for one in (TOLERANCE, TOLERANCE / SHARPER)
                )
                true += relative_errors(found, exact).tolist()
                stated += at_rows(found).time_error.values.tolist()
                assert (found.approach_error[1:] == 0).all() == (name in ("held_approach", "pulled"))
    true, stated = np.array(true), np.array(stated)
    seen = true > 1e-3 * TOLERANCE
    assert np.count_nonzero(seen) > 150
    assert np.mean(stated[seen] >= 0.8 * true[seen]) >= 0.97
    assert np.median(stated[seen] / true[seen]) <= 5
    assert np.mean(true <= TOLERANCE) >= 0.98


@pytest.mark.parametrize(
    ("surface", "material", "program"),
    [
        pytest.param("sphere", "soft", "held_load", marks=pytest.mark.thorough),
        *((surface, "zener", program) for surface in SURFACES for program in PROGRAMS),
    ],
)
def test_every_step_that_is_a_row__keeps_the_tolerance(surface, material, program):
    found = pressed(surface, MATERIALS[material], PROGRAMS[program], times=None)
    exact = pressed(surface, MATERIALS[material], PROGRAMS[program], TOLERANCE / SHARPER, found.time.values)
    rows = (found.stated_error <= TOLERANCE).values & (found.force > 0).values
    assert rows.sum() > 5
    true = relative_errors(found, exact)[rows].max()
    assert true <= TOLERANCE
    assert found.stated_error.values[rows].max() < 10 * true


def test_approach_error__is_zero_only_if_the_program_states_the_approach():
    """A hold may keep a force or an approach that was found."""
    force_found = rv.Program().approach(0.06, over=0.5).hold(1.0, control="load")
    approach_found = rv.Program().load(0.03, over=0.5).hold(1.0, control="approach")
    for program, at_first in ((force_found, False), (approach_found, True)):
        found = pressed("sphere", MATERIALS["zener"], program, times=(0.25, 1.0, 1.5))
        assert (found.approach_error > 0).values.tolist() == [at_first, True, True]


def test_row_right_after_a_corner__is_judged():
    """The program of docs/howto/programs.md: pulled back from a hold, and requested a fifth of the way."""
    times = (0.1, 0.3, 0.5, 0.6)
    program = rv.Program.table([0.0, 0.1, 0.5, 1.0], [0.0, 40e-6, 40e-6, 10e-6], control="approach")
    ball, rubber = rv.sphere(10e-3, 2.4e-3, 31), rv.zener(3e6, 1e6, 1e5)
    coarse, fine = (
        rv.simulate(ball, rubber, program, times=times, tolerance=t, progress=False, fields=()) for t in (1e-2, 1e-4)
    )
    off = np.abs(coarse.force - fine.force).values
    assert off[-1] < 1e-2 * float(fine.force.max())
    assert np.all(off <= coarse.stated_error.values * float(coarse.force.max()) / 0.8)


@pytest.mark.parametrize("program", ["triangle", "pulled"])
def test_material_that_relaxes_at_once__takes_the_steps_of_an_elastic_one(program):
    """A Kelvin element 1e8 times faster than the program is a spring."""
    quick, limit = (
        pressed("sphere", material, PROGRAMS[program], 1e-3) for material in (rv.zener(1.0, 1.0, 1e-8), rv.elastic(0.5))
    )
    assert quick.roughvisc.steps.sizes["step"] <= 4 * limit.roughvisc.steps.sizes["step"]
    for name in ("force", "approach"):
        np.testing.assert_allclose(quick[name], limit[name], rtol=0, atol=1e-3 * float(limit[name].max()))


def test_row_in_the_second_half_of_a_pair__states_the_solver_error_of_the_first():
    """It continues from the first step of the pair."""
    program = rv.Program().load(0.03, over=0.5).hold(1.0)
    times = tuple(np.linspace(0.01, 1.5, 150).tolist())
    pair, began, counted = [], 0.0, 0
    for step in march(scene(MATERIALS["zener"], program, times=times)):
        pair.append(step)
        if step.is_end:
            middle = min(pair, key=lambda one: abs(2 * one.point.time - began - step.point.time))
            later = [one for one in pair[:-1] if one.point.time > middle.point.time]
            assert all(one.state.solver_error >= middle.point.solver_error for one in later)
            pair, began, counted = [], step.point.time, counted + len(later)
    assert counted > 5


def test_pair_that_is_refused_for_its_row__is_not_tried_again_at_its_length():
    """If its half adds no less, the next pair is no longer than this half: otherwise nobody would judge the row."""
    again, half = Controller(shortest=0.0).judge(1.0, ratio=0.9, at_row=2.0, opens=False)
    accepted, following = again.judge(half, ratio=0.95, at_row=0.0, opens=False)
    assert accepted is None
    assert following <= half < 1.0


def test_pairs__do_not_become_ever_shorter():
    """An error that no length reduces, twice the allowed one, does not stop the time."""
    length = 1.0
    for _ in range(100):
        controller, length = Controller(shortest=1e-3).judge(length, ratio=2.0, at_row=0.0, opens=False)
        assert controller is None
    assert length == 1e-3
