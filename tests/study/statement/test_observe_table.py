"""``[observe]``: what is derived from a result, and changes none."""

import tomllib

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
    ("text", "message"),
    [
        ('[observe.leakage]\nviscosity = "1 bar"\n', "observe.leakage.viscosity: found '1 bar', which is in bar"),
        ("[observe.leakage]\npressure_drop = 0\n", "observe.leakage.pressure_drop: found 0: expected a number in Pa"),
        ('[observe.leakage]\nalong = "z"\n', "observe.leakage.along: found 'z': expected 'x' or 'y'"),
        ("[observe.leakage]\nviscous = 1\n", "observe.leakage.viscous: unknown key; did you mean 'viscosity'?"),
        ("[observe.conductance]\n", "observe.conductance.resistivity: missing: expected a list of two"),
        ("[observe.conductance]\nresistivity = [1, -1]\n", "observe.conductance.resistivity: found [1, -1]: expected"),
        (
            '[observe.conductance]\nresistivity = ["1 ohm m", "1 K m/W"]\n',
            "observe.conductance.resistivity: found '1 K m/W', which is in",
        ),
        (
            '[keep]\nfields = ["displacement"]\n[observe.conductance]\nresistivity = [1, 0]\n',
            "observe.conductance: needs a field that is not kept: expected 'pressure' or 'gap'",
        ),
        ("[observe.leak]\n", "observe.leak: unknown key; did you mean 'leakage'?"),
        ("[observe]\nleakage = 1\n", "observe.leakage: found 1: expected a table"),
        (
            '[solve]\nboundary = "free"\n[observe.leakage]\nsides = "periodic"\n',
            "observe.leakage.sides: found 'periodic' where solve.boundary is 'free'",
        ),
        (
            '[keep]\nfields = ["pressure"]\n' + LEAKAGE,
            "observe.leakage: needs a field that is not kept",
        ),
        (LEAKAGE + '[sweep]\n"observe.leakage.viscosity" = [1, 2]\n', "observe.leakage.viscosity: cannot be varied"),
    ],
)
def test_wrong_tables__are_refused_by_name(study, text, message):
    path = study(text)
    assert tomllib.loads(path.read_text())
    with pytest.raises(InputError) as caught:
        read_cases(path)
    assert message in str(caught.value)
