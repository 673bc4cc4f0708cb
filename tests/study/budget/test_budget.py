"""The whole error of one number: sources against closed forms, and what is refused."""

import json

import numpy as np
import pytest
import xarray as xr

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.study.budget.budget import budgets
from roughvisc.study.quantities import QUANTITIES
from roughvisc.study.statement.schema.evaluation import WANTED

BALL = """
title = "Ball"
[surface]
generate = "sphere"
radius = "1 mm"
size = "0.2 mm"
shape = [45, 45]
[material]
model = "elastic"
shear_modulus = "1 MPa"
[[program]]
load = "0.2 mN"
over = 0
[[program]]
hold = "1 s"
[keep]
times = [0.0, 1.0]
"""
ROUGH = """
title = "Rough"
[surface]
generate = "self_affine"
size = ["1 mm", "0.9 mm"]
shape = [54, 50]
hurst = 0.8
rms_slope = 0.2
rolloff = "0.3 mm"
amplitudes = "gaussian"
seed = 1
[material]
model = "zener"
shear_modulus = "3 MPa"
kelvin_modulus = "1 MPa"
kelvin_viscosity = "0.1 MPa s"
[[program]]
pressure = "50 kPa"
over = 0
[[program]]
hold = "1 s"
[solve]
boundary = "periodic"
tolerance = 1e-2
[keep]
times = [0.01, 1.0]
"""


QUIET = {"workers": 0, "progress": False}


def case(text, tmp_path, **changes):
    path = tmp_path / "study.toml"
    path.write_text(text)
    return rv.vary(rv.read_study(path), changes)


def stated(study, tmp_path, quantity, **options):
    return rv.budget(study, quantity, out=tmp_path / "budget", workers=0, progress=False, **options)


def width(found, source, row=-1):
    return float(found["half_width"].sel(source=source)[row])


def test_budget__holds_hertz(tmp_path):
    """Radius of contact and approach of a paraboloid: a^3 = 3 F R / (4 E*), d = a^2 / R, with E* = 4 G."""
    study = case(BALL, tmp_path)
    radius = (3 * 2e-4 * 1e-3 / (4 * 4e6)) ** (1 / 3)
    exact = {"contact_area": np.pi * radius**2, "approach": radius**2 / 1e-3, "force": 2e-4}
    found = budgets(study, list(exact), out=tmp_path / "budget", workers=0, progress=False)
    for name, true in exact.items():
        one = found[name]
        assert (one["lower"] <= true * (1 + 1e-12)).all(), name
        assert (true <= one["upper"] * (1 + 1e-12)).all(), name
        assert (np.log(one["upper"] / one["lower"]) < 0.4).all(), name


def test_budget__of_an_indenter_says_that_samples_and_waves_have_no_meaning(tmp_path):
    found = stated(case(BALL, tmp_path), tmp_path, "contact_area", population="ensemble", cutoff=1e-6)
    states = dict(zip(found["source"].values.tolist(), found["state"].values.tolist(), strict=True))
    assert [states[name] for name in ("sample", "next octave of waves", "longest waves")] == ["none"] * 3
    assert "no sample" in str(found["method"].sel(source="sample").values)
    assert states["time scale"] == "none"
    assert found.attrs["open"] == "modulus"


@pytest.mark.parametrize(("quantity", "power"), [("contact_area", 2 / 3), ("approach", 2 / 3), ("force", 0.0)])
def test_budget__modulus_of_a_hertz_contact(tmp_path, quantity, power):
    """Area and approach under a load go with the modulus to the power -2/3; an area is counted in cells."""
    fine = case(BALL, tmp_path, **{"surface.shape": [131, 131]})
    found = stated(fine, tmp_path, quantity, modulus_error=0.05)
    assert width(found, "modulus") == pytest.approx(power * np.log(1.05), rel=0.1, abs=1e-9)


