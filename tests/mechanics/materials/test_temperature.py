"""Shifted and stiffer materials: creep at another temperature is creep at shifted times."""

import numpy as np
import pytest
from samples import OF_EACH_KIND
from support import refused

import roughvisc as rv
from roughvisc.mechanics.materials.material import stiffened

ELASTIC = OF_EACH_KIND["elastic"]
GAS_CONSTANT = 8.31446261815324  # CODATA 2018, J/(mol K)


def test_wlf__loses_half_its_first_constant_at_the_second():
    # T - Tr = c2: log10 a = -c1 c2 / (2 c2)
    assert rv.wlf(300.0 + 51.6, 300.0, 17.44, 51.6) == pytest.approx(10 ** (-17.44 / 2), rel=1e-13)
    # halfway to the pole: T - Tr = -c2/2
    assert rv.wlf(300.0 - 20.0, 300.0, 3.0, 40.0) == pytest.approx(1e3, rel=1e-13)


def test_arrhenius__slope_over_the_inverse_temperature_is_the_activation_energy():
    inverse = np.array([1 / 250, 1 / 300, 1 / 400])
    logarithms = np.log([rv.arrhenius(1 / one, 300.0, 6e4) for one in inverse])
    assert np.diff(logarithms) / np.diff(inverse) * GAS_CONSTANT == pytest.approx(6e4, rel=1e-9)
    assert logarithms[1] == 0
    assert logarithms[0] > 0 > logarithms[2]  # the cold is slow


@pytest.mark.parametrize("material", OF_EACH_KIND.values(), ids=OF_EACH_KIND)
@pytest.mark.parametrize("factor", [1e-3, 40.0])
def test_scaled__is_the_material_in_reduced_time_or_stiffer(material, factor):
    t = np.array([0.0, 1e-3, 0.4, 6.0, 500.0])
    compliance, integral = material.contact_compliance(t), material.contact_integral(t)
    moved, harder = rv.shift(material, factor), stiffened(material, factor)
    assert moved.contact_compliance(factor * t) == pytest.approx(compliance, rel=1e-13)
    assert moved.contact_integral(factor * t) == pytest.approx(factor * integral, rel=1e-12, abs=0)
    assert harder.contact_compliance(t) == pytest.approx(compliance / factor, rel=1e-12, abs=0)
    assert harder.contact_integral(t) == pytest.approx(integral / factor, rel=1e-12, abs=0)
    assert f"{factor:g} (time-temperature shift)" in moved.note
    assert f"all moduli multiplied by {factor:g}" in harder.note
    assert moved.poisson == harder.poisson == material.poisson
    assert rv.shift(moved, 1 / factor).contact_compliance(t) == pytest.approx(compliance)


@pytest.mark.parametrize("law", [{"wlf_c1": 8.0, "wlf_c2": "90 K"}, {"activation_energy": "80 kJ/mol"}])
def test_material_at_a_temperature__is_the_shifted_material(law):
    """From any temperature on, alone or in a pair with an elastic body, and stiffened."""
    rubber, steel = rv.zener(3e6, 1e6, 1e5), rv.elastic(80e9, 0.3)
    factor = (rv.wlf if "wlf_c1" in law else rv.arrhenius)(313.15, 293.15, **law)
    changing = rv.thermal(rubber, "20 degC", **law)
    assert changing == rubber == changing.at("20 degC")
    assert changing.at("40 degC") == changing.at(250.0).at("40 degC") == rv.shift(rubber, factor)
    assert stiffened(changing, 2.0).at("40 degC") == stiffened(rv.shift(rubber, factor), 2.0)
    assert rv.pair(steel, changing).at("40 degC") == rv.pair(steel, rv.shift(rubber, factor))
    creep = rv.creep(rubber.creep_compliance)
    assert rv.pair(rv.thermal(creep, 293.15, **law), steel).at(313.15).contact_compliance(1e-3) == pytest.approx(
        rv.pair(rv.shift(rubber, factor), steel).contact_compliance(1e-3)
    )


def test_shifted__a_table_ends_later_in_the_cold():
    cold = rv.shift(rv.creep_table((0.0, 1.0, 700.0), (1e-7, 2e-7, 8e-7), kind="shear"), 10.0)
    assert cold.contact_compliance(7000.0) == pytest.approx(8e-7 / 4)
    with pytest.raises(rv.InputError, match="table ends at 7000 s"):
        cold.contact_compliance(7001.0)


@pytest.mark.parametrize(
    ("wrong", "key"),
    [
        (lambda: rv.wlf(248.0, 300.0, 17.44, 51.6), "temperature"),
        (lambda: rv.wlf(300.0, 300.0, -1.0, 51.6), "wlf_c1"),
        (lambda: rv.arrhenius(-3.0, 300.0, 1e4), "temperature"),
        (lambda: rv.shift(ELASTIC, 0.0), "factor"),
        (lambda: ELASTIC.at(300.0), "material"),
        (lambda: rv.pair(rv.thermal(ELASTIC, 300.0, activation_energy=1e4), rv.maxwell(1, 1)).at(310.0), "material"),
        (lambda: rv.thermal(ELASTIC, 300.0, wlf_c1=3.0), "wlf_c2"),
        (lambda: rv.thermal(ELASTIC, 300.0, wlf_c1=3.0, activation_energy=1e4), "wlf_c1"),
        (lambda: rv.thermal(ELASTIC, 300.0, wlf_c1=3.0, wlf_c2=40.0).at("-20 degC"), "temperature"),
        (lambda: rv.thermal(ELASTIC, 300.0, activation_energy=9e5).at("1 K"), "temperature"),
        (lambda: rv.shift(ELASTIC, np.nan), "factor"),
        (lambda: rv.shift(ELASTIC, "2 K"), "factor"),
        (lambda: rv.shift(3.0, 2.0), "material"),
        (lambda: stiffened(ELASTIC, 0.0), "modulus_factor"),
        (lambda: stiffened(ELASTIC, np.inf), "modulus_factor"),
    ],
)
def test_scaling__refuses_at_the_argument(wrong, key):
    with refused(key):
        wrong()
