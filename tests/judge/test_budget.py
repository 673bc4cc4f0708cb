"""The total uncertainty of a number: sources compared with closed forms; the grid chosen for a wanted error."""

import io

import click
import numpy as np
import pytest
import xarray as xr
from rich.console import Console
from support import STUDY, case_of, refused

import roughvisc as rv
from roughvisc.cli.studies import parse_targets
from roughvisc.cli.study_tables import budget_table
from roughvisc.study.case import Case

BALL = {
    "surface": {"generate": "sphere", "radius": 1e-3, "size": 2e-4, "shape": [45, 43]},
    "material": {"model": "elastic", "shear_modulus": 1e6},
    "program": [{"load": 2e-4, "over": 0}, {"hold": 1.0}],
    "keep": {"times": [0.0, 1.0]},
}
ROUGH_SURFACE = {"generate": "self_affine", "size": [1e-3, 9e-4], "shape": [54, 50], "hurst": 0.8, "rms_slope": 0.2}
ROUGH = {
    "surface": ROUGH_SURFACE | {"rolloff": 3e-4, "amplitudes": "gaussian", "seed": 1},
    "material": {"model": "zener", "shear_modulus": 3e6, "kelvin_modulus": 1e6, "kelvin_viscosity": 1e5},
    "program": [{"pressure": 5e4, "over": 0}, {"hold": 1.0}],
    "solve": {"boundary": "periodic", "tolerance": 1e-2},
    "keep": {"fields": [], "times": [0.01, 1.0]},
}
SMOOTH = {"surface.shape": [27, 25], "surface.shortcut": "150 um", "solve.tolerance": 1e-3}
RADIUS = (3 * 2e-4 * 1e-3 / (4 * 4e6)) ** (1 / 3)  # of the contact of BALL: a^3 = 3 F R / (4 E*), with E* = 4 G
OCTAVE = "next octave of waves"


def case(tables, tmp_path, **changes):
    return rv.vary(case_of(tmp_path, **tables), changes)


def stated(study, tmp_path, quantity="contact_area", **options):
    found = rv.budget(study, quantity, out=tmp_path / "budget", workers=0, progress=False, **options)
    return found if isinstance(quantity, str) else {name: found.sel(quantity=name) for name in quantity}


def width(found, source, row=-1):
    return float(found["half_width"].sel(source=source)[row])


# ----------------------------------------------------------------------------------------------------------------
# sources


def test_interval__holds_hertz(tmp_path):
    exact = {"contact_area": np.pi * RADIUS**2, "approach": RADIUS**2 / 1e-3, "force": 2e-4}
    found = stated(case(BALL, tmp_path), tmp_path, list(exact))
    for name, true in exact.items():
        one = found[name]
        assert (one["lower"] <= true * (1 + 1e-12)).all(), name
        assert (true <= one["upper"] * (1 + 1e-12)).all(), name
        assert (np.log(one["upper"] / one["lower"]) < 0.4).all(), name


@pytest.mark.parametrize(("quantity", "power"), [("contact_area", 2 / 3), ("approach", 2 / 3), ("force", 0.0)])
def test_modulus__of_a_hertz_contact(tmp_path, quantity, power):
    """Area and approach under a load go with the modulus to the power -2/3; an area is counted in cells."""
    halved = {"material.shear_modulus": "2 MPa", "material.modulus_factor": 0.5}
    fine = case(BALL, tmp_path, **{"surface.shape": [131, 131]}, **halved)
    found = stated(fine, tmp_path, quantity, modulus_error=0.05)
    assert width(found, "modulus") == pytest.approx(power * np.log(1.05), rel=0.1, abs=1e-9)


def test_sticky_ball__has_the_errors_of_work_and_range_and_signed_bounds(tmp_path):
    """Of stiff surfaces apart the tension is ``2 pi R w exp(approach / range)``; the wider grid is not refused."""
    gap, reach = 1e-7, 1e-7
    tables = BALL | {
        "surface": {"generate": "sphere", "radius": 1e-5, "size": 1.2e-5, "shape": [24, 24]},
        "material": {"model": "elastic", "shear_modulus": 1e9},
        "adhesion": {"work": 1e-3, "range": reach},
        "program": [{"approach": -gap, "over": 0}],
        "solve": {"boundary": "free", "tolerance": 1e-3, "edge": "accept"},
        "keep": {"times": [0.0], "fields": []},
    }
    found = stated(case(tables, tmp_path), tmp_path, "force", modulus_error=0.05, work_error=0.2, range_error=0.1)
    exact = -2 * np.pi * 1e-5 * 1e-3 * np.exp(-gap / reach)
    assert float(found["lower"][0]) < exact < float(found["upper"][0]) < 0
    assert width(found, "work of adhesion") == pytest.approx(np.log(1.2), rel=1e-2)
    assert width(found, "range of adhesion") == pytest.approx(np.log(1.1) * gap / reach, rel=0.1)
    assert width(found, "modulus") < 1e-3
    assert "range of adhesion" not in stated(case(BALL, tmp_path), tmp_path)["source"]


