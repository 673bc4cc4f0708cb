"""What a plan says before anything runs, against what the run then takes."""

import io
import math
import pathlib
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console
from support import BALL

import roughvisc as rv
from roughvisc.api import simulate
from roughvisc.errors import InputError
from roughvisc.experiment.resources import Available
from roughvisc.mechanics.bodies.half_space import HALF_SPACE
from roughvisc.mechanics.hereditary.choice import choose_memory
from roughvisc.study.cost import estimate
from roughvisc.study.cost import plan as plan_module
from roughvisc.study.cost import plan as totals_module
from roughvisc.study.cost.estimate import CostEstimate, Passed, Solved, Stage, coarse, wall_time
from roughvisc.study.statement.case import read_cases, vary
from roughvisc.variables import STEPPED
from roughvisc.views.console import tables
from roughvisc.views.console.tables import plan_tables

ROUGH = """
title = "Rough"
[surface]
generate = "self_affine"
size = "1 mm"
shape = [90, 108]
hurst = 0.8
rms_slope = 0.1
rolloff = "0.5 mm"
shortcut = "50 um"
seed = 1
[material]
model = "zener"
shear_modulus = "1 MPa"
kelvin_modulus = "0.5 MPa"
kelvin_viscosity = "0.1 MPa s"
[[program]]
load = "0.02 N"
over = "10 ms"
[[program]]
hold = "0.5 s"
[solve]
boundary = "periodic"
tolerance = 2e-3
[keep]
fields = ["pressure"]
times = "all"
"""


def whole(cells, part=1.0):
    """A surface in one row, of which a part is solved on throughout."""
    return Solved((Stage((cells, 1), part * cells),), (1.0,))


EVEN = [0.06375 * n for n in range(9)]


@pytest.fixture
def study(tmp_path):
    def write(text):
        path = tmp_path / "study.toml"
        path.write_text(text)
        return read_cases(path)

    return write


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"solve.boundary": "free", "solve.edge": "accept"},
        pytest.param(
            {"material": {"model": "kelvin_voigt", "shear_modulus": 1e6, "viscosity": 2e4}, "keep.times": EVEN},
            marks=pytest.mark.thorough,
        ),
        {"solve.time_step": 0.01},
    ],
)
def test_plan__expects_about_the_steps_and_convolutions_that_are_taken(study, changes):
    case = vary(study(ROUGH)[0], changes)
    planned = rv.plan([case])
    ds = rv.run(case, progress=False)
    if case.settings.keep.times == "all":
        assert float(planned.steps[0]) == pytest.approx(ds.sizes["time"], rel=0.2)
    assert 0.6 < float(planned.convolutions[0]) / int(ds.convolutions.sum()) < 1.8
    size = pathlib.Path(ds.encoding["source"]).stat().st_size
    assert 0.4 < size / float(planned.disk[0]) < 2
    assert planned.wall_time[0] > 0


def test_plan__counts_the_same_however_busy_the_machine_is(study, monkeypatch):
    case = study(ROUGH)[0]
    first = rv.plan([case])
    clock = iter(range(10**9))
    monkeypatch.setattr("time.perf_counter", lambda: 100.0 * next(clock))  # every look at the clock costs 100 s
    second = rv.plan([case])
    for name in ("steps", "convolutions", "rows"):
        assert first[name].equals(second[name]), name


def test_plan__foresees_a_long_march_from_a_part_of_it(study, monkeypatch):
    case = study(ROUGH)[0]
    whole = rv.plan([case])
    monkeypatch.setattr("roughvisc.study.cost.estimate._MOST_CONVOLUTIONS", int(0.5 * float(whole.convolutions[0])))
    part = rv.plan([case])
    ratio = float(part.convolutions[0]) / float(whole.convolutions[0])
    assert ratio != 1
    assert 1 / 3 < ratio < 3, "the steps of a hold grow, which its beginning does not tell"


