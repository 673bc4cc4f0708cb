"""Creep of each wave on a layered body, and the series that stands for it."""

import numpy as np
import pytest
from samples import COMPRESSIBLE as RUBBER
from samples import POLYMER

import roughvisc as rv
from roughvisc.mechanics.layer import crept, layer_series
from roughvisc.mechanics.memory import choose_memory

FLUID, SOFT = rv.maxwell(1e6, 1e5), rv.kelvin_voigt(1e6, 1e5)


@pytest.mark.parametrize(
    "body",
    [
        rv.layer(rv.elastic(1e9), 1e-4, on=RUBBER),
        rv.layer(RUBBER, 1e-4, on=rv.elastic(1e9)),
        rv.layer(FLUID, 1e-4, on=POLYMER),
        rv.layer(rv.elastic(1e7), 1e-4, on=FLUID),
        rv.layer(RUBBER, 1e-4, on=SOFT),
        rv.layer(RUBBER, 1e-5, on=rv.layer(POLYMER, 1e-3, on=RUBBER)),
    ],
    ids=repr,
)
def test_layer_series__is_as_near_as_it_says_and_has_no_negative_term(body):
    """At waves that are long compared with the thickest layer, short compared with the thinnest, and between."""
    found = layer_series(body, 1e-5, 1.0, 1e-3)
    assert found.error <= 1e-3
    assert (found.compliances >= 0).all()
    q, t = np.exp(np.random.default_rng(1).uniform(np.log(1e2), np.log(3e6), 40)), np.geomspace(1.3e-5, 0.9, 23)
    *terms, at_once = (found.kernel(one).transfer(q, 0.0) * q / 2 for one in np.eye(len(found.compliances)))
    series = np.transpose([*terms, at_once]) @ crept(found.times, t).T
    true = np.abs(series / body.creep(q, t) - 1).max()
    assert true < 1.2e-3
    assert found.error < 10 * true
    np.testing.assert_allclose(at_once, body.at_once(q), rtol=1e-3, atol=1e-3 * series[:, 0].min())


def test_layers_below_one_that_is_rigid_at_first__have_no_instantaneous_influence():
    q = np.geomspace(1e-3, 1e6, 100)
    soft, hard = (rv.layer(RUBBER, 1e-4, on=rv.layer(SOFT, 5e-5, on=rv.elastic(one))).at_once(q) for one in (1e2, 1e9))
    np.testing.assert_allclose(soft, hard, rtol=1e-12)
    assert (rv.layer(SOFT, 1e-4, on=RUBBER).at_once(q) == 0).all()


def test_layer_of_a_material_that_is_not_passive__says_so_and_has_few_terms():
    layered = rv.layer(rv.creep(lambda t: 1e-6 * (1 + 9 * t**4 / (1 + t**4))), 1e-5, on=rv.elastic(1e6))
    memory = choose_memory(layered, 10.0, 1e-3, 1e-3)
    assert memory.note.endswith("the material is not passive")
    assert memory.times.size < 20
