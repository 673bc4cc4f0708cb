"""The cost that a plan expects, compared with the cost of the run."""

import pathlib
import re
import time
import tracemalloc

import numpy as np
import psutil
import pytest
from support import STUDY, at_rows, case_of, refused

import roughvisc as rv
from roughvisc.errors import EdgeContactError
from roughvisc.experiment.memory_limit import PROCESS
from roughvisc.judge import plan as plan_module
from roughvisc.labels import cost_of
from roughvisc.runs.run import run_case
from roughvisc.study.case import vary

ZENER = {"model": "zener", "shear_modulus": 1e6, "kelvin_modulus": 5e5, "kelvin_viscosity": 1e5}
ROUGH_SURFACE = {"generate": "self_affine", "size": 1e-3, "shape": [90, 108], "hurst": 0.8, "rms_slope": 0.1}
ROUGH = {
    "surface": ROUGH_SURFACE | {"rolloff": 5e-4, "shortcut": 5e-5, "seed": 1},
    "material": ZENER,
    "program": [{"load": 0.02, "over": 0.01}, {"hold": 0.5}],
    "solve": {"boundary": "periodic", "tolerance": 2e-3},
    "keep": {"fields": ["pressure"], "times": "all"},
}
SPHERE = {
    "surface": {"generate": "sphere", "radius": 1e-2, "size": 3e-4, "shape": [25, 24]},
    "material": ZENER | {"shear_modulus": 3e6, "kelvin_modulus": 1e6},
    "program": [{"load": 0.4, "over": 0}, {"hold": 0.95}],
    "solve": {"tolerance": 1e-2},
    "keep": {"times": 4, "fields": ["pressure"]},
}
CURVE = {name: ROUGH[name] for name in ("surface", "material")} | {
    "program": None,
    "friction": {"pressure": 2e4, "speeds": [5e-3, 0.2]},
    "keep": {"fields": ["pressure"]},
}
FEW = {"surface.shape": [16, 15], "surface.shortcut": 2e-4}
RAMP = {"load": 0.02, "over": 0.01}
CYCLE = {"program": [RAMP, {"cycle": {"mean": 0.02, "amplitude": 0.01, "period": 0.1, "cycles": 3}}]}
SLIDE = {"program": [RAMP, {"slide": 2e-4, "over": 0.1, "direction": "x"}], "keep.times": 5}
DECADES = [10.0**power for power in range(-7, 2)]
FAST = {"model": "prony", "glassy": 1e-9, "compliances": [1e-9 * 2.5**i for i in range(9)], "times": DECADES}
CASES = {
    "load": (ROUGH, {}),
    "slide": (ROUGH, SLIDE),
    "fields": (ROUGH, SLIDE | {"keep.times": 20, "keep.fields": ["pressure", "gap"]}),
    "curve": (CURVE, {}),
    "fine": (ROUGH, {"surface.shape": [240, 225], "keep.times": 6}),
    "growing": (SPHERE, {}),
    "part": (SPHERE, {"surface.size": 2e-3, "surface.shape": [201, 187], "program.0.load": 5e-3}),
    "free": (ROUGH, {"solve.boundary": "free", "solve.edge": "accept"}),
    "approach": (ROUGH, {"program": [{"approach": 3e-6, "over": 0.1}, {"hold": 0.2}]}),
    "unloaded": (ROUGH, {"program": [RAMP, {"hold": 0.5}, {"load": 0.004, "over": 0.1}]}),
    "fast": (SPHERE, {"material": FAST, "program": [{"load": 0.01, "over": 1}, {"hold": 5}], "solve.tolerance": 1e-3}),
    "elastic": (ROUGH, {"material": {"model": "elastic", "shear_modulus": 1e6}}),
}
QUICK = ("fast", "load", "slide", "fields", "curve", "fine", "growing", "part")


@pytest.fixture
def study(tmp_path):
    """Make a case of some tables, with changes."""
    return lambda tables, changes=None: vary(case_of(tmp_path, **tables), changes or {})


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in QUICK else pytest.mark.thorough) for name in CASES]
)
def test_plan__is_as_near_to_the_run_as_it_says(study, name):
    case = study(*CASES[name])
    planned, ds = rv.plan([case]).isel(case=0), rv.run(case, progress=False)
    assert str(planned.refusal.values) == ""
    assert 0.5 < float(planned.convolutions) / cost_of(ds)[1] < 2
    assert 0.8 < float(planned.rows) / ds.force.size < 1.25
    assert 1 / 1.2 < pathlib.Path(ds.encoding["source"]).stat().st_size / float(planned.disk) < 1.2
    assert 1 / 1.2 < float(planned.contact_fraction) / float(ds.contact_fraction.max()) < 1.2
    known = at_rows(ds) if "time" in ds.dims else ds
    assert float(planned.nominal_pressure) == pytest.approx(float(known.nominal_pressure.max()), rel=0.1)
    assert (int(planned.cells_x), int(planned.cells_y)) == ds.height.shape


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["load", "slide", "curve", "fine", "part"])
def test_time__is_that_of_the_run_within_a_factor_of_two(study, tmp_path, name):
    """In time of the processor, which other programs change less, of a process that has imported what it needs."""
    case = study(*CASES[name])
    run_case(study(SPHERE if name == "part" else ROUGH, FEW if name != "part" else {}), tmp_path)  # imports
    planned, began = float(rv.plan([case]).wall_time[0]), time.process_time()
    run_case(case, tmp_path, threads=1)
    assert 0.5 < planned / (time.process_time() - began) < 2


