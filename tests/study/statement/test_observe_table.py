"""``[observe]``: what is derived from a result, and changes none."""

import pytest

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.study.statement.case import Case, read_cases, read_study

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
    assert case.settings.observe.stated() == {"leakage": {"viscosity": 2e-3, "pressure_drop": 3e5, "along": "y"}}
    assert Case.from_json(case.to_json()).settings.observe == case.settings.observe


def test_conductance__is_read_in_si_and_knows_its_kind(study):
    found = [
        read_study(study(f"[observe.conductance]\nresistivity = {stated}\n")).settings.observe.stated()["conductance"]
        for stated in ('["5 m K/W", 0.5]', '["2 uohm cm", 0]', '[1, 2]\nkind = "electrical"')
    ]
    kinds = ("thermal", "electrical", "electrical")
    pairs = ((5.0, 0.5), (2e-8, 0.0), (1.0, 2.0))
    assert found == [{"resistivity": pair, "kind": kind} for pair, kind in zip(pairs, kinds, strict=True)]


def test_defaults__are_those_of_the_function(study):
    import inspect

    stated = read_study(study("[observe.leakage]\n")).settings.observe.stated()["leakage"]
    parameters = inspect.signature(rv.observables.leakage).parameters
    assert stated == {name: parameters[name].default for name in stated}


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
    with pytest.raises(InputError, match=key.replace(".", r"\.")):
        read_cases(study(text))