def test_budget__time_scale_of_a_fluid_under_a_ball(tmp_path):
    """a^3 goes with J = 1/G + t/eta: its logarithm changes with that of the times by -(t/eta) / J."""
    changes = {"material": {"model": "maxwell", "shear_modulus": "1 MPa", "viscosity": "1 MPa s"}}
    study = case(BALL, tmp_path, **changes, **{"program.0.load": "0.05 mN"})
    found = stated(study, tmp_path, "approach", time_scale_error=0.05)
    assert width(found, "time scale", 0) == pytest.approx(0.0, abs=1e-6)
    slope = np.log((1 + 1 / 1.1) / 2) / np.log(1.1)  # between the times and those a tenth longer
    assert width(found, "time scale") == pytest.approx(-2 / 3 * slope * np.log(1.05), rel=0.03)


def test_budget__grid_of_two_and_three(tmp_path):
    study = case(ROUGH, tmp_path)
    cheap, sharp = (stated(study, tmp_path, "contact_area", sharp=sharp) for sharp in (False, True))
    near = np.log(sharp["value"] / cheap["value"])
    assert (np.abs(near) < cheap["half_width"].sel(source="grid")).all()
    assert (sharp["half_width"].sel(source="grid") >= 1.5 * np.abs(near) - 1e-12).all()
    assert (sharp["half_width"].sel(source="grid") < cheap["half_width"].sel(source="grid")).all()


def test_budget__missing_waves_count_on_one_side(tmp_path):
    """Waves that are not held lessen the contact area and open the gap; the further down they go, the more."""
    study = case(ROUGH, tmp_path)
    one = budgets(
        study, ["contact_area", "mean_gap"], out=tmp_path / "b", known={"cutoff": "18 um"}, workers=0, progress=False
    )
    two = budgets(
        study, ["contact_area", "mean_gap"], out=tmp_path / "b", known={"cutoff": "9 um"}, workers=0, progress=False
    )
    octave = "next octave of waves"
    assert (one["contact_area"]["direction"].sel(source=octave) == -1).all()
    assert (one["mean_gap"]["direction"].sel(source=octave) == 1).all()
    for found in one.values():
        down, up = (np.abs(np.log(found[end] / found["value"])) for end in ("lower", "upper"))
        missed = found["half_width"].sel(source=octave)
        both = (found["half_width"] * (found["direction"] == 0)).sum("source")
        assert (missed > 0.05 * both).all()
        first, other = (down, up) if found is one["contact_area"] else (up, down)
        assert (first > missed - 1e-12).all()
        assert (other < both + 1e-12).all()
    ratio = [width(found["contact_area"], octave) for found in (one, two)]
    shortest = 2 ** (ratio[0] / (ratio[1] - ratio[0])) * 18e-6  # both follow from one wavelength and one change
    assert 2 - 1e-9 <= shortest / (1e-3 / 54) < 2.1  # the grid holds whole rings of waves of two cells


def test_budget__holds_the_waves_that_a_finer_grid_shows(tmp_path):
    """The same surface with its waves down to the cut-off, on a grid that holds them."""
    fine = case(ROUGH, tmp_path, **{"surface.shape": [216, 200], "surface.shortcut": "18.6 um"})
    scan = rv.vary(fine, {"surface.band_limit": [54, 50]})
    true = rv.run(fine, out=tmp_path / "true", progress=False)
    for name in ("contact_area", "mean_gap"):
        found = stated(scan, tmp_path, name, cutoff="18.6 um", modulus_error=0.0, time_scale_error=0.0)
        assert found.attrs["open"] == ""
        assert (found["lower"] < true[name]).all()
        assert (true[name] < found["upper"]).all()


@pytest.mark.thorough
def test_budget__sample_is_the_scatter_of_other_patches(tmp_path):
    study = case(ROUGH, tmp_path)
    patch, ensemble = (stated(study, tmp_path, "mean_gap", population=one) for one in ("patch", "ensemble"))
    assert width(patch, "sample") == 0
    gaps = []
    for seed in range(20, 32):
        other = rv.vary(study, {"surface.seed": seed, "surface.band_limit": [27, 25]})
        gaps.append(rv.run(other, out=tmp_path / "others", progress=False)["mean_gap"].values[-1])
    scatter = np.std(np.log(gaps), ddof=1)
    assert 0.3 < width(ensemble, "sample") / (3.3 * scatter) < 3  # 6 and 12 draws
    assert ensemble["upper"][-1] > patch["upper"][-1]


