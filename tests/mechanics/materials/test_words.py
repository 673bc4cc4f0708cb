"""What materials say of themselves: the call that builds them, in units that read well."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples, positive

import roughvisc as rv
from roughvisc.mechanics.materials.scaled import shifted
from roughvisc.units import quantity

UNITS = {"modulus": "Pa", "viscosity": "Pa s"}
ZENER = rv.zener(3e6, 1e6, 1e5)


@given(
    model=st.sampled_from([("elastic", 1), ("maxwell", 2), ("kelvin_voigt", 2), ("zener", 3)]),
    numbers=st.lists(positive, min_size=3, max_size=3),
    poisson=st.sampled_from([0.5, 0.25]),
)
@examples(20)
def test_repr__of_springs_and_dashpots_is_the_call_that_builds_it(model, numbers, poisson):
    name, count = model
    material = getattr(rv, name)(*numbers[:count], poisson)
    said, inside = re.fullmatch(r"(\w+)\((.*)\)", repr(material)).groups()
    parameters = dict(part.split("=") for part in inside.split(", "))
    assert said == name
    assert float(parameters.pop("poisson", 0.5)) == poisson
    assert list(parameters) == [one for one in getattr(rv, name).__annotations__ if one in parameters]
    found = [quantity(text, UNITS[key.split("_")[-1]]) for key, text in parameters.items()]
    assert found == pytest.approx(numbers[:count], rel=5e-6)


@pytest.mark.parametrize(
    ("material", "text"),
    [
        (ZENER, "zener(shear_modulus=3 MPa, kelvin_modulus=1 MPa, kelvin_viscosity=100 kPa s)"),
        (
            shifted(ZENER, 10.0),
            "zener(shear_modulus=3 MPa, kelvin_modulus=1 MPa, kelvin_viscosity=1 MPa s, "
            "note='all times multiplied by 10 (time-temperature shift)')",
        ),
        (rv.Prony(0, 1e-6), "Prony(glassy=0, fluidity=1 1/(MPa s))"),
        (
            rv.Prony(1e-6, 0, (1e-6, 2e-6), (0.1, 0.02), 0.3),
            "Prony(glassy=1 1/MPa, compliances=(1, 2) 1/MPa, times=(100, 20) ms, poisson=0.3)",
        ),
        (rv.PowerLaw(0, 1e-6, 0.5), "PowerLaw(glassy=0, coefficient=1 1/MPa, exponent=0.5, time_scale=1 s)"),
        (
            rv.Tabulated((1e-3, 1, 2, 3, 4), (1e-6, 2e-6, 3e-6, 4e-6, 4e-6)),
            "Tabulated(times=5 from 1 ms to 4 s, compliances=5 from 1 1/MPa to 4 1/MPa)",
        ),
        (rv.pair(rv.PowerLaw(0, 1e-6, 0.5), ZENER), f"pair({rv.PowerLaw(0, 1e-6, 0.5)!r}, {ZENER!r})"),
    ],
)
def test_repr__in_readable_units(material, text):
    assert repr(material) == text