def test_plan__names_what_is_modelled(study):
    base = study(ROUGH)[0]
    cases = [
        base,
        vary(base, {"material": {"model": "elastic", "shear_modulus": 1e6}}),
        vary(base, {"material": {"model": "power_law", "glassy": 2e-7, "coefficient": 1e-6, "exponent": 0.3}}),
        vary(base, {"solve.boundary": "free", "solve.edge": "accept", "keep.fields": ["gap"]}),
        vary(base, {"solve.method": "seed", "solve.time_step": 0.1}),
    ]
    planned = rv.plan(cases)
    assert list(planned.boundary.values) == ["periodic", "periodic", "periodic", "free", "periodic"]
    assert list(planned.padded.values) == [False, False, False, True, False]
    assert list(planned.memory_model.values[:2]) == ["1 exponential", "no memory: elastic"]
    assert "in place of the compliance" in str(planned.memory_model[2].item())
    assert list(planned.exponentials.values[:2]) == [1, 0]
    assert int(planned.exponentials[2]) > 3
    assert list(planned.cells_x.values) == [90] * 5
    assert str(planned.scheme[4].item()).startswith("the seed paper's")
    assert (planned.refusal == "").all()
    assert planned.attrs["refusal"] == ""


def test_plan__rows_follow_the_kept_times(study):
    (case,) = study(ROUGH)
    few = vary(case, {"keep.times": 7})
    planned = rv.plan([case, few])
    assert float(planned.rows[0]) == float(planned.steps[0])
    assert float(planned.rows[1]) == 7
    assert float(planned.disk[0]) > 2 * float(planned.disk[1])


def test_plan__takes_the_figures_of_the_case_most_like_where_time_is_short(study, monkeypatch):
    monkeypatch.setattr(plan_module, "_BUDGET", 0.0)
    cases = study(ROUGH + '[sweep]\n"program.0.load" = ["10 mN", "20 mN"]\n"surface.seed" = [1, 2, 3]\n')
    planned = rv.plan(cases)
    assert int(planned.marched.sum()) == 1
    assert np.isfinite(planned.wall_time).all()
    assert list(planned["surface.seed"]) == [1, 2, 3] * 2


def test_plan__refuses_with_a_reason(study, monkeypatch):
    (case,) = study(BALL)
    beyond = vary(case, {"solve.boundary": "periodic", "program": [{"approach": "1 mm", "over": 1}]})
    planned = rv.plan([case, vary(beyond, {})])
    assert "with periodic boundaries contact is full" in str(planned.refusal[1].item())
    assert planned.attrs["refusal"].startswith("1 of 2 cases: ")
    assert np.isnan(planned.wall_time[1])

    import psutil

    class Little:
        available = 3e8

    monkeypatch.setattr(psutil, "virtual_memory", lambda: Little)
    refusal = rv.plan([case, vary(case, {"program.0.load": 4e-3})], workers=2).attrs["refusal"]
    assert "2 processes need" in refusal
    assert refusal.endswith("use --workers 1")
    Little.available = 1e6
    assert rv.plan([case]).attrs["refusal"].endswith("expected more memory, or a coarser grid")

    class Full:
        free = 10

    monkeypatch.setattr(totals_module.shutil, "disk_usage", lambda path: Full)
    assert "bytes of disk" in rv.plan([case]).attrs["refusal"]
    with pytest.raises(InputError, match="cases is empty"):
        rv.plan([])


def test_plan__says_what_runs_side_by_side_and_what_half_the_resolution_costs(study, monkeypatch):
    case = study(ROUGH)[0]
    several = [vary(case, {"program.0.load": load}) for load in (0.01, 0.015, 0.02)]
    monkeypatch.setattr(totals_module, "cores", lambda: 4)
    monkeypatch.setattr("roughvisc.study.execution.cluster.cores", lambda: 4)
    monkeypatch.setattr(plan_module, "memory_available", lambda: Available(1e12, "free in this machine"))
    with monkeypatch.context() as without:  # what is the same on any grid
        without.setattr(estimate.ConvolutionTimer, "beside", lambda *_: 0.0)
        without.setattr(estimate, "_FILE", 0.0)
        planned = rv.plan(several)
    assert (planned.attrs["processes"], planned.attrs["threads"]) == (3, 1)
    # on a quarter of the cells: a quarter of all that is not the process
    assert float(planned.half_memory[0]) - 210e6 == pytest.approx((float(planned.memory[0]) - 210e6) / 4, rel=0.01)
    assert 0.15 < float(planned.half_wall_time[0] / planned.wall_time[0]) < 0.25
    # a wave of eight cells is kept whole, and differences of it over two cells are sin(pi / 4) / 2 sin(pi / 8)
    wave = rv.wavy(1e-6, 1e-4, 1e-3, (80, 80), waves=1).drop_attrs()
    kept = math.sin(math.pi / 4) / (2 * math.sin(math.pi / 8))
    assert plan_module._half_slope(wave, "free") / plan_module.rms_slope(wave) == pytest.approx(kept, rel=0.02)
    monkeypatch.setattr(plan_module, "memory_available", lambda: Available(500e6, "free in this machine"))
    planned = rv.plan(several)
    assert (planned.attrs["processes"], planned.attrs["threads"]) == (2, 2)
    monkeypatch.setattr(tables, "_LARGE", 0.0)
    monkeypatch.setattr(tables, "_THREADED", 1)
    console = Console(width=200, record=True, file=io.StringIO())
    console.print(plan_tables(planned))
    said = console.export_text()
    assert "3, 2 in parallel, 2 threads each" in said
    assert "At half the resolution" in said
    assert "the rms slope falls by" in said