def test_time_scale__of_a_fluid_under_a_ball(tmp_path):
    """a^3 goes with J = 1/G + t/eta: its logarithm changes with that of the times by -(t/eta) / J."""
    fluid = {"model": "maxwell", "shear_modulus": "1 MPa", "viscosity": "10 MPa s", "shift_factor": 0.1}
    changes = {"material": fluid}
    study = case(BALL, tmp_path, **changes, **{"program.0.load": "0.05 mN"})
    found = stated(study, tmp_path, "approach", time_scale_error=0.05)
    assert width(found, "time scale", 0) == pytest.approx(0.0, abs=1e-6)
    slope = np.log((1 + 1 / 1.1) / 2) / np.log(1.1)  # between the times and those a tenth longer
    assert width(found, "time scale") == pytest.approx(-2 / 3 * slope * np.log(1.05), rel=0.03)


def test_grid__holds_the_change_to_cells_half_as_long_and_not_much_more(tmp_path):
    """Long cells lose short waves, which is no error of the short cells."""
    study = case(ROUGH, tmp_path)
    fine = rv.run(rv.vary(study, {"surface.resample": (108, 100)}), out=tmp_path / "fine", progress=False)
    over = []
    for name, found in stated(study, tmp_path, ["contact_area", "mean_gap"]).items():
        over.append(found["half_width"].sel(source="grid") / np.abs(np.log(fine[name] / found["value"])))
    assert np.min(over) > 1
    assert np.median(over) < 10


@pytest.mark.thorough
def test_missing_waves__count_on_one_side(tmp_path):
    """Waves that are not held lessen the contact area and open the gap; the further down they go, the more."""
    study, names = case(ROUGH, tmp_path), ["contact_area", "mean_gap"]
    one, two = (stated(study, tmp_path, names, cutoff=cutoff) for cutoff in ("18 um", "9 um"))
    for name, side in (("contact_area", -1), ("mean_gap", 1)):
        found = one[name]
        missed = found["half_width"].sel(source=OCTAVE)
        both = (found["half_width"] * (found["direction"] == 0)).sum("source")
        assert (found["direction"].sel(source=OCTAVE) == side).all()
        assert (missed > 0.05 * both).all()
        ends = [np.abs(np.log(found[end] / found["value"])) for end in ("lower", "upper")]
        towards, other = ends if side < 0 else ends[::-1]
        assert (towards > missed - 1e-12).all()
        assert (other < both + 1e-12).all()
    ratio = [width(found["contact_area"], OCTAVE) for found in (one, two)]
    shortest = 2 ** (ratio[0] / (ratio[1] - ratio[0])) * 18e-6  # both follow from one wavelength and one change
    assert 2 - 1e-9 <= shortest / (1e-3 / 54) < 2.1  # the grid holds whole rings of waves of two cells


@pytest.mark.thorough
def test_interval__holds_the_waves_that_a_finer_grid_shows(tmp_path):
    """The same surface with its waves down to the cut-off, on a grid that holds them."""
    fine = case(ROUGH, tmp_path, **{"surface.shape": [216, 200], "surface.shortcut": "18.6 um"})
    scan = rv.vary(fine, {"surface.resample": (54, 50)})
    true = rv.run(fine, out=tmp_path / "true", progress=False)
    for name in ("contact_area", "mean_gap"):
        found = stated(scan, tmp_path, name, cutoff="18.6 um", modulus_error=0.0, time_scale_error=0.0)
        assert found.attrs["open"] == ""
        assert (found["lower"] < true[name]).all()
        assert (true[name] < found["upper"]).all()


