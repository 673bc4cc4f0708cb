"""Rows of steps made up for the purpose: each number by hand, each field by one convolution over the whole surface."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.experiment.loading import Loading, LoadingRows
from roughvisc.experiment.stated import error_columns, meets_tolerance
from roughvisc.mechanics.bodies.body import body_of
from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.hereditary.exponentials import Modes
from roughvisc.mechanics.sparse import Sparse, Sum
from roughvisc.mechanics.stepping.scene import Scene
from roughvisc.mechanics.stepping.state import Instant, State, Step, Uncertainty
from roughvisc.problem import Problem
from roughvisc.recorder import RowsInMemory
from roughvisc.settings import Settings
from roughvisc.solve import dataset_of
from roughvisc.variables import FIELDS, STATUS_MEANINGS

MATERIAL, PROGRAM = rv.zener(1.0, 1.0, 0.3), rv.Program().load(1.0, over=1.0)


def stood(**changes):
    """What a step must have for what is stated of it; the unknowns have sizes of their own."""
    given = {
        "solver_error": 0.01,
        "bound": 0.3,
        "control": "load",
        "given": True,
        "work": -5.0,
        "stored": 1.5,
        "dissipated": -0.25,
        "shown": SimpleNamespace(force=4.0, approach=-0.2),
        "uncertainty": SimpleNamespace(
            pressure=0.3, force=0.07, approach=0.011, work=0.13, dissipated=0.17, inside=0.6, outside=0.9
        ),
        "state": SimpleNamespace(largest_force=8.0, largest_approach=0.5),
        "scene": SimpleNamespace(is_viscoelastic=True, tolerance=0.1),
    }
    return SimpleNamespace(**given | changes)


def test_stated_errors__add_up_those_of_time_solver_and_series():
    found = error_columns(stood(), 0.03)
    solved = 0.01 + 0.02 * 0.1  # now, and what of before is left
    assert found["pressure_error"] == pytest.approx((0.3 + solved * 4.0) / 8.0 + 0.03)
    assert found["force_error"] == 0, "given"
    assert found["approach_error"] == pytest.approx(0.011 + 0.045 * 0.2 + 0.03 * 0.5 + 0.005 * 0.1 * 0.5)
    assert found["stated_error"] == pytest.approx(max(found["pressure_error"], found["approach_error"] / 0.5))
    assert found["work_error"] == pytest.approx(0.13 + (0.5 * solved + 0.03) * 5.0)
    assert found["dissipated_energy_error"] == pytest.approx(0.17 + (0.5 * solved + 0.03) * 0.25)
    assert (found["residual"], found["residual_bound"]) == (0.01, 0.3)


@pytest.mark.parametrize(
    ("control", "given", "force", "approach"),
    [("load", True, False, True), ("approach", True, True, False), ("load", False, True, True),
     ("approach", False, True, True)],
)  # fmt: skip
def test_stated_error__of_what_the_program_gives_is_none(control, given, force, approach):
    found = error_columns(stood(control=control, given=given), 0.03)
    solved = 0.01 + 0.02 * 0.1
    assert found["force_error"] == pytest.approx((0.07 + solved * 4.0 + 0.03 * 8.0) * force)
    assert found["approach_error"] == pytest.approx((0.011 + 0.045 * 0.2 + 0.03 * 0.5 + 0.005 * 0.1 * 0.5) * approach)


@pytest.mark.parametrize(("worst", "expected"), [("pressure", 0.5), ("force", 0.6), ("approach", 0.7)])
def test_stated_error__is_the_largest_relative_one(worst, expected):
    sizes = {"pressure": 0.2 * 8.0, "force": 0.2 * 8.0, "approach": 0.2 * 0.5}
    sizes[worst] *= expected / 0.2
    unknown = SimpleNamespace(**sizes, work=0.0, dissipated=0.0, inside=0.0, outside=0.0)
    exact = {"solver_error": 0.0, "bound": 0.0, "given": False, "uncertainty": unknown}
    scene = SimpleNamespace(is_viscoelastic=False, tolerance=0.1)
    least = 0.015 * 0.1 * 4.0 / 8.0  # stated of an elastic pressure in any case
    found = error_columns(stood(**exact, scene=scene), 0.0)["stated_error"]
    assert found == pytest.approx(expected + least * (worst != "approach"))


def test_stated_errors__of_surfaces_that_never_touched_are_those_of_the_solver():
    rest = SimpleNamespace(largest_force=0.0, largest_approach=0.0)
    nothing = SimpleNamespace(force=0.0, approach=0.0)
    unknown = SimpleNamespace(**dict.fromkeys(("pressure", "force", "approach", "work", "dissipated"), 0.0))
    unknown.inside = unknown.outside = 0.0
    found = error_columns(stood(state=rest, shown=nothing, uncertainty=unknown), 0.03)
    assert found["pressure_error"] == found["stated_error"] == 0.01
    assert found["force_error"] == found["approach_error"] == 0
    # without a past there is none whose errors are left
    found = error_columns(stood(scene=SimpleNamespace(is_viscoelastic=False, tolerance=0.1)), 0.0)
    assert found["pressure_error"] == pytest.approx((0.3 + 0.01 * 4.0) / 8.0)


def judged(*, soft=False, fixed=None, since=1.0, step=0.5, entered=False, control="load", **changes):
    """Whether a step is a row, of a march that began at 3 s and allows an error of 0.1."""
    now = SimpleNamespace(time=3.0 + since, pressure=np.array([1.0, 2.0 if entered else 0.0]))
    before = SimpleNamespace(time=now.time - step, pressure=np.array([3.0, 0.0]))
    state = SimpleNamespace(
        largest_force=8.0, largest_approach=0.5, largest_work=5.0, now=now, before=before, began=3.0
    )
    scene = SimpleNamespace(
        is_viscoelastic=True,
        tolerance=0.1,
        time_step=fixed,
        motions=(),
        is_soft=soft,
    )
    return meets_tolerance(stood(state=state, scene=scene, control=control, **changes), 0.0)


def off(approach=0.0, pressure=0.0):
    sizes = dict.fromkeys(("force", "work", "dissipated", "inside", "outside"), 0.0)
    return {"bound": 0.0, "uncertainty": SimpleNamespace(approach=approach, pressure=pressure, **sizes)}


def test_step__is_a_row_if_what_is_stated_of_it_is_within_the_tolerance():
    assert judged(**off(approach=0.049))
    assert not judged(**off(approach=0.051))
    assert not judged(**off(pressure=0.9))
    assert judged(**off(pressure=0.9), fixed=0.5), "fixed steps are all kept"
    assert judged(**off(), entered=True, control="approach")


def test_step__on_a_soft_material_is_a_row_if_its_approach_is_known_and_no_jump_is_in_it():
    assert judged(soft=True, **off(approach=0.049, pressure=0.9))
    assert not judged(soft=True, **off(approach=0.051))
    # steps shorter than the tolerance, over what has passed of the segment, lead over a jump
    assert judged(soft=True, **off(), since=2.0, step=0.21)
    assert not judged(soft=True, **off(), since=2.0, step=0.19)
    assert judged(soft=True, **off(), entered=True)
    assert not judged(soft=True, **off(), entered=True, control="approach")
    assert judged(soft=True, **off(), control="approach")


class Kept:
    """Rows of a surface, and the steps that they were made of."""

    def __init__(self, height, *, tolerance=1e-5, fields=FIELDS, **settings):
        self.height, self.seed = height, 0
        settings = Settings(**{"boundary": "free", "tolerance": tolerance, "fields": fields} | settings)
        self.problem = Problem(height, body_of(MATERIAL), settings)
        self.rows, self.store = LoadingRows(self.problem, PROGRAM), RowsInMemory()
        self.profile, self.scene = self.rows.profile, self.rows._scene

    def add(self, level, *, part=0.3, converged=True, force=1.0, iterations=5, time=0.5):
        """Take up a step with some pressure and some effective pressure in the window; give both on its domain."""
        self.seed += 1
        rng = np.random.default_rng(self.seed)
        shape, window = self.scene.operator.shape, self.profile.window
        pressure, source = rng.random(shape) * (rng.random(shape) < part), 1e-3 * rng.random(shape)
        if self.scene.present is not None:
            pressure, source = pressure * self.scene.present, source * self.scene.present
        shown = Instant(time, Sparse.of(pressure), force, 0.25)
        state = State(shown, pressure, None, largest_force=1.0, iterations=iterations, convolutions=2 * iterations)
        step = Step(
            shown, Sum.whole(self.scene.operator.displacement(source)), source, level, "load", True, 0.0, 0.0,
            Uncertainty(), converged, self.scene, state,
        )  # fmt: skip
        self.record(step, converged)
        whole = np.zeros((2, *window.domain))
        whole[0][window.cells], whole[1][window.cells] = pressure, source
        return whole

    def record(self, step, converged=True):
        """Take up a step, as the driver does."""
        row = self.rows.row(step, converged)
        values = {"time": row.at, **row.values, "wall_time": 7.0}
        self.store.append({"row": values, "kept": row.kept, "facts": row.facts}, row.fields)

    def dataset(self):
        return dataset_of(self.problem, Loading(PROGRAM), self.rows, self.store)

    def expected(self, pressure, source, level):
        """Displacement and gap over the domain, as the surface is now."""
        spacing = self.profile.spacing
        displacement = Operator(pressure.shape, spacing, mirrored=self.profile.mirrored).displacement(source)
        gap = np.where(pressure > 0, 0.0, np.maximum(self.profile.gap + displacement - level, 0.0))
        return displacement, np.where(self.profile.present, gap, np.nan)


def surface(kept, field):
    """A field of the domain over all of the surface."""
    return np.block([[field[::-1, ::-1], field[::-1]], [field[:, ::-1], field]]) if kept.profile.mirrored else field


BALL = rv.sphere(1.0, (0.9, 1.0), (11, 14))
HOLED = BALL.copy()
HOLED.values[2:5, 3] = np.nan
CASES = {
    "whole": lambda: Kept(BALL, edge="accept"),
    "absent": lambda: Kept(HOLED, missing="absent", edge="accept"),
    "mirrored": lambda: Kept(rv.sphere(1.0, (0.9, 1.0), (12, 14)), edge="accept"),
    "window": lambda: Kept(rv.sphere(1.0, (0.9, 1.0), (97, 102))),
    "quarter's window": lambda: Kept(rv.sphere(1.0, (0.9, 1.0), (98, 102))),
}


@pytest.mark.parametrize("case", CASES)
def test_row__is_counted_and_shown_over_the_whole_surface(case):
    kept = CASES[case]()
    assert kept.profile.window.whole == ("window" not in case)
    assert kept.profile.mirrored == (case in ("mirrored", "quarter's window"))
    size = kept.height.size
    images = 4 if kept.profile.mirrored else 1
    cell = float(np.prod(kept.profile.spacing))
    levels = (0.02, 0.05)
    wholes = [kept.add(level, iterations=5 + 6 * i, time=0.5 + i) for i, level in enumerate(levels)]
    assert kept.rows.order(kept.store) == [0, 1]
    ds = kept.dataset()
    assert ds.time.values.tolist() == [0.5, 1.5]
    assert ds.iterations.values.tolist() == [5, 6]
    assert ds.convolutions.values.tolist() == [10, 12]
    assert (ds.force.values == 1).all()
    assert (ds.approach.values == 0.25).all()
    assert (ds.wall_time.values == 7).all()
    assert np.array_equal(ds.height.values, kept.height.values, equal_nan=True)
    for i, ((pressure, source), level) in enumerate(zip(wholes, levels, strict=True)):
        displacement, gap = kept.expected(pressure, source, level)
        assert np.array_equal(ds.pressure[i].values, surface(kept, pressure))
        assert ds.displacement[i].values == pytest.approx(surface(kept, displacement), rel=1e-9)
        assert ds.gap[i].values == pytest.approx(surface(kept, gap), rel=1e-9, abs=1e-9, nan_ok=True)
        touching = images * np.count_nonzero(pressure)
        assert ds.contact_area_counted[i] == pytest.approx(touching * cell)
        assert ds.contact_fraction[i] == pytest.approx(float(ds.contact_area[i]) / (size * cell))
        assert ds.contact_area_solver_upper[i] == ds.contact_area[i] < ds.contact_area_counted[i]
        assert ds.contact_area_solver_lower[i] == ds.contact_area[i] >= 0
        if kept.profile.window.whole:
            assert ds.mean_gap[i] == pytest.approx(np.nanmean(gap))
        else:  # what presses into the contact below the solver's tolerance is not cut there: this level is no solution
            opening = kept.profile.gap + displacement - level
            assert ds.mean_gap[i] == pytest.approx(opening.mean(), rel=1e-9)


def test_fields_beyond_a_window__are_in_single_precision_where_the_tolerance_leaves_room():
    for tolerance, low, high in ((1e-3, 1e-9, 1e-5), (1e-4, 1e-9, 1e-5), (0.9e-4, 0.0, 1e-12)):
        kept = Kept(rv.sphere(1.0, (0.9, 1.0), (97, 102)), tolerance=tolerance)
        displacement = kept.expected(*kept.add(0.02), 0.02)[0]
        off = np.abs(kept.dataset().displacement[0].values - displacement).max() / displacement.max()
        assert low <= off < high


@pytest.mark.parametrize("mirror", [False, True])
def test_row__of_a_grid_that_has_grown_is_counted_over_the_larger_one(mirror):
    kept = Kept(rv.sphere(1.0, (0.3, 0.4), (10, 12) if mirror else (11, 13)))  # of an odd number none is the mirror
    assert kept.profile.mirrored == mirror
    first, corner = kept.add(0.01), kept.profile.corner
    kept.scene = kept.profile.enlarge(kept.scene)[0]
    second = kept.add(0.02, time=1.0)
    nx, ny = second[0].shape
    assert (nx, ny) > first[0].shape
    axes = (kept.profile.domain[axis].values for axis in ("x", "y"))
    i, j = (int(np.argmin(np.abs(axis - at))) for axis, at in zip(axes, corner, strict=True))
    padded = np.zeros((2, nx, ny))
    padded[:, i : i + first[0].shape[0], j : j + first[0].shape[1]] = first
    ds = kept.dataset()
    size, images = kept.profile.height.size, 4 if mirror else 1
    for row, ((pressure, source), level) in enumerate(zip((padded, second), (0.01, 0.02), strict=True)):
        displacement, gap = kept.expected(pressure, source, level)
        assert np.array_equal(ds.pressure[row].values, surface(kept, pressure))
        assert ds.displacement[row].values == pytest.approx(surface(kept, displacement), rel=1e-9)
        assert ds.gap[row].values == pytest.approx(surface(kept, gap), rel=1e-9, abs=1e-9)
        count = images * np.count_nonzero(pressure)
        fraction = count / size * ds.contact_area[row] / ds.contact_area_counted[row]
        assert ds.contact_fraction[row] == pytest.approx(float(fraction))
        assert ds.contact_area_counted[row] == pytest.approx(count * float(np.prod(kept.profile.spacing)))
        opening = kept.profile.gap + displacement - level
        assert ds.mean_gap[row] == pytest.approx(opening.mean() if row == 0 else gap.mean(), rel=1e-9)


def test_row__of_a_punch_that_has_grown_has_the_mean_gap_of_what_is_there():
    kept = Kept(rv.flat_punch(0.2, (0.45, 0.5), (9, 10)))
    kept.add(0.0)
    kept.scene = kept.profile.enlarge(kept.scene)[0]
    kept.add(0.0, time=1.0)
    ds = kept.dataset()
    assert ds.mean_gap.values == pytest.approx(ds.gap.mean(("x", "y")).values)
    assert np.isnan(ds.gap.values).any()


def test_status__says_how_far_the_contact_goes():
    kept = Kept(HOLED, missing="absent", edge="accept")
    kept.add(0.01)
    kept.add(0.01, part=2.0)
    kept.add(0.01, part=0.0, force=0.0)
    kept.add(0.01, part=2.0, converged=False)
    found = [STATUS_MEANINGS[status] for status in kept.dataset().status.values]
    assert found == ["converged", "full_contact", "open", "not_converged"]
    followed = CASES["window"]()
    followed.add(0.01, part=2.0)
    assert STATUS_MEANINGS[followed.dataset().status.values[0]] == "converged", "not all of the surface"


def test_corrected_area__of_one_cell_is_less_by_its_four_faces():
    kept = Kept(BALL, edge="accept")
    pressure = np.zeros(BALL.shape)
    pressure[4, 7] = 1.0
    shown = Instant(0.0, Sparse.of(pressure), 1.0, 0.1)
    state = State(shown, pressure, None)
    step = Step(
        shown, Sum.whole(0 * pressure), None, 0.0, "load", True, 0.0, 0.0, Uncertainty(), True, kept.scene, state
    )
    kept.record(step)
    ds = kept.dataset()
    assert ds.contact_area[0] == pytest.approx(ds.contact_area_counted[0] * (1 - 4 * 0.088))


def test_rows__keep_nothing_of_larger_arrays():
    """What is a view of a larger array is copied, once; what is not is kept as it is."""
    rows = Kept(BALL, fields=("pressure", "displacement"), edge="accept", tolerance=Settings.tolerance)
    profile, store = rows.profile, rows.store
    scene = Scene(Operator(BALL.shape, profile.spacing), profile.gap, MATERIAL, Modes(MATERIAL), PROGRAM)
    pair = np.ones((2, *BALL.shape))
    shown = Instant(0.0, Sparse.of(pair[0]), 1.0, 0.1)
    own = np.ones(BALL.shape)
    step = Step(
        shown, Sum.whole(own), pair[1], 0.0, "load", True, 0.0, 0.0, Uncertainty(), True, scene,
        State(shown, own, None),
    )  # fmt: skip
    rows.record(step)
    kept = store.arrays(0)
    assert set(kept) == {"pressure", "displacement"}
    assert kept["pressure"].base is None
    assert kept["displacement"] is own
    rows.record(replace(step, scene=replace(scene, enlarge=profile.enlarge)))
    kept = store.arrays(1)
    assert kept["source_pressure"] is kept["pressure"]
    assert kept["source"].base is None


def test_times__that_differ_by_rounding_alone_are_one():
    """A step from one to the other has no length; each of the others is a row, at the time that was asked for."""
    ball = rv.sphere(0.01, (1e-4, 9e-5), (12, 9))
    program = rv.Program().load(1e-3, over=1.0)
    third = 1.0 / 3.0
    times = [third, np.nextafter(third, 1.0), third + 1e-9, 1.0 - 1e-13, 1.0]
    ds = rv.simulate(ball, rv.kelvin_voigt(1e6, 1e5), program, times=times, edge="accept", progress=False)
    np.testing.assert_array_equal(ds.time, [third, third + 1e-9, 1.0])