def test_plan__missing_points_are_refused(study, tmp_path):
    height = rv.self_affine((40e-6, 30e-6), (40, 30), hurst=0.8, rms_height=1e-7, seed=2)
    height.values[3, 4] = np.nan
    height.rename("height").to_netcdf(tmp_path / "scan.nc")
    surface = ROUGH[ROUGH.index("generate") : ROUGH.index("[material]")]
    planned = rv.plan(study(ROUGH.replace(surface, 'file = "scan.nc"\n')))
    assert "missing at 1 of 1200 points" in str(planned.refusal[0].item())


def test_spread__covers_the_ends_first_and_everything_once():
    for count in (1, 2, 3, 10, 57):
        order = plan_module._spread(count)
        assert sorted(order) == list(range(count))
        assert order[:2] == ([0, count - 1] if count > 1 else [0])


def test_coarse__is_the_same_surface_with_fewer_points():
    ball = rv.sphere(1e-3, 2e-4, (90, 101))
    small = coarse(ball, 17)
    assert small.shape == (17, 17)
    assert float(small.x[-1] + small.x[0]) == pytest.approx(2e-4)
    press = rv.Program().load(1e-4, over=0)
    assert simulate(small, rv.elastic(1e6), press, boundary="free", progress=False).sizes["x"] == 17
    assert coarse(ball, 500).shape == (90, 101)


def test_plan__counts_the_coarser_solve_of_a_grid_error(study):
    plain = study(ROUGH)[0]
    asked = vary(plain, {"solve.grid_error": True})
    engine = choose_memory(plain.material(), 0.51, 2e-3)
    found = CostEstimate(20, 10, 400, 0.0, 0.1, True)
    seconds = [wall_time(case.solving(), whole(90 * 108), found, engine, 1e-3) for case in (plain, asked)]
    assert seconds[0] + 0.25 * 0.4 <= seconds[1] <= 2 * seconds[0], "a quarter of the cells, at least"


def test_plan__counts_the_window_that_follows_a_small_contact(study):
    text = ROUGH[: ROUGH.index("[surface]")] + (
        '[surface]\ngenerate = "sphere"\nradius = "10 mm"\nsize = "2 mm"\nshape = [201, 187]\n'
    )
    text += ROUGH[ROUGH.index("[material]") :].replace('boundary = "periodic"\n', "").replace('"0.02 N"', '"1 mN"')
    (case,) = study(text)
    whole = vary(case, {"solve.edge": "accept"})
    planned = rv.plan([case, whole])
    assert float(planned.wall_time[0]) < 0.5 * float(planned.wall_time[1])


def said_of(planned):
    console = Console(width=100, record=True, file=io.StringIO())
    console.print(plan_tables(planned))
    return " ".join(console.export_text().split())


def test_plan__says_how_much_comes_into_contact(study):
    """On the surface's own cells: what it says is what the run has."""
    cases = [study(ROUGH)[0], vary(study(ROUGH)[0], {"program.0.load": "5 N"})]
    planned = rv.plan(cases)
    taken = [float(rv.run(case, progress=False).contact_fraction.max()) for case in cases]
    assert taken[0] < 0.3 < 0.99 < taken[1]
    assert planned.contact_fraction.values == pytest.approx(taken, rel=0.02)
    low, high = (f"{float(f'{100 * one:.2g}'):g}" for one in planned.contact_fraction.values)
    said = said_of(planned)
    assert f"Contact about {low} to {high} % of the area, estimated on a grid of 90 x 108 cells" in said
    assert "at most" not in said
    free = rv.plan([vary(study(ROUGH)[0], {"solve.boundary": "free", "solve.edge": "accept"})])
    assert f"about {100 * float(free.contact_fraction[0]):.2g} % of the area" in said_of(free)