@pytest.mark.thorough
def test_sample__is_the_scatter_of_other_patches(tmp_path):
    study = case(ROUGH, tmp_path)
    patch, ensemble = (stated(study, tmp_path, "mean_gap", population=one) for one in ("patch", "ensemble"))
    assert "sample" not in patch["source"]
    gaps = []
    for seed in range(20, 32):
        other = rv.vary(study, {"surface.seed": seed, "surface.resample": (27, 25)})
        gaps.append(rv.run(other, out=tmp_path / "others", progress=False)["mean_gap"].values[-1])
    scatter = np.std(np.log(gaps), ddof=1)
    assert 0.3 < width(ensemble, "sample") / (3.3 * scatter) < 3  # 6 and 12 draws
    assert ensemble["upper"][-1] > patch["upper"][-1]


def test_indenter__has_no_sample_and_no_further_waves(tmp_path):
    found = stated(case(BALL, tmp_path), tmp_path, population="ensemble", cutoff=1e-6)
    assert found["source"].values.tolist() == ["time steps and solver", "grid", "modulus"]
    assert found.attrs["open"] == "modulus"


@pytest.mark.thorough
def test_closed_gap__has_no_interval(tmp_path):
    """The leak rate of a map in which contact percolates is zero, and has no logarithm."""
    study = case(ROUGH, tmp_path, **{"program.0.pressure": "3 MPa", "keep.fields": ["gap"]})
    found = stated(study, tmp_path, "leak_rate", population="ensemble")
    assert (found["value"] == 0).all()
    assert np.isnan(found["lower"]).all()
    assert np.isnan(found["upper"]).all()


# ----------------------------------------------------------------------------------------------------------------
# files, refusals, table, figure


def test_solves__are_kept(tmp_path, monkeypatch):
    study = case(BALL, tmp_path)
    first = stated(study, tmp_path, modulus_error=0.05)
    monkeypatch.setattr("roughvisc.runs.run.compute", None)
    xr.testing.assert_identical(stated(study, tmp_path, modulus_error=0.05), first)


@pytest.mark.parametrize(("direction", "text"), [(-1, "-9.5 to 63"), (1, "+11 to 1.7e+02"), (0, "±11 to 1.7e+02")])
def test_table__states_an_error_that_only_lowers_the_number_below_100_percent(tmp_path, direction, text):
    found = stated(case(BALL, tmp_path), tmp_path)
    found["half_width"].loc[{"source": "grid"}] = [0.1, 1.0]
    found["direction"].loc[{"source": "grid"}] = direction
    console = Console(width=200, file=io.StringIO())
    with click.Context(click.Command("budget")):
        console.print(budget_table(found))
    assert text in console.file.getvalue()


def test_finished_result__is_used(tmp_path):
    study = case(BALL, tmp_path)
    result = rv.run(study, progress=False)
    found = rv.budget(study, ["contact_area", "approach"], workers=0, progress=False)
    assert found["time"].values.tolist() == [0.0, 1.0]
    assert float(found["value"][0, -1]) == float(result["contact_area"][-1])
    (folder,) = (tmp_path / "results").glob("*/budget")
    assert len(list(folder.glob("*.nc"))) == 2, "two coarser grids, and not the case again"


@pytest.mark.parametrize(
    ("options", "key", "found"),
    [
        ({"quantity": "area"}, "quantity", "area"),
        ({"quantity": []}, "quantity", []),
        ({"quantity": "friction_coefficient"}, "quantity", "friction_coefficient"),
        ({"population": "all"}, "population", "all"),
        ({"modulus_error": 1.5}, "modulus_error", 1.5),
        ({"time_scale_error": -0.1}, "time_scale_error", -0.1),
        ({"cutoff": "2 kg"}, "cutoff", "2 kg"),
        ({"cutoff": 0.0}, "cutoff", 0.0),
    ],
)
def test_budget__refuses(tmp_path, options, key, found):
    with refused(key, found):
        stated(case(BALL, tmp_path), tmp_path, **options)
    assert not (tmp_path / "budget").exists()


def test_figure__draws_every_source_to_its_side(tmp_path):
    found = stated(case(BALL, tmp_path), tmp_path, modulus_error=0.3)
    found["half_width"][:, -1] = [0.1, 0.2, 0.3]
    found["direction"][:, -1] = [1, -1, 0]
    (bars,) = rv.plot.budget(found).axes
    *sources, together = (bar.get_bbox() for bar in bars.patches)
    ends = [(0.0, 0.1), (-0.2, 0.0), (-0.3, 0.3)]
    np.testing.assert_allclose([(bar.x0, bar.x1) for bar in sources], 100 * np.expm1(ends), atol=1e-9)
    for end, edge in (("lower", together.x0), ("upper", together.x1)):
        assert edge == pytest.approx(100 * (float(found[end][-1] / found["value"][-1]) - 1), rel=1e-9)
    for wrong in (xr.Dataset(), found.expand_dims("quantity")):
        with refused():
            rv.plot.budget(wrong)


