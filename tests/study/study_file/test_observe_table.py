"""``[observe]``: what is derived from a result, and changes none."""

import pytest
from support import refused

from roughvisc.study.case import Case, read_cases, read_study

STUDY = """
[surface]
generate = "wavy"
amplitude = "1 um"
wavelength = "0.5 mm"
size = "1 mm"
shape = 16
[material]
model = "elastic"
shear_modulus = "1 MPa"
[[program]]
load = "1 mN"
over = 0
"""
LEAKAGE = '[observe.leakage]\nviscosity = "2 mPa s"\npressure_drop = "3 bar"\nalong = "y"\n'


@pytest.fixture
def study(tmp_path):
    def written(text):
        path = tmp_path / "study.toml"
        path.write_text(STUDY + text)
        return path

    return written


def test_leakage__is_read_in_si(study):
    case = read_study(study(LEAKAGE))
    assert case.observed == {"leakage": {"viscosity": 2e-3, "pressure_drop": 3e5, "along": "y"}}
    assert Case.from_json(case.to_json()).observed == case.observed


@pytest.mark.parametrize("stated", ['["5 m K/W", 0.5]', '["2 uohm cm", 0]', '[1, 2]\nkind = "electrical"'])
def test_conductance__is_accepted_with_numbers_or_units(study, stated):
    case = read_study(study(f"[observe.conductance]\nresistivity = {stated}\n"))
    assert len(case.observed["conductance"]["resistivity"]) == 2


def test_key__does_not_know_what_is_observed(study):
    plain = read_study(study(""))
    assert plain.key == read_study(study(LEAKAGE)).key == read_study(study("[observe]\n")).key
    assert "observe" not in plain.to_json()


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ('[observe.leakage]\nviscosity = "1 bar"\n', "observe.leakage.viscosity"),
        ("[observe.leakage]\npressure_drop = 0\n", "observe.leakage.pressure_drop"),
        ('[observe.leakage]\nalong = "z"\n', "observe.leakage.along"),
        ("[observe.leakage]\nviscous = 1\n", "observe.leakage.viscous"),
        ("[observe.conductance]\n", "observe.conductance.resistivity"),
        ('[observe.conductance]\nresistivity = ["1 ohm m", "1 K m/W"]\n', "observe.conductance.resistivity"),
        ('[keep]\nfields = ["pressure"]\n' + LEAKAGE, "observe.leakage"),
        ("[observe.leak]\n", "observe.leak"),
        ("[observe]\nleakage = 1\n", "observe.leakage"),
        ('[solve]\nboundary = "free"\n[observe.leakage]\nsides = "periodic"\n', "observe.leakage.sides"),
        (LEAKAGE + '[sweep]\n"observe.leakage.viscosity" = [1, 2]\n', "observe.leakage.viscosity"),
    ],
)
def test_observe__is_refused_at_the_key(study, text, key):
    with refused(key):
        read_cases(study(text))