@pytest.mark.parametrize(
    "program",
    [
        [{"load": 0.02, "over": 0.01}, {"hold": 0.5}, {"load": 0.004, "over": 0.1}, {"hold": 1.0}],
        [{"approach": 3e-6, "over": 0.1}, {"hold": 0.2}],
        [{"load": 0.02, "over": 0}, {"hold": 0.05}],
    ],
    ids=["unloaded", "approach", "jump"],
)
def test_contact__of_a_program_is_that_of_the_run(study, program):
    """The largest contact is not that at the end, nor that of the relaxed material."""
    case = vary(study(ROUGH)[0], {"program": program})
    planned, taken = rv.plan([case]), rv.run(case, progress=False).contact_fraction
    assert float(planned.contact_fraction[0]) == pytest.approx(float(taken.max()), rel=0.03)


def test_contact__on_fewer_cells_than_the_run_is_said_with_how_it_falls(study, monkeypatch):
    """Hurst exponent 0.5 and waves of two cells: the fewer the cells, the more contact."""
    text = ROUGH.replace("hurst = 0.8", "hurst = 0.5").replace("50 um", "20 um").replace("[90, 108]", "[144, 130]")
    (case,) = study(text)
    own = rv.plan([case])
    assert list(own.coarser_cells_x.values) == [0]
    assert np.isnan(own.coarser_contact_fraction[0])
    monkeypatch.setattr(estimate, "MOST_PRESSED", 72)
    planned = rv.plan([case])
    assert [int(planned[f"{name}_cells_{axis}"][0]) for name in ("pressed", "coarser") for axis in "xy"] == [
        72,
        65,
        36,
        32,
    ]
    fractions = [float(one[0]) for one in (own.contact_fraction, planned.contact_fraction)]
    assert fractions[0] < fractions[1] < float(planned.coarser_contact_fraction[0])
    numbers = [100 * float(planned[f"{name}contact_fraction"][0]) for name in ("", "coarser_")]
    first, second = (f"{float(f'{one:.2g}'):g} %" for one in numbers)
    expected = (
        f"about {first} of the area, estimated on a grid of 72 x 65 cells; {second} on a grid of 36 x 32: expect less"
    )
    assert expected in said_of(planned)


def test_contact__of_a_case_that_was_not_marched_is_not_known(study, monkeypatch):
    monkeypatch.setattr(plan_module, "_BUDGET", 0.0)
    planned = rv.plan(study(ROUGH + '[sweep]\n"program.0.load" = ["10 mN", "20 mN"]\n'))
    assert list(planned.marched.values) == [True, False]
    assert list(np.isfinite(planned.contact_fraction.values)) == [True, False]


def test_plan__means_by_contact_fraction_what_a_result_means(study):
    """The surface is as coarse as the plan's own grid, so that the plan presses what the run does."""
    case = study(ROUGH.replace("[90, 108]", "[33, 31]").replace("50 um", "100 um"))[0]
    touching = rv.run(case, progress=False).pressure.values > 0
    faces = sum((touching & ~np.roll(touching, turn, axis)).sum((1, 2)) for axis in (1, 2) for turn in (1, -1))
    share = (touching.sum((1, 2)) - 0.088 * faces) / (33 * 31)
    found = float(rv.plan([case]).contact_fraction[0])
    assert found == pytest.approx(share.max(), rel=1e-3)
    assert found < 0.95 * touching.mean((1, 2)).max(), "it is not the count"


def test_disk__of_a_contact_that_is_small_at_most_kept_times(study, tmp_path):
    """The pressure is written compressed; the largest contact, at the last of nine times, says little of the file."""
    changes = {
        'model = "zener"\nshear_modulus = "3 MPa"\nkelvin_modulus = "1 MPa"\nkelvin_': (
            'model = "kelvin_voigt"\nshear_modulus = "1 MPa"\n'
        ),
        'hold = "0.2 s"': 'hold = "10 s"',
        "shape = [24, 21]": "shape = [60, 51]",
        'fields = ["pressure", "displacement"]': 'fields = ["pressure"]',
        "[keep]": "tolerance = 1e-2\n[keep]",
        '[0, "0.1 s", "200 ms"]': "[1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 10]",
    }
    text = BALL
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    cases = study(text)
    path = rv.run(cases[0], tmp_path / "out", progress=False).encoding["source"]
    assert float(rv.plan(cases).disk[0]) == pytest.approx(pathlib.Path(path).stat().st_size, rel=0.3)


