"""A third kind of experiment, of 60 lines, has every service without another line of the package."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from experiment.stack import LOADS, Stack, StackSection
from support import assert_same, numbers

import roughvisc as rv
from roughvisc.cli import main
from roughvisc.mechanics.bodies.body import body_of
from roughvisc.problem import Problem
from roughvisc.settings import Settings
from roughvisc.solve import solve
from roughvisc.study.execution.run import run_case
from roughvisc.study.statement import schema
from roughvisc.study.statement.case import read_cases, read_study
from roughvisc.study.trade.ladder import Setting
from roughvisc.variables import axes

STUDY = """
title = "Stacked"
[surface]
generate = "self_affine"
size = ["1 mm", "0.9 mm"]
shape = [40, 33]
hurst = 0.8
rms_slope = 0.1
shortcut = "100 um"
seed = 3
[material]
model = "elastic"
shear_modulus = "1 MPa"
[stack]
loads = ["5 mN", "10 mN", "20 mN"]
[solve]
boundary = "periodic"
[keep]
fields = ["pressure", "gap"]
[audit]
work_of_adhesion = "50 mJ/m^2"
"""


@pytest.fixture(scope="module", autouse=True)
def _known():
    """The experiment is known while these tests run."""
    before = {one: dict(one.model_fields) for one in (schema.Study, schema.StudyFile)}
    axes.declare(LOADS)
    schema.add_experiment(StackSection, "stack")
    yield
    del axes.AXES["load"]
    schema.EXPERIMENTS.remove("stack")
    for study, fields in before.items():
        study.model_fields.clear()
        study.model_fields.update(fields)
        study.model_rebuild(force=True)


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "stack.toml"
    path.write_text(STUDY)
    return path


@pytest.fixture
def invoke():
    def call(*words):
        done = CliRunner().invoke(main, [str(word) for word in words], catch_exceptions=False)
        assert done.exit_code == 0, done.output
        return done.output

    return call


def test_run__gives_what_a_load_gives(study, tmp_path):
    """Against a program of one jump for each."""
    ds = rv.run(study, tmp_path / "out", progress=False)
    assert ds.sizes["load"] == 3
    assert ds["load"].attrs["units"] == "N"
    case = read_study(study)
    single = [
        rv.simulate(case.height(), case.body(), rv.Program().load(load, over=0), boundary="periodic", progress=False)
        for load in case.settings.stack.loads
    ]
    for number, one in enumerate(single):
        force = float(ds.force[number])
        cell = float(ds.contact_area_counted[number]) / np.count_nonzero(ds.pressure[number])
        off = np.abs(ds.pressure[number].values - one.pressure[-1].values).sum() * cell / force
        assert off < 2e-3
        assert float(ds.approach[number]) == pytest.approx(float(one.approach[-1]), rel=1e-3)
    assert (ds.stated_error < 1e-3).all()
    assert ds.attrs["comment"].startswith("Elastic contact at once")


def test_resume__ends_with_the_same_bits(study, tmp_path):
    case, asked = read_study(study), []

    def stop():
        asked.append(1)
        return len(asked) == 2

    run_case(case, tmp_path / "whole")
    with pytest.raises(KeyboardInterrupt):
        run_case(case, tmp_path / "out", stop=stop)
    seen = []
    run_case(case, tmp_path / "out", progress=lambda now, end: seen.append(now))
    assert seen == [3.0]
    assert_same(numbers(tmp_path / "out"), numbers(tmp_path / "whole"))


def test_plan__foresees_rows_and_convolutions(study, tmp_path):
    (planned,) = (rv.plan(study).isel(case=0),)
    ds = rv.run(study, tmp_path / "out", progress=False)
    assert int(planned.rows) == 3
    assert float(planned.convolutions) == pytest.approx(int(ds.convolutions.sum()), rel=0.5)
    assert float(planned.contact_fraction) == pytest.approx(float(ds.contact_fraction.max()), rel=0.1)
    assert str(planned.refusal.values) == ""


def test_sweep__has_a_table_and_results_over_the_axis(study, tmp_path):
    study.write_text(STUDY + '[sweep]\n"material.shear_modulus" = ["1 MPa", "2 MPa"]\n')
    results = rv.sweep(read_cases(study), out=tmp_path / "out", workers=0)
    assert dict(results.sizes)["load"] == 3
    table = rv.to_table(tmp_path / "out")
    assert table["load [N]"].tolist() == [0.02, 0.02]
    assert table["contact_fraction"].iloc[0] > table["contact_fraction"].iloc[1] > 0
    assert table["status"].tolist() == ["converged"] * 2


@pytest.mark.thorough
def test_command_line__plans_runs_draws_reports_and_audits(study, tmp_path, invoke):
    out = tmp_path / "out"
    assert "3" in invoke("plan", study)
    said = invoke("run", study, "--out", out)
    assert "Loads" in said
    assert "3, from F = 5 mN to F = 20 mN" in said
    assert {path.name.rpartition("-")[2] for path in out.glob("*.png")} == {"history.png", "maps.png"}
    invoke("plot", "--all", out)
    pictures = {path.name.rpartition("-")[2] for path in out.glob("*.png")}
    assert {"history.png", "maps.png", "section.png", "surface.png"} <= pictures
    result = next(out.glob("*.nc"))
    page = tmp_path / "page.html"
    invoke("report", result, "-o", page)
    text = page.read_text()
    assert "<th>Loads</th>" in text
    assert "<th>stack</th>" in text
    assert "Assumptions of the model" in text
    assert "adhesion" in invoke("audit", result)


def test_observables__are_derived_of_every_row(study, tmp_path):
    ds = rv.run(study, tmp_path / "out", progress=False)
    leak = rv.observables.leakage(ds, viscosity="1 mPa s", pressure_drop="1 bar").leak_rate
    assert leak.dims == ("load",)
    assert (np.diff(leak) < 0).all()
    spots = rv.observables.conductance(ds, resistivity=(1e-7, 1e-7)).thermal_conductance
    assert spots.dims == ("load",)
    assert (np.diff(spots) > 0).all()
    assert rv.observables.clusters(ds).cluster_count.dims == ("load",)


@pytest.mark.thorough
def test_trade__measures_tolerances_and_grids(study):
    settings = [Setting(0.1), Setting(1e-2), Setting(1e-2, coarsening=2.0)]
    ds = rv.trade(read_study(study), settings, progress=False)
    assert ds.note.values.tolist() == [""] * 3
    wrong = ds.error.sel(quantity="approach").values
    assert wrong[1] < min(wrong[0], wrong[2])
    assert ds.attrs["rows"] == "loads"


def test_study__refuses_what_has_no_meaning(study):
    for change, message in {
        'boundary = "periodic"\ntime_step = "1 ms"': r"solve\.time_step: found 0\.001: a stack of loads has none",
        'boundary = "periodic"\nmethod = "seed"': r"solve\.method: found 'seed': a stack of loads has none",
    }.items():
        study.write_text(STUDY.replace('boundary = "periodic"', change))
        with pytest.raises(rv.InputError, match=message):
            read_study(study)
    study.write_text(STUDY + '[[program]]\nload = "1 N"\nover = 0\n')
    with pytest.raises(rv.InputError, match=r"program: found together with \[stack\]: expected one of them"):
        read_study(study)
    study.write_text(STUDY.replace('loads = ["5 mN", "10 mN", "20 mN"]', 'loads = ["5 m"]'))
    with pytest.raises(rv.InputError, match=r"stack\.loads\.0: found '5 m'"):
        read_study(study)


def test_key__counts_the_loads(study):
    case = read_study(study)
    study.write_text(STUDY.replace('"20 mN"', '"21 mN"'))
    assert read_study(study).key != case.key
    assert json.loads(case.to_json())["stack"] == {"loads": [0.005, 0.01, 0.02]}


def test_grid_error__is_found_by_doing_all_again_on_coarser_grids():
    """Against twice as many cells in each direction, whose surface has the same waves."""
    fine = rv.self_affine(1e-3, (96, 84), hurst=0.8, rms_slope=0.1, shortcut=2e-4, seed=4)
    stack, rubber = Stack((0.01, 0.02)), body_of(rv.elastic(1e6))
    exact, found = (
        solve(Problem(one, rubber, Settings(boundary="periodic", grid_error=one is not fine)), stack)
        for one in (fine, rv.resample(fine, (48, 42)))
    )
    off = np.abs(found.approach - exact.approach) / exact.approach.max()
    assert (off <= found.grid_error).all()
    assert (found.grid_error < 0.5).all()
