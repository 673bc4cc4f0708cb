"""Certified series: positive, as accurate as they say, and as short as the theory has them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples, power_laws

from roughvisc.mechanics.materials import models as materials
from roughvisc.mechanics.materials.models import PowerLaw, Prony, Tabulated
from roughvisc.mechanics.materials.series import power_law_series, series_of, table_series


def error(material, series, shortest, longest):
    """Largest relative error at instants of its own: not those of the certificate."""
    t = np.append(np.geomspace(shortest, longest, 7919), longest)
    return float(np.abs(series.prony.contact_compliance(t) / material.contact_compliance(t) - 1).max())


def sampled(function, shortest, longest, rows, **keys):
    t = np.geomspace(shortest, longest, rows)
    return Tabulated(t, function(t), **keys)


@given(
    material=power_laws,
    shortest=st.floats(1e-9, 1e3),
    decades=st.floats(0.1, 8),
    tolerance=st.sampled_from([1e-2, 1e-4, 1e-6, 1e-8]),
)
@examples(60)
def test_power_law_series__keeps_the_tolerance(material, shortest, decades, tolerance):
    longest = shortest * 10**decades
    found = power_law_series(material, shortest, longest, tolerance)
    assert found.error <= tolerance
    assert error(material, found, shortest, longest) <= 1.05 * found.error + 1e-14
    assert found.prony.poisson == 0.3
    assert found.prony.glassy == material.glassy
    assert found.prony.fluidity > 0


@pytest.mark.parametrize("exponent", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-4])
def test_power_law_series__means_from_rest_are_right_as_well(exponent, tolerance):
    """What creeps before the shortest time has the right integral: a first step, or a short ramp, asks for that."""
    material = PowerLaw(0.0, 1.0, exponent)
    found = power_law_series(material, 1e-3, 10.0, tolerance)
    steps = np.geomspace(1e-3, 10.0, 50)
    means = [body.mean_contact_compliance(0.0, steps) for body in (found.prony, material)]
    assert means[0] == pytest.approx(means[1], rel=2.5 * tolerance, abs=0)


@pytest.mark.parametrize("exponent", [0.01, 0.5, 0.99])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-10])
def test_power_law_series__over_24_decades(exponent, tolerance):
    material = PowerLaw(0.0, 1e-9, exponent, time_scale=1e-5)
    found = power_law_series(material, 1e-12, 1e12, tolerance)
    assert np.isfinite([found.prony.glassy, found.prony.fluidity, *found.prony.compliances, *found.prony.times]).all()
    assert error(material, found, 1e-12, 1e12) <= 1.05 * tolerance


def test_power_law_series__does_not_see_units_or_time_scale():
    """Seconds or hours, pascals or megapascals: the same terms."""
    plain = power_law_series(PowerLaw(0.1, 1.0, 0.4), 1e-3, 1e3, 1e-5)
    scaled = power_law_series(PowerLaw(1e-7, 1e-6, 0.4, time_scale=3600.0), 3.6, 3.6e6, 1e-5)
    assert len(plain.prony.times) == len(scaled.prony.times)
    assert np.array(scaled.prony.compliances) == pytest.approx(
        1e-6 * np.array(plain.prony.compliances), rel=1e-9, abs=0
    )
    assert scaled.error == pytest.approx(plain.error, rel=1e-6, abs=0)


CURVES = {
    "power": lambda t: t**0.5,
    "logarithm": lambda t: 1 + 0.3 * np.log1p(t / 1e-4),
    "stretched": lambda t: 1 + 5 * -np.expm1(-(t**0.4)),
}


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize(
    ("decades", "tolerance", "most"),
    [(3, 1e-2, 5), (3, 1e-4, 9), (6, 1e-2, 8), (6, 1e-4, 16), (6, 1e-5, 25), (3, 1e-5, 15)],
)
def test_table_series__of_smooth_creep_has_few_terms(curve, decades, tolerance, most):
    """Up to 1.2 terms a decade for 1e-2 and 2.5 for 1e-4, with a term or two for the ends."""
    shortest, longest = 1e-3, 10.0 ** (decades - 3)
    table = sampled(CURVES[curve], shortest, longest, 2000, poisson=0.1)
    found = table_series(table, shortest, longest, tolerance)
    assert found.error <= tolerance
    assert error(table, found, shortest, longest) <= 1.1 * found.error
    assert found.prony.glassy == table.creep_compliance(0.0)
    assert len(found.prony.times) <= most
    assert found.prony.poisson == 0.1


def test_table_series__finds_one_relaxation_between_the_lattice():
    table = sampled(lambda t: 1 - np.expm1(-t / 0.37), 1e-3, 1e3, 4000)
    found = table_series(table, 1e-3, 1e3, 1e-4)
    assert found.error <= 1e-4
    assert len(found.prony.times) <= 4
    assert found.prony.times[0] == pytest.approx(0.37, rel=0.1, abs=0)


def test_table_series__of_noise_tells_its_distance():
    """40 rows with 1 % noise: the curve below is found to 1 %, the kinks of the rows are not followed."""
    generator = np.random.default_rng(3)
    t = np.geomspace(1e-3, 1e3, 40)
    table = Tabulated(t, t**0.3 * (1 + 0.01 * generator.standard_normal(40)), noise=0.05)
    found = table_series(table, 1e-3, 1e3, 1e-5)
    assert 1e-3 < found.error < 0.03
    assert error(table, found, 1e-3, 1e3) <= 1.1 * found.error
    assert np.abs(found.prony.creep_compliance(t) / t**0.3 - 1).max() < 0.03
    # asking for less than can be had gives less
    coarse = table_series(table, 1e-3, 1e3, 0.05)
    assert found.error < coarse.error <= 0.05
    assert len(coarse.prony.times) < len(found.prony.times)


def test_table_series__counts_the_rows():
    """A kink at a row, between the instants of the grid, is seen."""
    row = 1.0 * 10 ** (0.5 / 100)  # midway between two instants of the certificate's grid from 1 to 10
    table = Tabulated((1.0, row * (1 - 1e-9), row, row * (1 + 1e-9), 10.0), (1.0, 1.0, 2.0, 2.0, 2.0))
    found = table_series(table, 1.0, 10.0, 1e-3)
    rows = np.array(table.times)
    at_rows = np.abs(found.prony.creep_compliance(rows) / table.creep_compliance(rows) - 1).max()
    assert found.error >= at_rows


def test_table_series__of_no_compliance_at_all_has_no_relative_error():
    found = table_series(Tabulated((0.0, 1.0, 3.0), (0.0, 0.0, 4.0)), 0.5, 2.0, 1e-3)
    assert found.error == np.inf
    assert np.isfinite(found.prony.creep_compliance(1.5))


def test_table_series__over_24_decades():
    table = sampled(lambda t: 1e-9 * t**0.3, 1e-12, 1e12, 500)
    found = table_series(table, 1e-12, 1e12, 1e-3)
    assert found.error <= 1e-3
    assert error(table, found, 1e-12, 1e12) <= 1.05e-3


def test_table_series__is_measured_from_the_first_row_on():
    """Before it nothing was measured, and the series takes its own course there, from what is there at once."""
    t = np.geomspace(1e-3, 10.0, 200)
    table = Tabulated((0.0, *t), (0.0, *t**0.4))
    found = table_series(table, 1e-7, 10.0, 1e-3)
    assert found.shortest == pytest.approx(1e-3)
    assert found.error <= 1e-3
    assert found.prony.glassy == 0
    assert error(table, found, 1e-3, 10.0) <= 1.05e-3


def test_series_of__a_noisy_table_is_made_passive_whatever_the_tolerance():
    noisy = (0.5 + 1e-3**0.3) + np.maximum.accumulate(np.random.default_rng(4).uniform(0, 1, 40))
    table = Tabulated(np.geomspace(1e-3, 1e3, 40), noisy)
    found = [series_of(table, shortest, 1e3, tolerance) for shortest, tolerance in ((1e-3, 1e-3), (1e-5, 1e-5))]
    assert found[0].prony == found[1].prony
    assert found[0].pressed == found[0].prony
    assert found[0].error == 0
    assert found[0].repair.startswith("made passive: deviates from the rows by at most ")
    smooth = sampled(CURVES["logarithm"], 1e-3, 1e3, 2000)
    assert series_of(smooth, 1e-3, 1e3, 1e-4).repair == ""
    both = series_of(materials.pair(table, PowerLaw(0.3, 1.0, 0.4)), 1e-3, 1e3, 1e-4)
    assert both.repair == f"a: {found[0].repair}"
    assert 0 < both.error <= 1e-4
    assert error(both.pressed, both, 1e-3, 1e3) <= 1.05 * both.error


def test_series_of__a_series_is_itself():
    material = Prony(0.0, 1.0, (1.0,), (2.0,))
    found = series_of(material, 1e-3, 1.0, 1e-9)
    assert found.prony is material
    assert found.error == 0


def test_series_of__a_pair_is_the_sum():
    bodies = (
        PowerLaw(0.1, 1.0, 0.4, poisson=0.2),
        sampled(CURVES["logarithm"], 1e-3, 1e3, 1000, poisson=0.4),
        materials.zener(1.0, 2.0, 3.0, poisson=0.1),
    )
    material = materials.pair(materials.pair(bodies[0], bodies[1]), bodies[2])
    found = series_of(material, 1e-3, 1e3, 1e-4)
    assert 0 < found.error <= 1e-4
    assert error(material, found, 1e-3, 1e3) <= 1.05 * found.error
    # a stiff body of larger relative error spoils nothing; the sum is measured, not bounded
    alone = series_of(bodies[0], 1e-3, 1e3, 1e-2).error
    hidden = series_of(materials.pair(bodies[0], materials.elastic(1e-6)), 1e-3, 1e3, 1e-2).error
    assert hidden < 1e-3 * alone
