"""The cost that a plan expects, compared with the cost of the run."""

import pathlib

import numpy as np
import psutil
import pytest
from support import BALL, refused

import roughvisc as rv
from roughvisc.errors import EdgeContactError
from roughvisc.study.cost import plan as plan_module
from roughvisc.study.statement.case import read_cases, vary

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
GROWING = """
[surface]
generate = "sphere"
radius = "10 mm"
size = "0.3 mm"
shape = [25, 24]
[material]
model = "zener"
shear_modulus = "3 MPa"
kelvin_modulus = "1 MPa"
kelvin_viscosity = "0.1 MPa s"
[[program]]
load = "0.4 N"
over = 0
[[program]]
hold = "0.95 s"
[solve]
tolerance = 1e-2
[keep]
times = 4
fields = ["pressure"]
"""
CURVE = ROUGH[: ROUGH.index("[[program]]")] + '[friction]\npressure = "20 kPa"\nspeeds = ["5 mm/s", "0.2 m/s"]\n'


@pytest.fixture
def study(tmp_path):
    def write(text):
        path = tmp_path / "study.toml"
        path.write_text(text)
        return read_cases(path)

    return write


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("text", "changes"),
    [
        (ROUGH, {}),
        (ROUGH, {"solve.boundary": "free", "solve.edge": "accept"}),
        (ROUGH, {"program": [{"approach": 3e-6, "over": 0.1}, {"hold": 0.2}]}),
        (ROUGH, {"program": [{"load": 0.02, "over": 0.01}, {"hold": 0.5}, {"load": 0.004, "over": 0.1}]}),
        (GROWING, {}),
        (CURVE, {}),
    ],
    ids=["load", "free", "approach", "unloaded", "growing", "friction"],
)
def test_plan__is_within_a_factor_of_two_of_the_run(study, text, changes):
    case = vary(study(text)[0], changes)
    planned, ds = rv.plan([case]).isel(case=0), rv.run(case, progress=False)
    assert 0.5 < float(planned.convolutions) / int(ds.convolutions.sum()) < 2
    assert 0.5 < float(planned.rows) / ds.force.size < 2
    assert 0.4 < pathlib.Path(ds.encoding["source"]).stat().st_size / float(planned.disk) < 2.5
    assert float(planned.contact_fraction) == pytest.approx(float(ds.contact_fraction.max()), rel=0.1)
    if text == GROWING:
        assert (int(planned.final_cells_x), int(planned.final_cells_y)) == ds.height.shape
        assert ds.height.shape[0] > 40


def test_plan__counts_the_same_on_a_busy_machine(study, monkeypatch):
    case = study(ROUGH)[0]
    first = rv.plan([case])
    clock = iter(range(10**9))
    monkeypatch.setattr("time.perf_counter", lambda: 100.0 * next(clock))  # every look at the clock costs 100 s
    second = rv.plan([case])
    for name in ("steps", "convolutions", "rows"):
        assert first[name].equals(second[name]), name


@pytest.mark.thorough
def test_small_contact__costs_less_in_a_window(study):
    surface = '[surface]\ngenerate = "sphere"\nradius = "10 mm"\nsize = "2 mm"\nshape = [201, 187]\n'
    text = ROUGH[: ROUGH.index("[surface]")] + surface + ROUGH[ROUGH.index("[material]") :]
    (case,) = study(text.replace('boundary = "periodic"\n', "").replace('"0.02 N"', '"1 mN"'))
    planned = rv.plan([case, vary(case, {"solve.edge": "accept"})])
    assert float(planned.wall_time[0]) < 0.5 * float(planned.wall_time[1])


@pytest.mark.thorough
def test_plan__names_what_is_modelled(study):
    base = study(ROUGH)[0]
    cases = [
        base,
        vary(base, {"material": {"model": "elastic", "shear_modulus": 1e6}}),
        vary(base, {"material": {"model": "power_law", "glassy": 2e-7, "coefficient": 1e-6, "exponent": 0.3}}),
        vary(base, {"solve.boundary": "free", "solve.edge": "accept", "keep.fields": ["gap"]}),
    ]
    planned = rv.plan(cases)
    assert list(planned.boundary.values) == ["periodic", "periodic", "periodic", "free"]
    assert list(planned.padded.values) == [False, False, False, True]
    assert list(planned.exponentials.values[:2]) == [1, 0]
    assert int(planned.exponentials[2]) > 3
    assert planned.attrs["refusal"] == ""


def test_copied_numbers__are_marked(study, monkeypatch, tmp_path, invoke):
    monkeypatch.setattr(plan_module, "_BUDGET", 0.0)
    cases = study(ROUGH + '[sweep]\n"program.0.load" = ["10 mN", "20 mN"]\n')
    planned = rv.plan(cases)
    assert list(planned.marched.values) == [True, False]
    assert float(planned.steps[0]) == float(planned.steps[1])
    assert list(np.isfinite(planned.contact_fraction.values)) == [True, False]
    steps = f"{float(planned.steps[0]):.0f}"
    status, out, _ = invoke("plan", tmp_path / "study.toml")
    assert status == 0
    rows = [line.split() for line in out.splitlines() if line.split()[:1] in (["10"], ["20"])]
    assert [row[1] for row in rows] == [steps, f"~{steps}"]
    assert planned._repr_html_().count(f">~{steps}<") == 1


def test_contact_at_the_border__is_foreseen_where_it_ends_the_run(study):
    surface = (
        '[surface]\ngenerate = "self_affine"\nsize = "1 mm"\nshape = [40, 36]\nhurst = 0.8\nrms_slope = 0.1\nseed = 1\n'
    )
    (rough,) = study(BALL[: BALL.index("[surface]")] + surface + BALL[BALL.index("[material]") :])
    costs = rv.plan([rough, vary(rough, {"solve.edge": "accept"})])
    assert list(costs.border_warning.values != "") == [True, False]
    with pytest.raises(EdgeContactError):
        rv.run(rough, progress=False)


@pytest.mark.thorough
def test_plan__refuses_with_a_reason(study, monkeypatch):
    (case,) = study(BALL)
    beyond = vary(case, {"solve.boundary": "periodic", "program": [{"approach": "1 mm", "over": 1}]})
    planned = rv.plan([case, beyond])
    assert list(planned.refusal.values != "") == [False, True]
    assert np.isnan(planned.wall_time[1])
    with refused():
        rv.plan([])

    class Little:
        available = 3e8

    monkeypatch.setattr(psutil, "virtual_memory", lambda: Little)
    assert "--workers 1" in rv.plan([case, vary(case, {"program.0.load": 4e-3})], workers=2).attrs["refusal"]
    Little.available = 1e6
    assert "memory" in rv.plan([case]).attrs["refusal"]

    class Full:
        free = 10

    monkeypatch.setattr(plan_module.shutil, "disk_usage", lambda path: Full)
    assert "disk" in rv.plan([case]).attrs["refusal"]


def test_missing_points__are_refused(study, tmp_path):
    height = rv.self_affine((40e-6, 30e-6), (40, 30), hurst=0.8, rms_height=1e-7, seed=2)
    height.values[3, 4] = np.nan
    height.rename("height").to_netcdf(tmp_path / "scan.nc")
    surface = ROUGH[ROUGH.index("generate") : ROUGH.index("[material]")]
    planned = rv.plan(study(ROUGH.replace(surface, 'file = "scan.nc"\n')))
    assert "missing" in str(planned.refusal[0].item())
