"""What measurements leave unknown of a material, and moduli that no passive material has."""

import pickle

import numpy as np
import pytest
from scipy.special import stdtrit

import roughvisc as rv
from roughvisc.mechanics.materials.fit import Fit
from roughvisc.mechanics.materials.kramers_kronig import disagreement
from roughvisc.mechanics.materials.models import from_creep_table, from_dynamic, from_relaxation_table
from roughvisc.mechanics.materials.scaled import shifted

#: A broad spectrum, a glass transition, and one sharp mode: relaxation times [s], moduli [Pa], equilibrium modulus.
SPECTRA = {
    "broad": (np.geomspace(1e-6, 1e6, 200), np.geomspace(1e-6, 1e6, 200) ** -0.2 * 2e4, 1e6),
    "transition": (
        np.geomspace(1e-9, 1e2, 300),
        2e7 * np.exp(-((np.log10(np.geomspace(1e-9, 1e2, 300)) + 4) ** 2) / 4),
        1e6,
    ),
    "sharp": (np.array([1.0]), np.array([1e6]), 5e5),
}


def moduli(spectrum, omega):
    times, strengths, equilibrium = SPECTRA[spectrum]
    x = omega[:, None] * times
    return equilibrium + (strengths * x**2 / (1 + x**2)).sum(1), (strengths * x / (1 + x**2)).sum(1)


def noisy(values, noise, rng):
    return values * np.exp(noise * rng.standard_normal(len(values)))


class Scaled:
    def __init__(self, mean):
        self.mean = mean

    def contact_compliance(self, t):
        return self.mean * np.ones_like(np.asarray(t))


def test_error__of_a_mean_is_its_standard_error_times_students_factor():
    """Jackknife of the mean of ten values, exact: sd / sqrt(10)."""
    values = np.exp(np.random.default_rng(2).normal(0, 1e-4, 10))
    fit = Fit(lambda kept: Scaled(values[kept].mean()), 10, (1.0, 100.0))
    expected = stdtrit(9, 0.975) * np.std(values, ddof=1) / np.sqrt(10)
    assert fit.error([1.0, 7.0, 1e3]) == pytest.approx(expected, rel=1e-3)
    assert np.isnan(Fit(fit.refit, 3, (1.0, 100.0)).error(1.0)), "too few rows"


@pytest.mark.parametrize("table", ["dynamic", "relaxation", "creep"])
def test_error__holds_the_truth(table):
    """95 % of instants over draws of 2 % noise; not more than six times the true error in the median."""
    times, strengths, equilibrium = np.geomspace(1e-3, 1e3, 13), np.geomspace(1e-3, 1e3, 13) ** -0.2 * 3e5, 1e6
    true = rv.from_relaxation(equilibrium, strengths.tolist(), times.tolist())
    t, at, rng = np.geomspace(1e-2, 1e2, 40), np.geomspace(1e-2, 1e2, 17), np.random.default_rng(8)
    x = times / t[:, None]
    held, over = [], []
    for _ in range(12):
        if table == "dynamic":
            storage, loss = equilibrium + (strengths * x**2 / (1 + x**2)).sum(1), (strengths * x / (1 + x**2)).sum(1)
            pair = (noisy(one, 0.02, rng) for one in (storage, loss))
            found = from_dynamic(1 / t, *pair, frequency_unit="rad/s")
        elif table == "relaxation":
            relaxing = equilibrium + (strengths * np.exp(-t[:, None] / times)).sum(1)
            found = from_relaxation_table(t, noisy(relaxing, 0.02, rng))
        else:
            found = from_creep_table(t, noisy(true.creep_compliance(t), 0.02, rng), noise=0.2)
        off = np.abs(np.log(found.contact_compliance(at) / true.contact_compliance(at)))
        held.append(off <= found.fit.error(at))
        over.append(np.median(found.fit.error(at)) / np.median(off))
    assert 0.88 <= np.mean(held) <= 1
    assert 1 < np.median(over) < 6


