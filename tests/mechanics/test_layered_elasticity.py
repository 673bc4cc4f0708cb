"""The response of layers, against the equations of elasticity integrated through the depth at high precision."""

import numpy as np
import pytest
from references.layered import elastic_factor

from roughvisc.mechanics.layer import effective_compliance

X = np.array([1e-6, 1e-3, 0.05, 0.4, 1.5, 6.0])


@pytest.mark.parametrize(
    ("poissons", "moduli"),
    [
        ((0.5, 0.3, 0.4), (1.0, 50.0, 0.2)),
        ((0.0, 0.5, 0.5), (1.0, 0.02, 7.0)),
        ((0.5, 0.45, 0.0), (1.0, 3 + 4j, 0.5 + 0.1j)),
        ((0.3, 0.5, 0.2, 0.5), (1.0, 100.0, 0.01, 30 - 20j)),
    ],
)
def test_effective_compliance__of_several_layers_solves_the_equations_of_elasticity(poissons, moduli):
    thicknesses = (1.0, 0.3, 2.0)[: len(poissons) - 1]
    found = effective_compliance(X, thicknesses, poissons, [1 / one for one in moduli]) / ((1 - poissons[0]) / 2)
    exact = [complex(elastic_factor([x * h for h in thicknesses], poissons, moduli)) for x in X]
    np.testing.assert_allclose(found, exact, rtol=1e-11)


@pytest.mark.parametrize("ratio", [1e-3, 0.1, 1.0, 10.0, 1e3, 0.3 + 0.5j])
@pytest.mark.parametrize(("poisson", "base_poisson"), [(0.0, 0.5), (0.3, 0.3), (0.5, 0.2), (0.5, 0.5)])
def test_effective_compliance__of_one_layer_is_the_published_one(ratio, poisson, base_poisson):
    """T. C. O'Sullivan, R. B. King, J. Tribol. 110 (1988) 235; Burmister (1945) if both materials keep their volume."""
    x, k, base_k = np.geomspace(0.05, 60, 40), 3 - 4 * poisson, 3 - 4 * base_poisson
    l, m, e = (ratio * base_k - k) / (ratio * base_k + 1), (ratio - 1) / (ratio + k), np.exp(-2 * x)
    published = (1 + 4 * m * x * e - l * m * e**2) / (1 - (l + m + 4 * m * x**2) * e + l * m * e**2)
    found = effective_compliance(x, (1.0,), (poisson, base_poisson), (1.0, ratio)) / ((1 - poisson) / 2)
    np.testing.assert_allclose(found, published, rtol=1e-9)