# ----------------------------------------------------------------------------------------------------------------
# what is counted, by hand

ZENER, KELVIN_VOIGT = rv.zener(1e6, 1e6, 1e5), rv.kelvin_voigt(1e6, 1e5)
FLOWING = rv.Prony(1e-6, 1e-6, (1e-6,), (0.1,))


def remembered(material):
    return choose_memory(material, 0.51, 2e-3)


def test_bytes__are_fields_of_the_cells_and_what_the_process_takes(study):
    settings, found, cells = study(ROUGH)[0].solving(), CostEstimate(20, 0, 400, 0.0, 0.1, True), 10_000

    def fields_of(material, part=1.0, rows=0):
        needed = estimate.bytes_needed(settings, cells, replace(found, rows=rows), remembered(material), part)
        return (needed - 210e6) / (8 * cells)

    elastic, zener, flowing, soft = (fields_of(m) for m in (rv.elastic(1e6), ZENER, FLOWING, KELVIN_VOIGT))
    assert flowing - zener == pytest.approx(5.2), "flow counts as one more exponential: in two states and the companion"
    assert soft - zener == pytest.approx(3 + 5.2), "the two-step rule keeps a state more, and steps show their ends"
    assert zener > elastic + 3
    # all but the surface scales with the part of the cells that is solved on
    surface = fields_of(ZENER, 0.0)
    assert surface == pytest.approx(2.1)
    assert fields_of(ZENER, 0.5) - surface == pytest.approx(0.5 * (zener - surface))


def test_disk__takes_the_fields_and_fifteen_histories_of_each_row(study):
    case = vary(study(ROUGH)[0], {"keep.fields": ["pressure", "gap"], "keep.precision": None})
    empty, ten = (estimate.disk(case, 1000, CostEstimate(20, rows, 400, 0.0, 0.6, True)) for rows in (0, 10))
    assert empty == 40e3 + 8 * 1000 + 8 * 20 * len(STEPPED), "and the histories of twenty steps"
    assert ten - empty == 10 * (2 * 8 * 1000 + 15 * 8)
    rare = estimate.disk(case, 1000, CostEstimate(20, 10, 400, 0.0, 0.01, True))
    assert rare - empty == pytest.approx(10 * (1.02 * 8 * 1000 + 15 * 8)), "a sparse pressure is compressed"


def test_wall_time__is_that_of_the_convolutions_of_the_fields_passed_through_and_of_writing(study):
    settings = study(ROUGH)[0].solving()
    march, cells = CostEstimate(1000, 0, 400, 0.0, 0.1, True), 2**20 - 2

    def seconds(*given):
        return wall_time(settings, *given) - estimate._FILE

    passed = [seconds(whole(cells), march, remembered(m), 0.0) for m in (rv.elastic(1e6), ZENER)]
    byte = 0.3e-9
    assert passed == pytest.approx([1000 * 8 * cells * n * byte for n in (10, 14)])
    elastic = remembered(rv.elastic(1e6))
    assert seconds(whole(cells, 0.25), march, elastic, 0.0) == pytest.approx(passed[0] / 4)
    rows = seconds(whole(cells), replace(march, rows=50), elastic, 0.0) - passed[0]
    assert rows == pytest.approx(50 * 8 * cells * 3e-9)
    assert seconds(whole(cells), march, elastic, 0.0, 1e-3) - passed[0] == pytest.approx(1000 * 1e-3)
    part = (2**18 - 2) / cells  # as N log N
    one = seconds(whole(cells, part), replace(march, steps=0), elastic, 0.01)
    assert one == pytest.approx(400 * 0.01 * part * 18 / 20, rel=1e-4)


