"""Certified series: positive, as accurate as they state, and with few terms."""

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.mechanics.materials.series import series


def true_error(material, found, shortest, longest):
    """Largest relative error at instants other than those of the certificate."""
    t = np.append(np.geomspace(shortest, longest, 7919), longest)
    return float(np.abs(found.contact_compliance(t) / material.contact_compliance(t) - 1).max())


CURVES = {
    "power 0.2": lambda t: 0.1 + t**0.2,
    "power 0.5": lambda t: t**0.5,
    "power 0.8": lambda t: 0.1 + t**0.8,
    "logarithm": lambda t: 1 + 0.3 * np.log1p(t / 1e-4),
    "stretched": lambda t: 1 + 5 * -np.expm1(-(t**0.4)),
}


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize(
    ("decades", "tolerance", "most"),
    [(3, 1e-2, 5), (3, 1e-4, 9), (6, 1e-2, 8), (6, 1e-4, 16), (6, 1e-5, 25), (3, 1e-5, 15)],
)
def test_series__of_smooth_creep_has_few_terms(curve, decades, tolerance, most):
    """Up to 1.2 terms a decade for 1e-2 and 2.5 for 1e-4, with a term or two for the ends."""
    shortest, longest = 1e-3, 10.0 ** (decades - 3)
    material = rv.creep(CURVES[curve], poisson=0.1)
    found, error = series(material, shortest, longest, tolerance)
    assert error <= tolerance
    assert 0.5 * error <= true_error(material, found, shortest, longest) <= 1.1 * error
    assert found.glassy == CURVES[curve](0.0)
    assert len(found.times) <= most
    assert found.poisson == 0.1


@pytest.mark.parametrize("exponent", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-4])
def test_series__of_a_power_law_has_the_means_from_rest(exponent, tolerance):
    """What creeps before the shortest time, as a first step sees it, is at most the creep until then."""
    material = rv.power_law(0.0, 1.0, exponent)
    found, _ = series(material, 1e-3, 10.0, tolerance)
    t = np.geomspace(1e-3, 10.0, 50)
    before = 1e-3 * float(material.contact_compliance(1e-3))
    off = np.abs(found.contact_integral(t) - material.contact_integral(t))
    assert (off <= 0.5 * before + tolerance * material.contact_integral(t)).all()


@pytest.mark.parametrize("exponent", [0.01, 0.5, 0.99])
def test_series__over_24_decades(exponent):
    material = rv.power_law(0.0, 1e-9, exponent, time_scale=1e-5)
    found, error = series(material, 1e-12, 1e12, 1e-3)
    assert error <= 1e-3
    assert np.isfinite([found.glassy, found.fluidity, *found.compliances, *found.times]).all()
    assert true_error(material, found, 1e-12, 1e12) <= 1.05e-3


def test_series__does_not_see_units():
    """Seconds or hours, pascals or megapascals: the same terms."""
    plain, error = series(rv.power_law(0.1, 1.0, 0.4), 1e-3, 1e3, 1e-4)
    scaled, same = series(rv.power_law(1e-7, 1e-6, 0.4, time_scale=3600.0), 3.6, 3.6e6, 1e-4)
    assert np.array(scaled.compliances) == pytest.approx(1e-6 * np.array(plain.compliances), rel=1e-6, abs=0)
    assert same == pytest.approx(error, rel=1e-4, abs=0)


def test_series__of_an_active_material_states_its_distance():
    """A delay, a positive sum of exponentials cannot have one: half of the step at least."""
    material = rv.creep(lambda t: 1.0 + (t > 1.0))
    found, error = series(material, 1e-3, 1e3, 1e-4)
    assert 0.2 < error < 0.5
    assert true_error(material, found, 1e-3, 1e3) <= 1.1 * error


def test_series__of_a_series_is_itself():
    material = rv.Prony(0.0, 1.0, (1.0,), (2.0,))
    assert series(material, 1e-3, 1.0, 1e-9) == (material, 0.0)


def table(**keys):
    t = np.geomspace(1e-3, 1e3, 60)
    return rv.creep_table(t, CURVES["logarithm"](t), **keys, kind="shear")


def test_series__of_a_table_has_fewer_terms_for_less():
    """At the tolerance asked for, or the fit to the rows itself if nothing shorter is near enough."""
    material, terms = table(), []
    for tolerance in (1e-2, 1e-4, 1e-9):
        found, error = series(material, 1e-3, 1e3, tolerance)
        assert error <= tolerance
        assert true_error(material, found, 1e-3, 1e3) <= 1.1 * error + 1e-14
        terms.append(len(found.times))
    assert terms[0] < terms[1] < terms[2]
    assert error == 0


@pytest.mark.parametrize("factors", [(1.0, 1.0), (30.0, 7.0)])
def test_series__of_a_pair_is_the_sum(factors):
    bodies = rv.power_law(0.1, 1.0, 0.4, poisson=0.2), table(poisson=0.4), rv.zener(1.0, 2.0, 3.0, poisson=0.1)
    material = rv.shift(rv.pair(rv.pair(bodies[0], bodies[1]), bodies[2]), factors[0])
    found, error = series(material, 1e-3 * factors[0], 1e3 * factors[0], 1e-4)
    assert 0 < error <= 1e-4
    assert true_error(material, found, 1e-3 * factors[0], 1e3 * factors[0]) <= 1.05 * error
    # a stiff body of larger relative error spoils nothing; the error of the sum is measured
    _, alone = series(bodies[0], 1e-3, 1e3, 1e-2)
    _, hidden = series(rv.pair(bodies[0], rv.elastic(1e-6)), 1e-3, 1e3, 1e-2)
    assert hidden < 1e-3 * alone
