"""What a plan says before anything runs, against what the run then takes."""

import io
import math
import pathlib

import numpy as np
import pytest
from rich.console import Console
from support import BALL

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.mechanics.hereditary.choice import choose_memory
from roughvisc.study.cost import plan as plan_module
from roughvisc.study.cost.estimate import March, coarse, wall_time
from roughvisc.study.simulation.simulate import simulate
from roughvisc.study.statement.case import read_cases, vary
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
        {"material": {"model": "kelvin_voigt", "shear_modulus": 1e6, "viscosity": 2e4}, "keep.times": EVEN},
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


def test_plan__names_what_is_modelled_and_what_is_left_out(study):
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
    assert "gap and displacement: not kept" in str(planned.left_out[0].item())
    assert "padding" in str(planned.left_out[0].item())
    assert "past pressures: remembered by 1 exponential, at no cost" in str(planned.left_out[0].item())
    assert "past pressures: not needed, the material is elastic" in str(planned.left_out[1].item())
    assert "pressure and displacement: not kept" in str(planned.left_out[3].item())
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
    assert rv.plan([case]).attrs["refusal"].endswith("use a coarser grid, or keep fewer times or fields")

    class Full:
        free = 10

    monkeypatch.setattr(plan_module.shutil, "disk_usage", lambda path: Full)
    assert "bytes of disk" in rv.plan([case]).attrs["refusal"]
    with pytest.raises(InputError, match="cases is empty"):
        rv.plan([])


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
    assert simulate(small, rv.elastic(1e6), rv.Program().load(1e-4, over=0), progress=False).sizes["x"] == 17
    assert coarse(ball, 500).shape == (90, 101)


def test_plan__counts_the_coarser_solve_of_a_grid_error(study):
    plain = study(ROUGH)[0]
    asked = vary(plain, {"solve.grid_error": True})
    engine = choose_memory(plain.material(), 0.51, 2e-3)
    found = March(20, 10, 400, 0.0, 0.1, True)
    seconds = [wall_time(case.solving(), 90 * 108, found, engine, 1e-3) for case in (plain, asked)]
    assert seconds[0] + 0.25 * 0.4 <= seconds[1] <= 2 * seconds[0], "a quarter of the cells, at least"


def test_plan__counts_the_window_that_follows_a_small_contact(study):
    text = ROUGH[: ROUGH.index("[surface]")] + (
        '[surface]\ngenerate = "sphere"\nradius = "10 mm"\nsize = "2 mm"\nshape = [201, 187]\n'
    )
    text += ROUGH[ROUGH.index("[material]") :].replace('boundary = "periodic"\n', "").replace('"0.02 N"', '"1 mN"')
    (case,) = study(text)
    whole = vary(case, {"solve.edge": "accept"})
    planned = rv.plan([case, whole])
    assert "too deep to be touched" in str(planned.left_out.values[0])
    assert "too deep" not in str(planned.left_out.values[1])
    assert float(planned.wall_time[0]) < 0.5 * float(planned.wall_time[1])
    ds = rv.run(case, progress=False)
    assert ds.attrs["left_out"] == planned.left_out.values[0]


def test_plan__says_how_much_comes_into_contact(study):
    pressed_flat = vary(study(ROUGH)[0], {"program.0.load": "5 N"})
    planned = rv.plan([study(ROUGH)[0], pressed_flat])
    light, heavy = planned.contact_fraction.values
    assert 0 < light < heavy == 1
    console = Console(width=100, record=True, file=io.StringIO())
    console.print(plan_tables(planned))
    ratio = planned.nominal_pressure.values / planned.full_contact_pressure.values
    low, high = (f"{float(f'{100 * math.erf(math.sqrt(2) * one):.2g}'):g}" for one in ratio)
    assert f"about {low} to {high} % of the area (Persson's theory" in console.export_text()
    free = rv.plan([vary(study(ROUGH)[0], {"solve.boundary": "free", "solve.edge": "accept"})])
    console.print(plan_tables(free))
    assert f"about {100 * float(free.contact_fraction[0]):.2g} % of the grid" in console.export_text()


def test_disk__of_a_contact_that_is_small_at_most_kept_times(study, tmp_path):
    """The pressure is written compressed; the largest contact, at the last of nine times, says little of the file."""
    changes = {
        'model = "zener"\nshear_modulus = "3 MPa"\nkelvin_modulus = "1 MPa"\nkelvin_': (
            'model = "kelvin_voigt"\nshear_modulus = "1 MPa"\n'
        ),
        'hold = "0.2 s"': 'hold = "10 s"',
        "shape = [24, 21]": "shape = [60, 51]",
        'fields = ["pressure", "displacement"]': 'fields = ["pressure"]',
        "[keep]": "[solve]\ntolerance = 1e-2\n[keep]",
        '[0, "0.1 s", "200 ms"]': "[1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 10]",
    }
    text = BALL
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    cases = study(text)
    path = rv.run(cases[0], tmp_path / "out", progress=False).encoding["source"]
    assert float(rv.plan(cases).disk[0]) == pytest.approx(pathlib.Path(path).stat().st_size, rel=0.3)