def test_budget__of_friction_knows_its_slope_over_speed(tmp_path):
    """Times a tenth longer are speeds a tenth higher."""
    text = ROUGH[: ROUGH.index("[[program]]")] + '[friction]\nspeeds = [1e-3]\npressure = "50 kPa"\n'
    text += '[solve]\nboundary = "periodic"\n'
    study = case(text, tmp_path)
    found = stated(study, tmp_path, "friction_coefficient", time_scale_error=0.05)
    faster = []
    for speed in (1e-3, 1.1e-3):
        coarse = rv.vary(study, {"surface.band_limit": [27, 25], "friction.speeds": [speed]})
        faster.append(float(rv.run(coarse, out=tmp_path / "curve", progress=False)["friction_coefficient"][0]))
    slope = abs(np.log(faster[1] / faster[0])) / np.log(1.1)
    assert width(found, "time scale") == pytest.approx(slope * np.log(1.05), rel=1e-3)
    assert found["value"].dims == ("speed",)


def test_budget__of_friction_computes_no_octave_beside_each_solve(tmp_path):
    text = (
        ROUGH[: ROUGH.index("[[program]]")] + '[friction]\nspeeds = [1e-3]\npressure = "50 kPa"\nlast_octave = true\n'
    )
    stated(case(text, tmp_path), tmp_path, "friction_coefficient")
    for path in (tmp_path / "budget").glob("*.nc"):
        with xr.open_dataset(path) as one:
            assert not json.loads(one.attrs["case"])["friction"]["last_octave"]


def test_budget__of_a_surface_with_absent_cells_is_of_no_sample(tmp_path):
    heights = rv.self_affine(1e-3, (24, 22), hurst=0.8, rms_slope=0.2, rolloff=3e-4, seed=3)
    heights[3:6, 4:8] = np.nan
    rv.save_scan(heights, tmp_path / "scan.x3p")
    recipe = ROUGH[ROUGH.index("generate") : ROUGH.index("[material]")]
    text = ROUGH.replace(recipe, 'file = "scan.x3p"\nmissing = "absent"\n')
    found = stated(case(text, tmp_path), tmp_path, "contact_area", population="ensemble", cutoff="10 um")
    states = dict(zip(found["source"].values.tolist(), found["state"].values.tolist(), strict=True))
    assert [states[name] for name in ("sample", "next octave of waves", "longest waves")] == ["none"] * 3
    assert (found["lower"] < found["value"]).all()


def test_budget__warns_of_a_solve_that_did_not_converge(tmp_path, caplog, stubborn):
    stated(case(BALL, tmp_path), tmp_path, "contact_area")
    assert "budget: the solve 'own': unconverged" in caplog.text


