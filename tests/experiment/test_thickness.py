"""A sheet on a rigid base, from the study to the result: against the integral equation, and what is refused."""

import math

import numpy as np
import pytest
from support import BALL, refused

import roughvisc as rv
from roughvisc.mechanics.sheet import Sheet
from roughvisc.study.case import Case

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


def test_study__presses_the_sheet_that_it_states(study, tmp_path):
    (case,) = study(STUDY)
    assert case.body.kernel == Sheet(1e-4, 0.5, "slipping")
    ds = rv.run(case, out=tmp_path / "out", progress=False)
    assert ds.attrs["thickness"] == 1e-4
    same = pressed(case.height(), case.material, case.program, base="slipping", times=[0, 0.1, 0.2], boundary="free")
    np.testing.assert_array_equal(ds.pressure, same.pressure)
    assert Case.from_json(ds.attrs["case"]).body == case.body


@pytest.mark.parametrize("base", ["bonded", "slipping"])
@pytest.mark.parametrize("poisson", [0.5, 0.3])
def test_sheet_far_thinner_than_its_cells__is_a_squeeze_film_or_springs(poisson, base):
    """Johnson, section 5.8: ``u = -h^3 / (3 G) laplacian p`` if bonded and incompressible, otherwise ``u ~ p``."""
    shear, radius, wide, cells = 1e6, 1e-3, 7e-5, 45
    h = 2e-4 / cells / 1000
    depth, force = wide**2 / (4 * radius), math.pi * shear * wide**6 / (32 * radius * h**3)
    if base == "slipping" or poisson < 0.5:
        drained = (1 - poisson) / (1 - 2 * poisson) if base == "bonded" else 1 / (1 - poisson)
        depth, force = wide**2 / (2 * radius), math.pi * wide**4 / (4 * radius) * 2 * shear * drained / h
    program = rv.Program().load(force, over=0)
    ds = pressed(rv.sphere(radius, 2e-4, cells), rv.elastic(shear, poisson), program, base=base, thickness=h)
    assert float(ds.approach[-1]) == pytest.approx(depth, rel=1e-3)


def test_python__refuses():
    load, ball = rv.Program().load(1e-3, over=0), rv.sphere(RADIUS, 2e-4, 9)
    thick = rv.Body(rv.elastic(1e6), Sheet(1.0))
    with refused("material", thick):
        pressed(ball, thick, load)
    with refused("kernel", 1e-4):
        rv.Body(rv.elastic(1e6), 1e-4)
    for two in (rv.pair(rv.elastic(1e6), rv.elastic(2e6)), rv.pair(rv.power_law(1e-7, 1e-6, 0.3), rv.elastic(1e9))):
        with pytest.raises(rv.InputError, match="a pair of bodies"):
            pressed(ball, two, load)
    with refused("material"):
        pressed(ball, rv.from_relaxation(5e5, [5e5], [0.05], bulk_modulus=1e9), load)
