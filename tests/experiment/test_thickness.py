"""A sheet on a rigid base, from the study to the result: against the integral equation, and what is refused."""

import math

import numpy as np
import pytest
from support import BALL, refused

import roughvisc as rv
from roughvisc.mechanics.sheet import Sheet
from roughvisc.study.case import Case, read_cases

RADIUS, THICKNESS = 1e-3, 1e-4


def pressed(height, material, program, *, thickness=THICKNESS, base="bonded", **settings):
    return rv.simulate(height, rv.sheet(material, thickness, base), program, progress=False, **settings)


@pytest.mark.parametrize(
    ("poisson", "base", "control"), [(0.3, "bonded", "load"), (0.5, "bonded", "load"), (0.5, "slipping", "approach")]
)
def test_wave_in_full_contact__has_the_pressure_of_its_symbol(poisson, base, control):
    side, amplitude, cells = 1e-3, 1e-6, (15, 12)
    sheet, q = Sheet(THICKNESS, poisson, base), 2 * math.pi / 1e-3
    wave = rv.wavy(amplitude, side, side, cells, waves=1)
    modulus = 2e6 / (1 - poisson)
    crest = modulus * amplitude / float(sheet.transfer(q, 0.0))
    # the mean of the gap is zero: the highest cell has sunk by its height and by the sheet's compression
    sunk = float(wave.max()) + 3 * crest / modulus * float(sheet.transfer(0.0, 0.0))
    load = 3 * crest * side**2
    program = getattr(rv.Program(), control)(load if control == "load" else sunk, over=0)
    ds = pressed(wave, rv.elastic(1e6, poisson), program, base=base, boundary="periodic", tolerance=1e-4)
    expected = 3 * crest + crest * np.cos(q * ds.x.values)[:, None] * np.ones(cells[1])
    np.testing.assert_allclose(ds.pressure[0], expected, rtol=1e-5)
    assert float(ds.approach[0]) == pytest.approx(sunk, rel=1e-3)
    assert float(ds.force[0]) == pytest.approx(load, rel=1e-5)


# --------------------------------------------------------------------------------------------------------------
# studies

STUDY = BALL.replace("[[program]]", 'thickness = "0.1 mm"\nbase = "slipping"\n[[program]]', 1)


@pytest.fixture
def case(tmp_path):
    path = tmp_path / "gel.toml"
    path.write_text(STUDY)
    return read_cases(path)[0]


def test_study__presses_the_sheet_that_it_states(case, tmp_path):
    assert case.body.kernel == Sheet(1e-4, 0.5, "slipping")
    ds = rv.run(case, out=tmp_path / "out", progress=False)
    assert ds.attrs["thickness"] == 1e-4
    assert "kernel" not in ds.attrs
    same = pressed(case.height(), case.material, case.program, base="slipping", times=[0, 0.1, 0.2], boundary="free")
    np.testing.assert_array_equal(ds.pressure, same.pressure)
    assert Case.from_json(ds.attrs["case"]).body == case.body


def test_sheet_thinner_than_a_fiftieth_of_its_cells__is_refused_in_free_space(tmp_path, invoke):
    thickness, load = 1e-3 / 21 / 51, rv.Program().load(1e-3, over=0)
    ball = rv.sphere(RADIUS, 1e-3, (24, 21))
    with pytest.raises(rv.InputError, match="51 times the thickness: expected cells of at most 50"):
        pressed(ball, rv.elastic(1e6), load, thickness=thickness)
    assert float(pressed(ball, rv.elastic(1e6), load, thickness=thickness, boundary="periodic").force[0]) > 0
    study = tmp_path / "gel.toml"
    study.write_text(STUDY.replace('"0.1 mm"', f"{thickness}"))
    status, _, wrong = invoke("run", "--out", tmp_path / "out", "--no-plots", study)
    assert status == 2
    assert "51 times the thickness" in " ".join(wrong.split())
    assert not list(tmp_path.glob("out/*.nc"))


def test_python__refuses(case):
    load = rv.Program().load(1e-3, over=0)
    thick = rv.Body(rv.elastic(1e6), Sheet(1.0))
    with refused("material", thick):
        pressed(case.height(), thick, load)
    with refused("kernel", 1e-4):
        rv.Body(rv.elastic(1e6), 1e-4)
    for two in (rv.pair(rv.elastic(1e6), rv.elastic(2e6)), rv.pair(rv.power_law(1e-7, 1e-6, 0.3), rv.elastic(1e9))):
        with pytest.raises(rv.InputError, match="a pair of bodies"):
            pressed(case.height(), two, load)
    with refused("material"):
        pressed(case.height(), rv.from_relaxation(5e5, [5e5], [0.05], bulk_modulus=1e9), load)