def test_error__goes_along_with_shifts_factors_and_pairs():
    omega, rng = np.geomspace(1e-2, 1e2, 30), np.random.default_rng(1)
    found = from_dynamic(omega, *(noisy(one, 0.03, rng) for one in moduli("broad", omega)), frequency_unit="rad/s")
    at = np.geomspace(0.03, 30, 7)
    alone = found.fit.error(at)
    assert len(set(alone)) > 3
    np.testing.assert_array_equal(shifted(found, 50.0).fit.error(50 * at), alone)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(found)).fit.error(at), alone)
    rigid, twice = rv.elastic(1e15), rv.pair(found, found)
    np.testing.assert_allclose(rv.pair(found, rigid).fit.error(at), alone, rtol=1e-6)
    np.testing.assert_allclose(twice.fit.error(at), alone / np.sqrt(2), rtol=1e-12)
    np.testing.assert_allclose(shifted(twice, 50.0).fit.error(50 * at), alone / np.sqrt(2), rtol=1e-12)
    assert rv.pair(rigid, rigid).fit is None
    assert rv.zener(1e6, 1e6, 1e5).fit is None


@pytest.mark.parametrize("spectrum", SPECTRA)
@pytest.mark.parametrize(("rows", "decades"), [(10, 3), (30, 5), (81, 8)])
def test_moduli_of_a_passive_material__are_not_at_odds(spectrum, rows, decades):
    rng = np.random.default_rng(4)
    for noise in (0.0, 0.01, 0.05):
        for low in (-5, -2.5):
            omega = np.geomspace(10**low, 10 ** (low + decades), rows)
            assert disagreement(omega, *(noisy(one, noise, rng) for one in moduli(spectrum, omega))) is None


@pytest.mark.parametrize("spectrum", SPECTRA)
@pytest.mark.parametrize("wrong", ["twice", "half", "shifted"])
def test_moduli_that_no_passive_material_has__are_at_odds(spectrum, wrong):
    omega, rng = np.geomspace(1e-2, 1e2, 30), np.random.default_rng(6)
    storage, loss = moduli(spectrum, omega)
    if wrong == "shifted":
        loss = moduli(spectrum, 10 * omega)[1]
    else:
        loss = loss * {"twice": 2.0, "half": 0.5}[wrong]
    found = disagreement(omega, noisy(storage, 0.02, rng), noisy(loss, 0.02, rng))
    assert found.together > max(2 * found.alone, 0.04)
    assert omega[0] <= found.frequency <= omega[-1]
    if wrong != "shifted":  # one of the moduli is too large for the other, everywhere
        assert (found.loss - found.storage > 0) == (wrong == "twice")


def test_moduli_at_odds__are_told_where_they_are_and_count_in_the_error():
    omega, rng = np.geomspace(1e-3, 1e3, 60), np.random.default_rng(6)
    storage, loss = (noisy(one, 0.01, rng) for one in moduli("transition", omega * 1e-3))
    sound = from_dynamic(omega, storage, loss, frequency_unit="rad/s")
    bad = np.where((omega > 3) & (omega < 300), 3 * loss, loss)
    found = from_dynamic(omega, storage, bad, frequency_unit="rad/s")
    assert "at odds" not in sound.note
    assert sound.fit.complaint == ""
    assert "at odds (Kramers and Kronig)" in found.note
    assert 3 < disagreement(omega, storage, bad).frequency < 300
    assert found.fit.error(1.0) > 0.1 > sound.fit.error(1.0)


def test_moduli_at_odds__are_said_in_the_result(caplog):
    omega = np.geomspace(1e-2, 1e2, 20)
    storage, loss = moduli("sharp", omega)
    material = from_dynamic(omega, storage, 2 * loss, frequency_unit="rad/s")
    program = rv.Program().load(1e-4, over=0)
    ds = rv.simulate(rv.sphere(1e-3, 2e-4, 15), material, program, progress=False)
    assert "material: storage and loss moduli are at odds" in ds.attrs["warnings"]
    assert "at odds" in caplog.text
