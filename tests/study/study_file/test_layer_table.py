"""``[material.on]`` in a study: the body that it makes, what it refuses, and what identifies its case."""

import pytest
from samples import RUBBER
from support import BALL, refused

import roughvisc as rv
from roughvisc.study.case import read_cases, read_study
from roughvisc.study.si_tables import unit_of

START, END = BALL.index("[material]"), BALL.index("[[program]]")
LAYER = """
[material]
model = "elastic"
shear_modulus = "1 GPa"
poisson = 0.35
thickness = "20 um"
[material.on]
model = "zener"
shear_modulus = "3 MPa"
kelvin_modulus = "1 MPa"
kelvin_viscosity = "0.1 MPa s"
"""


@pytest.fixture
def read(tmp_path):
    def one(material, rest=""):
        (tmp_path / "coat.toml").write_text(f"{BALL[:START]}{material}\n{BALL[END:]}\n{rest}")
        return tmp_path / "coat.toml"

    return one


def test_on__makes_a_layer(read):
    assert read_study(read(LAYER)).body == rv.layer(rv.elastic(1e9, poisson=0.35), 2e-5, on=RUBBER)


def test_on__nests(read):
    below = '\nthickness = "1 mm"\n[material.on.on]\nmodel = "elastic"\nshear_modulus = "80 GPa"\npoisson = 0.3\n'
    expected = rv.layer(RUBBER, 1e-3, on=rv.elastic(80e9, poisson=0.3))
    assert read_study(read(LAYER + below)).body == rv.layer(rv.elastic(1e9, poisson=0.35), 2e-5, on=expected)


def test_on__counts_for_the_key_of_a_case(read):
    first = read_study(read(LAYER)).key
    assert read_study(read(LAYER.replace('"3 MPa"', "3e6"))).key == first
    assert read_study(read(LAYER.replace('"3 MPa"', '"4 MPa"'))).key != first
    endless = read_study(read(LAYER.replace('"20 um"', "inf")))
    assert endless.body == rv.Body(rv.elastic(1e9, poisson=0.35))


def test_on__is_swept(read):
    sweep = '[sweep]\n"material.on.shear_modulus" = ["1 MPa", "2 MPa"]\n"material.thickness" = ["10 um", inf]\n'
    cases = read_cases(read(LAYER, sweep))
    bases = [one.body.materials[1] for one in list(cases)[::2]]
    assert [float(base.creep_compliance(0.0)) for base in bases] == pytest.approx([1e-6, 5e-7])
    assert unit_of("material.on.shear_modulus") == "Pa"
    assert unit_of("material.on.on.thickness") == "m"


@pytest.mark.parametrize(
    ("material", "key"),
    [
        (LAYER.replace('thickness = "20 um"', ""), "material.thickness"),
        (LAYER.replace('thickness = "20 um"', 'thickness = "20 um"\nbase = "bonded"'), "material.base"),
        (LAYER.replace('"zener"', '"zenner"'), "material.on.model"),
        (LAYER.replace('"zener"', '"pair"'), "material.on.shear_modulus"),
        (LAYER + 'thickness = "1 mm"\n', "material.on"),
        (LAYER + "poisson = -0.2\n", "material.on"),
        (LAYER.replace("poisson = 0.35", "poisson = -0.1"), "material"),
        (LAYER + 'viscosity = "1 Pa s"\n', "material.on.viscosity"),
    ],
)
def test_on__is_refused_at_the_key(read, material, key):
    with refused(key):
        read_study(read(material))