# ----------------------------------------------------------------------------------------------------------------
# a wanted error


def got(study, tmp_path, want):
    return rv.run(study, tmp_path / "results", want=want, progress=False)


@pytest.mark.thorough
def test_ball__is_computed_on_the_coarsest_grid_that_gives_the_wanted_error(tmp_path):
    exact, cells = np.pi * RADIUS**2, []
    for part in (0.1, 0.01):
        found = got(case(BALL, tmp_path, **{"surface.shape": [51, 49]}), tmp_path, {"contact_area": part})
        cells.append(found.sizes["x"])
        assert float(found["contact_area"][-1]) == pytest.approx(exact, rel=part)
        with xr.open_dataset(tmp_path / "results" / "budget" / "budget-contact_area.nc") as file:
            one = file.load()
        assert float(one["lower"][-1]) <= exact <= float(one["upper"][-1])
        assert float(one["upper"][-1] / one["value"][-1]) <= 1 + 1.005 * part
        assert found.attrs["tolerance"] == pytest.approx(min(part / 5, 0.01))
    assert cells[0] < cells[1]


@pytest.mark.thorough
def test_choice__is_a_case_like_any_other(tmp_path, monkeypatch):
    study = case(ROUGH, tmp_path, **SMOOTH)
    found = got(study, tmp_path, {"mean_gap": "2 %"})
    chosen = Case.from_json(found.attrs["case"])
    assert chosen.key == found.attrs["case_key"]
    assert chosen.settings.tolerance == pytest.approx(0.004)
    monkeypatch.setattr("roughvisc.runs.run.compute", None)
    again = rv.run(chosen, tmp_path / "results", progress=False)
    xr.testing.assert_identical(again.drop_attrs(), found.drop_attrs())
    assert got(study, tmp_path, {"mean_gap": "2 %"}).attrs["choice"] == found.attrs["choice"]


def test_floor__above_the_wanted_error_is_refused_before_fine_grids_are_solved(tmp_path):
    with refused("approach", 0.01) as error:
        got(case(BALL, tmp_path), tmp_path, {"approach": "1 %", "modulus_error": "10 %"})
    assert "modulus, " in str(error.value)
    assert sorted(path.name for path in (tmp_path / "results").iterdir()) == ["budget"]


def test_target_that_the_finest_grid_misses__is_refused(tmp_path):
    with refused("contact_area", 1e-4) as error:
        got(case(BALL, tmp_path), tmp_path, {"contact_area": 1e-4})
    assert "finer cells" in str(error.value)


@pytest.mark.parametrize("text", ["1 % frobnication", "1", "1 %", "60 s", "3 kg mean_gap"])
def test_target__that_is_none_is_refused(text):
    with refused("for", text):
        parse_targets([text])
    with refused("for", "2 % force"):
        parse_targets(["1 % force", "2 % force"])


@pytest.mark.parametrize(
    ("want", "key"),
    [
        ({"frobnication": "1 %"}, "want"),
        ({"mean_gap": "0 %"}, "want.mean_gap"),
        ({"friction_coefficient": "1 %"}, "quantity"),
        ({"cutoff": "1 um"}, "want"),
        ("1 %", "want"),
    ],
)
def test_want__that_is_none_is_refused(tmp_path, want, key):
    with refused(key):
        got(case(BALL, tmp_path), tmp_path, want)
    assert not (tmp_path / "results").exists()


def test_command__says_what_it_chose_and_ends_with_the_budget(tmp_path, invoke):
    (tmp_path / "study.toml").write_text(STUDY)
    status, said, complained = invoke("run", tmp_path / "study.toml", "--for", "10 % contact_area", "--no-plots")
    assert status == 0, complained
    assert said.index("Chosen\n  grid: ") < said.index("found by") < said.index("Budget: ") < said.index("Result: ")
    folder = tmp_path / "results" / "study"
    assert len(list(folder.glob("*.nc"))) == 1
    assert (folder / "budget" / "budget-contact_area.nc").exists()
    (tmp_path / "study.toml").write_text(STUDY + '[sweep]\n"surface.radius" = ["1 mm", "2 mm"]\n')
    assert invoke("run", tmp_path / "study.toml", "--for", "10 % contact_area")[0] == 2
