"""A tapered surface: its nominal area, its contact fraction, what the audit says, held against the same untapered."""

import numpy as np
import pytest
from support import friction_whole, run_whole, simulate_whole

import roughvisc as rv
from roughvisc.observables.area_theories import nominal_area_of
from roughvisc.study.cost.estimate import coarse
from roughvisc.study.storage.store import whole_result
from roughvisc.topography.grid import nominal_area

SIZE, SHAPE = (1e-3, 9e-4), (80, 72)
RUBBER = rv.elastic(1e6)
OPTIONS = {"boundary": "periodic", "tolerance": 1e-3, "times": [0], "fields": ["pressure"], "progress": False}


def rough(seed):
    return rv.self_affine(SIZE, SHAPE, hurst=0.8, rms_slope=0.1, rolloff=2e-4, shortcut=5e-5, seed=seed)


def pressed(h, pressure):
    return simulate_whole(h, RUBBER, rv.Program().pressure(pressure, over=0), **OPTIONS)


def weights(margin):
    """Raised cosine over a margin of each side: the definition, cell by cell."""
    along = []
    for size, n in zip(SIZE, SHAPE, strict=True):
        at = (np.arange(n) + 0.5) * size / n
        from_border = np.minimum(at, size - at)
        along.append(np.where(from_border < margin, (1 - np.cos(np.pi * from_border / margin)) / 2, 1.0))
    return np.outer(*along)


def test_pressure__counts_the_area_that_was_not_tapered():
    """The integral of the weight: a margin counts by half."""
    ds = pressed(rv.taper(rough(1), 1e-4), 2e4)
    area = (1e-3 - 1e-4) * (9e-4 - 1e-4)
    assert float(ds.force[0]) == pytest.approx(2e4 * area, rel=1e-12)
    assert float(ds.nominal_pressure[0]) == pytest.approx(2e4, rel=1e-12)
    for found in (nominal_area(ds["height"]), nominal_area_of(ds.drop_vars(["taper_x", "taper_y"]))):
        np.testing.assert_allclose(found, area, rtol=1e-12)


@pytest.mark.parametrize("mirror", [False, True])
def test_contact_fraction__weighs_each_cell_by_the_taper(mirror):
    """Of a mirrored surface a quarter is solved: the weights are those of its cells."""
    h, expected = rv.taper(rough(2), 1.5e-4), weights(1.5e-4)
    if mirror:
        h, expected = rv.mirror(h), np.pad(expected, [(0, n) for n in SHAPE], mode="symmetric")
    ds = pressed(h, 3e4)
    contact = ds.pressure.values[0] > 0
    corrected = float(ds.contact_area[0] / ds.contact_area_counted[0])
    weighted = corrected * (contact * expected).sum() / expected.sum()
    assert float(ds.contact_fraction[0]) == pytest.approx(weighted, rel=1e-9)
    assert 0.1 < contact.mean() < 0.9


@pytest.mark.parametrize(("margin", "off"), [(0.03, 0.08), (0.1, 0.17)])
def test_contact_fraction__is_that_of_the_surface_before_the_taper(margin, off):
    """The surface repeats by itself, so that its contact without a taper is the true one; the grid's share is not."""
    ratios = []
    for h in map(rough, range(4)):
        ds = pressed(rv.taper(h, [margin * side for side in SIZE]), 2e4)
        true = float(pressed(h, 2e4).contact_fraction[0])
        ratios.append([float(ds.contact_fraction[0]) / true, float(ds.contact_area[0]) / np.prod(SIZE) / true])
    weighted, of_grid = np.mean(ratios, axis=0)
    assert weighted == pytest.approx(1, abs=0.03)
    assert of_grid == pytest.approx(1 - off, abs=0.02)


@pytest.mark.parametrize(
    ("margin", "verdict"), [(0.029, "holds"), (0.03, "doubtful"), (0.099, "doubtful"), (0.1, "broken"), (0.2, "broken")]
)
def test_audit__judges_a_taper_by_its_margin(margin, verdict):
    h = rv.taper(rough(1), (margin * 1e-3, 0.01 * 9e-4))
    for surface in (h, rv.mirror(h)):
        found = rv.audit(pressed(surface, 2e4))
        assert found["window"].number == pytest.approx(margin, rel=0.05)
        assert found["window"].verdict == verdict
        assert found["border"].verdict == "holds"
        assert ("mirror" in found["window"].sentence) == (verdict != "holds")


def test_audit__says_nothing_of_a_taper_where_there_is_none():
    assert "window" not in [one.name for one in rv.audit(pressed(rough(1), 2e4))]


def test_taper__is_known_of_a_stored_result_and_before_the_run(tmp_path):
    study = tmp_path / "study.toml"
    study.write_text(
        """title = "tapered"
[surface]
generate = "self_affine"
size = ["1 mm", "0.9 mm"]
shape = [40, 36]
hurst = 0.8
rms_slope = 0.1
seed = 1
taper = ["50 um", "90 um"]
[material]
model = "elastic"
shear_modulus = "1 MPa"
[[program]]
pressure = "20 kPa"
over = 0
[solve]
boundary = "periodic"
"""
    )
    case = rv.read_study(study)
    assert rv.audit(case)["window"].number == 0.1
    height = case.height()
    assert float(rv.plan(study).nominal_pressure[0]) == pytest.approx(2e4)
    np.testing.assert_allclose(nominal_area(coarse(height, 20)), 0.95e-3 * 8.1e-4, rtol=5e-3)
    run_whole(case, tmp_path / "out", progress=False)
    stored = whole_result(next((tmp_path / "out").glob("*.nc")))
    assert float(stored.force[-1]) == pytest.approx(2e4 * 0.95e-3 * 8.1e-4, rel=1e-3)
    assert rv.audit(stored)["window"].verdict == "broken"
    assert float(rv.open_results(tmp_path / "out").force[0, -1]) == float(stored.force[-1])
    np.testing.assert_array_equal(stored["taper_x"], height["taper_x"])


def test_friction__slides_under_the_nominal_pressure_of_the_rest():
    h = rv.taper(rough(1).isel(x=slice(0, 40), y=slice(0, 36)), (5e-5, 4.5e-5))
    rubber = rv.zener(3e6, 1e6, 1e5)
    ds = friction_whole(h, rubber, pressure=2e4, speeds=[1e-4], fields=("pressure",), tolerance=1e-2, progress=False)
    weight = np.outer(ds.taper_x, ds.taper_y)
    np.testing.assert_allclose(ds.force, 2e4 * 0.81 * 5e-4 * 4.5e-4, rtol=1e-3)
    contact = ds.pressure.values[0] > 0
    corrected = float(ds.contact_area[0] / ds.contact_area_counted[0])
    assert float(ds.contact_fraction[0]) == pytest.approx(corrected * (contact * weight).sum() / weight.sum(), rel=1e-9)


def test_history__has_an_axis_of_the_fraction_only_where_area_and_fraction_are_proportional():
    for h, shown in ((rough(1), True), (rv.taper(rough(1), 1e-4), False)):
        ds = simulate_whole(h, RUBBER, rv.Program().pressure(4e4, over=1), **OPTIONS | {"times": [0.1, 0.5, 1]})
        labels = [child.get_ylabel().replace("\n", " ") for ax in rv.plot.history(ds).axes for child in ax.child_axes]
        assert ("of nominal [%]" in labels) == shown
