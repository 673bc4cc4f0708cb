"""A stiffer material: all moduli multiplied by one factor."""

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.mechanics.materials.creep import stiffened

MATERIALS = {
    "prony": rv.Prony(2e-7, fluidity=1e-8, compliances=(3e-7, 1e-7), times=(0.1, 3.0), poisson=0.4),
    "power_law": rv.power_law(1e-7, 2e-7, 0.3),
    "tabulated": rv.creep_table((0.0, 1.0, 10.0), (1e-7, 3e-7, 5e-7)),
    "pair": rv.pair(rv.zener(3e6, 1e6, 1e5), rv.elastic(1e7)),
    "own": rv.creep(lambda t: 1e-6 * (1 + np.sqrt(t)), poisson=0.3),
    "mixed pair": rv.pair(rv.power_law(1e-7, 2e-7, 0.3), rv.elastic(1e7)),
    "bulk": rv.from_relaxation(0.0, [1e6], [0.1], bulk_modulus=1e9),
}


@pytest.mark.parametrize("name", MATERIALS)
def test_stiffened__divides_every_compliance(name):
    material, times = MATERIALS[name], np.array([0.0, 0.03, 0.7, 9.0])
    harder = stiffened(material, 1.7)
    np.testing.assert_allclose(harder.contact_compliance(times), material.contact_compliance(times) / 1.7, rtol=1e-12)
    np.testing.assert_allclose(harder.contact_integral(times), material.contact_integral(times) / 1.7, rtol=1e-12)
    assert harder.poisson == material.poisson
    assert "all moduli multiplied by 1.7" in harder.note


@pytest.mark.parametrize("factor", [0.0, -1.0, float("nan"), float("inf"), "2"])
def test_stiffened__refuses_what_is_no_positive_number(factor):
    with pytest.raises(InputError, match="modulus_factor"):
        stiffened(MATERIALS["prony"], factor)