THREE = {"model": "prony", "glassy": 3e-7, "compliances": [1e-7, 2e-7, 1e-7], "times": [0.01, 0.05, 1]}
MEMORY = {
    "zener": {},
    "elastic": {"material": {"model": "elastic", "shear_modulus": 1e6}},
    "three": {"material": THREE},
    "free": {"surface.shape": [200, 190], "solve.boundary": "free", "solve.edge": "accept"},
}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name == "zener" else pytest.mark.thorough) for name in MEMORY]
)
def test_memory__is_that_of_the_arrays_of_the_run(study, name):
    few = {"surface.shape": [240, 225], "solve.tolerance": 2e-2, "keep.times": 3, "keep.fields": []}
    case = study(ROUGH, few | MEMORY[name])
    planned = float(rv.plan([case]).memory[0]) - PROCESS
    rv.run(vary(case, FEW), progress=False)  # imports what it needs
    tracemalloc.start()
    try:
        rv.run(case, progress=False)
        taken = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert 1 / 1.3 < planned / taken < 1.3


@pytest.mark.parametrize("changes", [{}, CYCLE, SLIDE], ids=["hold", "cycle", "slide"])
def test_coarse_run__is_carried_on_to_the_end(study, monkeypatch, changes):
    case = study(ROUGH, changes | {"keep.times": 6})
    whole = rv.plan([case])
    monkeypatch.setattr(plan_module, "_MOST_CONVOLUTIONS", int(whole.convolutions[0]) // 3)
    cut = rv.plan([case])
    for name, most in (("steps", 2.0), ("convolutions", 2.0), ("contact_fraction", 1.2)):
        assert 1 / most < float(cut[name][0] / whole[name][0]) < most, name
    assert float(cut.rows[0]) == 6


def test_free_contact__is_solved_on_a_part_of_the_surface(study):
    case = study(SPHERE, {"surface.size": 2e-3, "surface.shape": [201, 187], "program.0.load": 1e-3})
    planned = rv.plan([case, vary(case, {"solve.edge": "accept"})])
    assert planned.cells_x.values.tolist() == [201, 201]
    assert ["solved on" in model for model in planned.model.values] == [True, False]
    assert float(planned.contact_fraction[0]) == pytest.approx(float(planned.contact_fraction[1]), rel=0.15)
    assert planned.memory[0] < planned.memory[1]


def test_copied_numbers__are_marked(study, monkeypatch, tmp_path, invoke):
    for name in ("_BUDGET", "_SHARE"):
        monkeypatch.setattr(plan_module, name, 0.0)
    (tmp_path / "study.toml").write_text(STUDY + '[sweep]\n"program.0.load" = ["10 mN", "20 mN"]\n')
    planned = rv.plan(tmp_path / "study.toml")
    assert list(planned.marched.values) == [True, False]
    assert float(planned.steps[0]) == float(planned.steps[1])
    assert list(np.isfinite(planned.contact_fraction.values)) == [True, False]
    steps = f"{float(f'{float(planned.steps[0]):.2g}'):g}"
    status, out, _ = invoke("plan", tmp_path / "study.toml")
    assert status == 0
    assert re.findall(r"([12]0) mN +[\d.]* +(~?\d+)", out) == [("10", steps), ("20", f"~{steps}")]
    assert [path.name for path in tmp_path.iterdir()] == ["study.toml"], "nothing is written"


def test_contact_fraction__of_a_case_without_a_coarse_run_follows_its_load(study, monkeypatch):
    cases = [study(ROUGH, {"program.0.load": load}) for load in (0.05, 0.15)]
    own = rv.plan(cases)
    for name in ("_BUDGET", "_SHARE"):
        monkeypatch.setattr(plan_module, name, 0.0)
    planned = rv.plan(cases)
    assert list(planned.marched.values) == [True, False]
    np.testing.assert_allclose(planned.contact_fraction, own.contact_fraction, rtol=0.2)
    np.testing.assert_allclose(planned.nominal_pressure, own.nominal_pressure, rtol=1e-9)


def test_full_contact__is_foreseen(study):
    heavy = rv.plan([study(ROUGH, {"program.0.load": 2.0})]).isel(case=0)
    assert float(heavy.contact_fraction) > 0.95
    assert float(heavy.nominal_pressure) == pytest.approx(2e6)


def test_contact_at_the_border__is_foreseen_where_it_ends_the_run(study):
    surface = ROUGH_SURFACE | {"shape": [40, 36], "seed": 1}
    rough = study(SPHERE | {"surface": surface}, {"solve.boundary": "free", "program.0.load": 5e-3})
    costs = rv.plan([rough, vary(rough, {"solve.edge": "accept"})])
    assert list(costs.warning.values != "") == [True, False]
    with pytest.raises(EdgeContactError):
        rv.run(rough, progress=False)


def test_plan__refuses_with_a_reason(study, monkeypatch):
    case = study(SPHERE)
    beyond = vary(case, {"solve.boundary": "periodic", "program": ({"approach": "1 mm", "over": 1},)})
    planned = rv.plan([case, beyond], workers=2)
    assert list(planned.refusal.values != "") == [False, True]
    assert np.isnan(planned.wall_time[1])
    assert planned.attrs["wall_time"] == planned.wall_time[0], "no sweep is quicker than its longest case"
    with refused("cases", []):
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
    planned = rv.plan([study(ROUGH | {"surface": {"file": str(tmp_path / "scan.nc")}})])
    assert "missing" in str(planned.refusal[0].item())
