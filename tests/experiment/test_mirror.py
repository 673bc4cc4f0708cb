"""Surfaces that are their own mirror images: recognised, solved on a quarter, and shown whole."""

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.experiment import loading
from roughvisc.experiment.profile import Profile
from roughvisc.variables import FIELDS

ZENER = rv.zener(1.0, 1.0, 1.0)
LOADED_TWICE = rv.Program().load(0.05, over=0).hold(0.5).load(0, over=0.2).hold(0.2).load(0.08, over=0.3)
SCAN = rv.self_affine((1.0, 0.8), (22, 17), hurst=0.8, rms_slope=0.05, shortcut=0.15, seed=4)


MIRRORED = {
    "followed by a window": (rv.sphere(1.0, 4.0, (120, 96)), LOADED_TWICE, {}),
    "grown": (rv.sphere(1.0, 0.3, (18, 24)), LOADED_TWICE, {}),
    "whole": (rv.cone(0.3, 1.0, (20, 26)), LOADED_TWICE, {"edge": "accept"}),
    "absent cells": (rv.flat_punch(0.3, 1.0, (20, 26)), LOADED_TWICE, {"missing": "absent", "edge": "accept"}),
    "periodic": (rv.wavy(0.02, 0.5, 1.0, (20, 26)), LOADED_TWICE, {"boundary": "periodic"}),
    "under given approach": (rv.sphere(1.0, 1.0, (24, 20)), rv.Program().approach(0.05, over=0.2).hold(0.3), {}),
    "mirrored scan": (rv.mirror(SCAN), LOADED_TWICE, {"boundary": "periodic"}),
}


@pytest.fixture
def profiles(monkeypatch):
    """Those that were solved on, in order."""
    noted = []

    class Noted(Profile):
        def __init__(self, *given, **named):
            super().__init__(*given, **named)
            noted.append(self)

    monkeypatch.setattr(loading, "Profile", Noted)
    return noted


@pytest.mark.parametrize("name", MIRRORED)
def test_quarter__gives_what_the_whole_surface_gives(name, profiles, monkeypatch):
    height, program, settings = MIRRORED[name]
    usual = {"times": 5, "tolerance": 1e-6, "numerics": rv.Numerics(time_step=0.05), "fields": FIELDS}
    given = {**usual, "progress": False, **settings}
    found = rv.simulate(height, ZENER, program, **given)
    monkeypatch.setattr("roughvisc.experiment.profile.is_mirrored", lambda height: False)
    whole = rv.simulate(height, ZENER, program, **given)
    assert [profile.mirrored for profile in profiles] == [True, False]
    if name == "grown":
        assert whole.sizes["x"] > height.sizes["x"]
    assert found.sizes == whole.sizes
    # the contact of each step is solved to 3e-8 in energy, 2e-4 in the norm of energy
    scales = dict.fromkeys(("gap", "displacement", "mean_gap"), float(whole.displacement.max()))
    for field in FIELDS:
        scale = scales.get(field, float(whole[field].max()))
        np.testing.assert_allclose(found[field], whole[field], rtol=0, atol=2e-4 * scale, err_msg=field)
    for figure in [
        "force",
        "approach",
        "work",
        "contact_area",
        "contact_area_counted",
        "contact_fraction",
        "mean_gap",
    ]:
        scale = scales.get(figure, float(whole[figure].max()))
        np.testing.assert_allclose(found[figure], whole[figure], rtol=0, atol=1e-6 * scale, err_msg=figure)
    for axis in (1, 2):
        assert np.array_equal(found.pressure, np.flip(found.pressure, axis))


def test_checkpoint__goes_on_with_a_quarter(tmp_path):
    """Interrupted and resumed, bit for bit."""
    study = tmp_path / "study.toml"
    study.write_text(
        '[surface]\ngenerate = "sphere"\nradius = "1 mm"\nsize = "0.4 mm"\nshape = [16, 18]\n'
        '[material]\nmodel = "zener"\nshear_modulus = "1 MPa"\nkelvin_modulus = "1 MPa"\nkelvin_viscosity = "1 MPa s"\n'
        '[[program]]\nload = "1 mN"\nover = "0.5 s"\n[[program]]\nload = "30 mN"\nover = "0.5 s"\n'
        "[keep]\ntimes = 9\n"
    )
    case = rv.read_study(study)
    whole = rv.run(case, tmp_path / "whole", progress=False)

    class Enough(Exception):
        pass

    def stop(now, end):
        if now > 0.6 * end:
            raise Enough

    with pytest.raises(Enough):
        rv.run(case, tmp_path / "part", progress=stop)
    resumed = rv.run(case, tmp_path / "part", progress=False)
    assert whole.sizes["x"] > 16, "it grew"
    for name in ("pressure", "gap", "approach", "iterations"):
        assert resumed[name].values.tobytes() == whole[name].values.tobytes(), name