def test_budget__of_a_mirrored_scan_takes_patches_of_its_own_size(tmp_path):
    scan = rv.self_affine((1e-3, 0.9e-3), (40, 36), hurst=0.8, rms_slope=0.2, rolloff=3e-4, seed=3)
    rv.save_scan(scan, tmp_path / "scan.x3p")
    text = ROUGH.replace(
        ROUGH[ROUGH.index("generate") : ROUGH.index("[material]")], 'file = "scan.x3p"\nmirror = true\n'
    )
    text = text.replace('pressure = "50 kPa"', 'load = "180 mN"')  # 50 kPa on the four images
    found = stated(case(text, tmp_path), tmp_path, "contact_area", population="ensemble", sharp=True)
    assert 0 < width(found, "sample") < 1
    shapes = set()
    for path in (tmp_path / "budget").glob("*.nc"):
        with xr.open_dataset(path) as one:
            height, number = one["height"].values, json.loads(one.attrs["case"])["surface"].get("realisation")
            shapes.add((number, *height.shape))
            assert np.allclose(one["nominal_pressure"], 5e4)
            assert np.array_equal(height, height[::-1, ::-1]), "images of what was measured, or drawn"
            assert np.std(height[: len(height) // 4]) != np.std(height[len(height) // 4 : len(height) // 2])
    assert {shape for shape in shapes if shape[0]} == {(number, 40, 36) for number in range(1, 7)}
    assert {shape[1:] for shape in shapes if not shape[0]} == {(80, 72), (40, 36), (160, 144)}


@pytest.mark.thorough
def test_budget__a_surface_with_plateaus_is_no_random_phase_surface(tmp_path):
    """Cut off at its mean, a surface touches over far more area than random surfaces with its spectrum."""
    rough = rv.self_affine((1e-3, 0.9e-3), (54, 50), hurst=0.8, rms_slope=0.2, rolloff=3e-4, shortcut=8e-5, seed=1)
    worn = rough.copy(data=np.minimum(rough.values, 0.0))
    text = ROUGH.replace(ROUGH[ROUGH.index("generate") : ROUGH.index("[material]")], 'file = "scan.x3p"\n')
    for height, stands in ((rough, "inside"), (worn, "above")):
        folder = tmp_path / stands
        folder.mkdir()
        rv.save_scan(height, folder / "scan.x3p")
        study = case(text, folder)
        found = stated(study, folder, "contact_area", population="ensemble")
        level = height.values - height.values.mean()
        assert found.attrs["kurtosis"] == pytest.approx((level**4).mean() / (level**2).mean() ** 2, rel=1e-3)
        coarse = rv.vary(study, {"surface.band_limit": [27, 25]})  # as the surrogates are
        cases = [coarse, *(rv.vary(coarse, {"surface.realisation": number}) for number in range(1, 7))]
        own, *drawn = (rv.run(one, progress=False)["contact_area"][-1].item() for one in cases)
        assert float(found["surrogate_ratio"][-1]) == pytest.approx(own / np.mean(drawn), rel=1e-6)
        meanings = found["standing"].attrs["flag_meanings"].split()
        assert meanings[int(found["standing"][-1])] == stands
        assert ("own_note" in found.attrs) == (stands == "above")
    assert found.attrs["own_note"].startswith("not a random-phase surface: the number is ")
    assert "surrogate_ratio" not in stated(study, folder, "contact_area")


def test_budget__of_a_resampled_scan_keeps_its_waves(tmp_path):
    """A finer grid for the error of the grid shows no waves that the study has left out."""
    whole = case(ROUGH, tmp_path, **{"surface.shape": [216, 200]})
    study = rv.vary(whole, {"surface.resample": [54, 50]})
    found = stated(study, tmp_path, "mean_gap", sharp=True)
    plain = case(ROUGH, tmp_path, **{"surface.shape": [216, 200], "surface.band_limit": [54, 50]})
    np.testing.assert_allclose(found["value"], stated(plain, tmp_path, "mean_gap", sharp=True)["value"], rtol=1e-6)
    gaps = [rv.run(one, out=tmp_path / "own", progress=False)["mean_gap"] for one in (study, whole)]
    apart = [np.abs(np.log(one / found["value"])) for one in gaps]
    assert (apart[0] < 0.3 * apart[1]).all()


def test_budget__takes_what_the_study_knows_of_errors(tmp_path):
    """What is given in the call counts before it."""
    told = {"want": {"modulus_error": "5 %", "time_scale_error": 0.1, "cutoff": "18 um", "population": "ensemble"}}
    study, plain = case(ROUGH, tmp_path, **told), case(ROUGH, tmp_path)
    assert study.key == plain.key
    given = {"modulus_error": 0.05, "time_scale_error": "10 %", "cutoff": 1.8e-5, "population": "ensemble"}
    found = stated(study, tmp_path, "contact_area")
    xr.testing.assert_equal(found, stated(plain, tmp_path, "contact_area", **given))
    assert found.attrs["open"] == ""
    other = stated(study, tmp_path, "contact_area", modulus_error=0.0, population="patch")
    assert width(other, "modulus") == 0 < width(found, "modulus")
    assert width(other, "sample") == 0 < width(found, "sample")


def test_wanted_numbers__are_those_that_a_budget_knows():
    assert set(WANTED) == set(QUANTITIES)


def test_budget__keeps_its_solves(tmp_path, monkeypatch):
    study = case(BALL, tmp_path)
    first = stated(study, tmp_path, "contact_area", modulus_error=0.05)
    monkeypatch.setattr("roughvisc.study.execution.run.compute", None)
    xr.testing.assert_identical(stated(study, tmp_path, "contact_area", modulus_error=0.05), first)


def test_budget__of_a_result_and_at_a_time(tmp_path):
    study = case(BALL, tmp_path)
    result = rv.run(study, out=tmp_path / "results", progress=False)
    found = rv.budget(result, at=1.0, workers=0, progress=False)
    assert found["time"].values.tolist() == [1.0]
    assert (tmp_path / "results" / "budget").is_dir()
    assert float(found["value"][0]) == pytest.approx(float(result["contact_area"][-1]), rel=1e-6)


def test_budget__reads_what_a_result_states_of_its_grid(tmp_path):
    """No other grid is solved, and of a history the error is that of the largest value."""
    study = case(BALL, tmp_path, **{"solve.grid_error": True, "program.0.over": "1 s", "keep.times": [0.5, 1.0, 2.0]})
    result = rv.run(study, out=tmp_path / "results", progress=False)
    found = budgets(result, ["contact_area", "approach"], at=[0.5, 2.0], workers=0, progress=False)
    accuracy = result
    for name, variable in (("contact_area", "grid_error_area"), ("approach", "grid_error_approach")):
        part = accuracy[variable].values * float(result[name].max()) / result[name].values
        stated_width = found[name]["half_width"].sel(source="grid")
        np.testing.assert_allclose(stated_width, np.log1p(part)[[0, 2]], rtol=1e-6)
        np.testing.assert_array_equal(found[name]["value"], result[name].values[[0, 2]])
        assert (found[name]["cost"] == 0).all()
    assert not list((tmp_path / "results" / "budget").glob("*.nc"))
    sharp = rv.budget(result, sharp=True, workers=0, progress=False)
    assert float(sharp["cost"].sel(source="grid")) > 0


def test_budget__reads_the_last_octave_that_a_curve_states(tmp_path):
    text = ROUGH[: ROUGH.index("[[program]]")] + '[friction]\nspeeds = [1e-3, 1e-2]\npressure = "50 kPa"\n'
    plain = case(text + '[solve]\nboundary = "periodic"\n', tmp_path)
    solved = budgets(
        plain, ["friction_coefficient", "contact_area"], out=tmp_path / "b", known={"cutoff": "18 um"}, **QUIET
    )
    study = rv.vary(plain, {"friction.last_octave": True, "solve.grid_error": True})
    result = rv.run(study, out=tmp_path / "results", progress=False)
    found = budgets(result, ["friction_coefficient", "contact_area"], known={"cutoff": "18 um"}, **QUIET)
    assert not list((tmp_path / "results" / "budget").glob("*.nc"))
    octave = {"source": "next octave of waves"}
    for name, one in found.items():
        np.testing.assert_allclose(one["half_width"].sel(octave), solved[name]["half_width"].sel(octave), rtol=0.1)
        assert (one["direction"].sel(octave) == solved[name]["direction"].sel(octave)).all()
        assert "as the result states" in str(one["method"].sel(octave).values)
    stated_grid = np.log1p(result["grid_error_friction"].values)
    np.testing.assert_allclose(found["friction_coefficient"]["half_width"].sel(source="grid"), stated_grid, rtol=1e-6)
    other = rv.budget(result, "leak_rate", **QUIET)  # which the result states nothing of
    assert float(other["cost"].sel(source="grid")) > 0


def dynamic(frequencies, noise=0.0):
    """The Zener solid of ROUGH as dynamic moduli, with noise."""
    rng = np.random.default_rng(5)
    x, stiff, soft = frequencies * 0.1 / 4, 3e6, 0.75e6  # relaxation time and moduli of it
    moduli = soft + (stiff - soft) * x**2 / (1 + x**2), (stiff - soft) * x / (1 + x**2)
    storage, loss = (one * np.exp(noise * rng.standard_normal(x.size)) for one in moduli)
    columns = {"frequencies": frequencies.tolist(), "storage": storage.tolist(), "loss": loss.tolist()}
    return {"material": {"model": "dynamic", "frequency_unit": "rad/s", **columns}}


def test_budget__of_a_fit_has_the_error_of_its_rows(tmp_path):
    """Area and approach under a load go with the modulus to the power -2/3."""
    table = dynamic(np.geomspace(0.1, 1e3, 40), 0.05)
    study = case(BALL, tmp_path, **table, **{"keep.times": [0.1, 1.0]})
    found = stated(study, tmp_path, "approach")
    fit = study.material().fit
    for row, time in enumerate((0.1, 1.0)):
        most = np.max(fit.error(np.geomspace(time / 10, time, 11)))
        assert width(found, "material fit", row) == pytest.approx(2 / 3 * np.log1p(most), rel=0.02)
        assert 0.005 < most < 0.1
    assert str(found["state"].sel(source="material fit").values) == "counted"
    assert float(found["cost"].sel(source="material fit")) > 0
    given = stated(case(BALL, tmp_path), tmp_path, "approach")
    assert "given by its parameters" in str(given["method"].sel(source="material fit").values)


def test_budget__of_a_fit_that_does_not_reach_the_times_is_open(tmp_path):
    small = {"surface.shape": [25, 25]}
    late = case(BALL, tmp_path, **dynamic(np.geomspace(1e-4, 1e-2, 20)), **small)
    found = stated(late, tmp_path, "approach")
    assert "material fit" in found.attrs["open"]
    assert "extend it" in str(found["method"].sel(source="material fit").values)
    part = stated(case(BALL, tmp_path, **dynamic(np.geomspace(1.0, 1e3, 20)), **small), tmp_path, "approach")
    assert "1 of 2 places need times beyond 1 ms to 1 s" in str(part["method"].sel(source="material fit").values)


def test_budget__of_several_quantities_states_their_units(tmp_path):
    found = stated(case(BALL, tmp_path), tmp_path, ["contact_area", "approach"])
    assert found["units"].values.tolist() == ["m^2", "m"]
    assert found["value"].dims == ("quantity", "time")


def test_budget__of_a_closed_gap_has_no_interval(tmp_path):
    """The leak rate of a map in which contact percolates is zero: a probability, and no logarithm."""
    study = case(ROUGH, tmp_path, **{"program.0.pressure": "3 MPa"})
    found = stated(study, tmp_path, "leak_rate", population="ensemble")
    assert (found["value"] == 0).all()
    assert "zero in 6 of them" in str(found["method"].sel(source="sample").values)
    assert np.isnan(found["lower"]).all()
    assert np.isnan(found["upper"]).all()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"quantity": "area"}, "quantity is 'area': expected one of contact_area"),
        ({"quantity": []}, "quantity is empty"),
        ({"quantity": "friction_coefficient"}, "expected a study in which the surface slides"),
        ({"population": "all"}, "population is 'all': expected 'patch' or 'ensemble'"),
        ({"modulus_error": 1.5}, "modulus_error is 1.5: expected a relative error"),
        ({"time_scale_error": -0.1}, "time_scale_error is -0.1"),
        ({"cutoff": "2 kg"}, "cutoff"),
        ({"cutoff": 0.0}, "cutoff"),
        ({"at": 7.0}, "7 s"),
    ],
)
def test_budget__refuses(tmp_path, options, message):
    with pytest.raises(InputError, match=message):
        stated(case(BALL, tmp_path), tmp_path, **{"quantity": "contact_area", **options})
    assert not (tmp_path / "budget").exists()


def test_budget__refuses_a_result_that_states_no_case():
    ball = rv.sphere(1e-3, 2e-4, 15)
    result = rv.simulate(ball, rv.elastic(1e6), rv.Program().load(1e-4, over=0), progress=False)
    with pytest.raises(InputError, match="the result states no case"):
        rv.budget(result)