def test_solve_that_is_timed__is_small_and_stands_for_larger_ones(monkeypatch):
    """A convolution takes N log N microseconds by a clock that the test moves; the first on each grid takes longer."""
    clock, timed = [0.0], []

    def solve(operator, gap, *, load, start, **_):
        assert np.mean(start > 0) == pytest.approx(0.1, abs=0.02), "a light contact"
        pressure = start * load / start.sum()  # in the mean it displaces as far as the surfaces penetrate
        assert (pressure * operator.displacement(pressure)).sum() == pytest.approx((pressure * start).sum())
        clock[0] += 50 * 1e-6 * estimate.work(gap.size) * (1 if gap.size in timed else 3)
        timed.append(gap.size)
        return SimpleNamespace(convolutions=50)

    def expected(shape):
        return pytest.approx(1e-6 * estimate.work(shape[0] * shape[1]))

    monkeypatch.setattr(estimate, "solve_contact", solve)
    monkeypatch.setattr(estimate, "time", SimpleNamespace(perf_counter=lambda: clock[0]))
    monkeypatch.setattr(estimate, "_TIMED", 15**2)
    monkeypatch.setattr(estimate, "_CALIBRATION", 100.0)
    monkeypatch.setattr(estimate, "_NARROW", 0)
    watch = estimate.ConvolutionTimer()

    def seconds(shape):
        return watch.seconds(rv.sphere(1e-3, 2e-4, shape), "free", HALF_SPACE)

    for shape in [(9, 12), (60, 41), (15, 14)]:
        assert seconds(shape) == expected(shape)
    assert set(timed) == {9 * 12, 15 * 15, 15 * 14}
    # no time is left: by the grid that is nearest in size, and no other
    watch._left = 0.0
    timed.clear()
    for grid in watch._found:
        watch._found[grid] *= 1 if grid[0] == (60, 41) else 7
    assert seconds((31, 33)) == expected((31, 33))
    assert not timed
    # what a coarse run took beside its convolutions, each step; never less than nothing
    height = rv.sphere(1e-3, 2e-4, (15, 14))
    each = seconds((15, 14))
    for beside, expected_beside in [(0.3, 0.1), (-0.3, 0.0)]:
        run = estimate.CoarseRun(height, 3, 40, 40 * each + beside)
        assert watch.beside(run, "free", HALF_SPACE) == pytest.approx(expected_beside)


@pytest.mark.parametrize(("time_step", "steps"), [("auto", 12 * 1.2), (0.01, 12)])
def test_cost__grows_from_grid_to_grid_as_between_the_coarse_ones(study, monkeypatch, time_step, steps):
    """An octave beyond the second one; steps of a given length are as many on any grid."""
    found = [CostEstimate(10, 5, 100, 0.0, 0.1, True), CostEstimate(12, 6, 150, 0.0, 0.1, True)]
    monkeypatch.setattr(estimate, "_march", lambda case, program, height, _: found[height.sizes["x"] > 20])
    case = vary(study(ROUGH)[0], {"solve.time_step": time_step})
    grown = estimate.march_of(case, rv.sphere(1e-3, 2e-4, 66))
    assert (grown.steps, grown.rows, grown.convolutions) == pytest.approx((steps, steps, 150 * 1.5))


def test_march_that_is_broken_off__goes_on_as_the_one_on_fewer_cells():
    """That had done 2 of its 4 steps and 30 of its 60 convolutions when the finer one ended."""
    nowhere = (0.0, (0.0, 0.0))
    coarser = CostEstimate(4, 1, 60, 0.0, 0.1, True, course=tuple(Passed(*nowhere, 15.0, t) for t in (0, 1, 4, 16)))
    found = CostEstimate(99, 1, 999, 0.0, 0.1, False, course=tuple(Passed(*nowhere, 10.0, t) for t in (0, 0.5, 1)))
    carried = estimate._carried_on(found, coarser)
    assert (carried.steps, carried.convolutions) == (6, 60)


def test_march_of_equal_steps__is_foreseen_from_a_part_of_it(study, monkeypatch):
    case = vary(study(ROUGH)[0], {"solve.time_step": 0.01})
    height = coarse(case.height(), 12)
    whole = estimate._march(case, case.program(), height)
    monkeypatch.setattr(estimate, "_MOST_STEPS", 20)
    part = estimate._march(case, case.program(), height)
    assert (whole.whole, part.whole) == (True, False)
    assert whole.steps == 52
    assert part.steps == part.rows == pytest.approx(52)


def test_part_of_the_steps_by_the_two_step_rule(study):
    material = {"model": "kelvin_voigt", "shear_modulus": 1e6, "viscosity": 1e6}  # retarded in 1 s
    case = vary(study(ROUGH)[0], {"solve.time_step": 0.01, "material": material})
    assert estimate._march(case, case.program(), coarse(case.height(), 12)).damped == pytest.approx(51 / 52)
