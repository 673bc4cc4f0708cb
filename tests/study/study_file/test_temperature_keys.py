"""Temperature of a material in a study: the shift that it gives, and what is refused."""

from pathlib import Path

import pytest
from support import refused

import roughvisc as rv
from roughvisc.study.case import Case, read_cases, vary
from roughvisc.study.si_tables import unit_of

WORKFLOWS = Path(__file__).parents[3] / "workflows"
WLF = {"temperature": "30 degC", "reference_temperature": 293.15, "wlf_c1": 8.0, "wlf_c2": "90 K"}
ARRHENIUS = {"temperature": 303.15, "reference_temperature": "20 °C", "activation_energy": "80 kJ/mol"}


@pytest.fixture
def case():
    return rv.read_study(WORKFLOWS / "quickstart.toml")


def at(case, table, where="material"):
    return vary(case, {f"{where}.{key}": value for key, value in table.items()})


def test_temperature__wlf_arrhenius_and_their_factor_state_the_same(case):
    # 10 K above the reference: log10 a = -8 * 10 / 100; the series is that of a Zener solid of 0.1 s
    warm = at(case, WLF)
    assert warm.material.times == pytest.approx((0.1 * 10**-0.8,))
    assert at(case, {"shift_factor": 10**-0.8}).material.times == pytest.approx(warm.material.times)
    assert warm.key != case.key
    assert at(case, ARRHENIUS).material.times == pytest.approx((0.1 * rv.arrhenius(303.15, 293.15, 8e4),))
    again = Case.from_json(warm.to_json())
    assert (again.key, again.material) == (warm.key, warm.material)


def test_temperature__at_the_reference_is_the_material_without(case):
    assert at(case, {**WLF, "temperature": "20 degC"}).material == case.material
    assert at(case, {"shift_factor": 1}).material == case.material


def test_temperature__both_bodies_of_a_pair_or_one(case):
    steel = {"model": "elastic", "shear_modulus": 8e10}
    rubber = {"model": "maxwell", "shear_modulus": 1e6, "viscosity": 1e6}
    two = vary(case, {"material": {"model": "pair", "a": steel, "b": rubber}})
    both, one = at(two, WLF), at(two, WLF, "material.b")
    assert both.material == one.material != two.material
    assert both.material.fluidity == pytest.approx(two.material.fluidity * 10**0.8)


def test_temperature__sweeps_and_its_axis_has_a_unit(tmp_path):
    text = (WORKFLOWS / "quickstart.toml").read_text().replace("../surfaces", str(WORKFLOWS.parent / "surfaces"))
    law = 'reference_temperature = "20 degC"\nactivation_energy = "80 kJ/mol"\n'
    study = tmp_path / "warm.toml"
    swept = '\n[sweep]\n"material.temperature" = ["0 degC", "20 degC", "40 degC"]\n'
    study.write_text(text.replace('model = "zener"\n', f'model = "zener"\n{law}') + swept)
    cold, room, hot = read_cases(study)
    assert [one.varied["material.temperature"] for one in (cold, room, hot)] == [273.15, 293.15, 313.15]
    assert cold.material.times > room.material.times > hot.material.times
    assert room.material == rv.read_study(WORKFLOWS / "quickstart.toml").material
    assert unit_of("material.temperature") == "K"


@pytest.mark.parametrize(
    ("table", "key"),
    [
        ({"temperature": 300}, "material.reference_temperature"),
        ({"wlf_c1": 3}, "material.temperature"),
        ({"temperature": 300, "reference_temperature": 290}, "material.wlf_c1"),
        ({**WLF, "wlf_c2": "90 degC"}, "material.wlf_c2"),
        ({**WLF, "activation_energy": 8e4}, "material.activation_energy"),
        ({**WLF, "temperature": "-75 degC"}, "material.temperature"),
        ({**ARRHENIUS, "temperature": 25}, "material.temperature"),
        ({**ARRHENIUS, "shift_factor": 2}, "material.shift_factor"),
        ({"shift_factor": -2}, "material.shift_factor"),
        ({"temperatur": 300}, "material.temperatur"),
    ],
)
def test_temperature__is_refused_at_the_key(case, table, key):
    with refused(key):
        at(case, table)
