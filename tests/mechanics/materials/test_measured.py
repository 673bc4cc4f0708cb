"""Materials from measurements: known spectra are found again, in shear, in tension, and along a master curve."""

import re

import numpy as np
import pytest

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.models import from_creep_table, from_dynamic, from_relaxation, from_relaxation_table

EQUILIBRIUM, MODULI, TIMES = 1e5, np.array([3e6, 2e6, 5e5]), np.array([2e-3, 0.07, 4.0])
EXACT = from_relaxation(EQUILIBRIUM, MODULI, TIMES, poisson=0.4)
SPAN = np.geomspace(1e-3, 10.0, 300)


def relaxation(t):
    return EQUILIBRIUM + np.exp(-np.asarray(t)[:, None] / TIMES) @ MODULI


def dynamic(omega):
    x = omega[:, None] * TIMES
    return EQUILIBRIUM + x**2 / (1 + x**2) @ MODULI, x / (1 + x**2) @ MODULI


def distance(material, t=SPAN):
    return np.abs(material.contact_compliance(t) / EXACT.contact_compliance(t) - 1).max()


def stated_misfit(material):
    return float(re.search(r"largest misfit ([\d.e+-]+)", material.note)[1])


def test_from_creep_table__in_tension():
    t, shear = (0.0, 1.0, 2.0), (1.0, 2.0, 3.0)
    tensile = from_creep_table(t, np.array(shear) / (2 * 1.3), kind="tensile", poisson=0.3)
    assert tensile.creep_compliance(t) == pytest.approx(shear)
    assert tensile.poisson == 0.3
    assert from_creep_table(t, shear, noise=0.1).compliances == shear
    assert from_creep_table(t, shear, noise=0.1).noise == 0.1


@pytest.mark.parametrize("first", [(), (0.0,)])
def test_from_relaxation_table__finds_the_creep(first):
    t = np.append(first, np.geomspace(1e-4, 100.0, 80))
    material = from_relaxation_table(t, relaxation(t), poisson=0.4)
    assert distance(material) < 5e-3
    assert stated_misfit(material) < 0.01
    assert material.note.startswith(f"{len(material.times) + 1} terms fitted to {t.size} rows")
    assert material.note.endswith(f"times {t[0]:g} to 100 s")
    # the misfit stated is that of the rows
    equilibrium, moduli, times = material.relaxation_spectrum()
    misfit = np.abs((equilibrium + np.exp(-t[:, None] / times) @ moduli) / relaxation(t) - 1).max()
    assert stated_misfit(material) == pytest.approx(misfit, rel=0.06, abs=0)


def test_from_relaxation_table__in_tension():
    t = np.geomspace(1e-4, 100.0, 60)
    shear = from_relaxation_table(t, relaxation(t), poisson=0.3)
    tensile = from_relaxation_table(t, 2.6 * relaxation(t), kind="tensile", poisson=0.3)
    assert tensile.contact_compliance(SPAN) == pytest.approx(shear.contact_compliance(SPAN), rel=1e-6, abs=0)


def test_from_relaxation_table__of_one_exponential_needs_few_terms():
    t = np.geomspace(1e-3, 1e3, 50)
    generator = np.random.default_rng(5)
    noisy = (1 + np.exp(-t / 0.37)) * (1 + 0.01 * generator.standard_normal(50))
    material = from_relaxation_table(t, noisy)
    assert len(material.times) <= 3
    exact = from_relaxation(1.0, (1.0,), (0.37,))
    assert material.creep_compliance(t) == pytest.approx(exact.creep_compliance(t), rel=0.03, abs=0)


@pytest.mark.parametrize(("noise", "most"), [(0.0, 24), (0.01, 18), (0.03, 18)])
def test_from_relaxation_table__spends_few_terms(noise, most):
    """A wide spectrum over 8 decades: some two terms a decade, each of them a field to remember."""
    t = np.geomspace(1e-4, 1e4, 100)
    exact = 1e5 + 1e6 * t**-0.3
    material = from_relaxation_table(t, exact * (1 + noise * np.random.default_rng(1).standard_normal(100)))
    assert len(material.times) <= most
    equilibrium, moduli, times = material.relaxation_spectrum()
    assert equilibrium + np.exp(-t[:, None] / times) @ moduli == pytest.approx(exact, rel=max(2 * noise, 1e-3))


def stated_between(material):
    return float(re.search(r"error between rows up to about ([\d.e+-]+)", material.note)[1])


#: relaxation with a wide spectrum, and with three terms that six rows cannot tell
WIDE = {
    "power": lambda t: 1e5 + 1e6 * t**-0.3,
    "stretched": lambda t: 1e5 + 2e6 * np.exp(-((t / 0.1) ** 0.4)),
    "logarithm": lambda t: 2e6 / (1 + 0.3 * np.log1p(t / 1e-4)),
}


@pytest.mark.parametrize("rows", [6, 12, 30])
@pytest.mark.parametrize("name", [*WIDE, "three terms"])
def test_from_relaxation_table__states_the_error_between_the_rows(name, rows):
    """Few rows can be met exactly in many ways: the misfit says nothing, the rows predicted from the others do."""
    curve = WIDE.get(name, relaxation)
    t, between = np.geomspace(1e-4, 1e2, rows), np.geomspace(1e-4, 1e2, 500)
    material = from_relaxation_table(t, curve(t))
    equilibrium, moduli, times = material.relaxation_spectrum()
    error = np.abs((equilibrium + np.exp(-between[:, None] / times) @ moduli) / curve(between) - 1).max()
    assert error <= 2 * stated_between(material) + 1e-4
    if name in WIDE:  # a smooth spectrum follows where the sparse one would be up to 33 % off
        assert error <= {6: 0.05, 12: 4e-3, 30: 1e-3}[rows]


def test_from_dynamic__states_the_error_between_the_rows():
    errors = []
    for rows in (5, 40):
        omega = np.geomspace(1e-2, 1e4, rows)
        material = from_dynamic(omega, *dynamic(omega), frequency_unit="rad/s", poisson=0.4)
        errors.append((stated_between(material), distance(material)))
    assert errors[0][0] > 0.05 > errors[1][0]
    assert errors[1][1] <= 2 * errors[1][0]
    two = from_dynamic((1.0, 2.0), (1.0, 2.0), (1.0, 1.0), frequency_unit="rad/s")
    assert "between rows" not in two.note, "no row lies between others"


def test_from_relaxation_table__of_an_elastic_material_is_elastic():
    material = from_relaxation_table([0.0, 1.0, 2.0], [2.0, 2.0, 2.0])
    assert material.times == ()
    assert material.glassy == pytest.approx(0.5)


@pytest.mark.parametrize(("unit", "factor"), [("rad/s", 1.0), ("Hz", 2 * np.pi)])
def test_from_dynamic__finds_the_creep(unit, factor):
    omega = np.geomspace(1e-2, 1e4, 60)
    material = from_dynamic(omega / factor, *dynamic(omega), frequency_unit=unit, poisson=0.4)
    assert distance(material) < 0.01
    assert stated_misfit(material) < 0.02
    assert material.note.startswith(f"{len(material.times) + 1} terms fitted to 60 rows")
    assert material.note.endswith("frequencies 0.01 to 10000 rad/s")


def test_from_dynamic__shift_factors_make_a_master_curve():
    """Three temperatures, each over two decades, in any order."""
    window = np.geomspace(1.0, 100.0, 15)
    shifts = np.repeat([1.0, 1e-2, 1e2], 15)
    frequencies = np.tile(window, 3)
    material = from_dynamic(
        frequencies, *dynamic(frequencies * shifts), frequency_unit="rad/s", shift_factors=shifts, poisson=0.4
    )
    assert distance(material) < 0.01
    assert material.note.endswith("frequencies 0.01 to 10000 rad/s")
    same = from_dynamic(window, *dynamic(window * 10), frequency_unit="rad/s", shift_factors=10.0, poisson=0.4)
    assert same == from_dynamic(window * 10, *dynamic(window * 10), frequency_unit="rad/s", poisson=0.4)


def test_from_dynamic__in_tension():
    omega = np.geomspace(1e-2, 1e4, 60)
    shear = from_dynamic(omega, *dynamic(omega), frequency_unit="rad/s", poisson=0.4)
    storage, loss = dynamic(omega)
    tensile = from_dynamic(omega, 2.8 * storage, 2.8 * loss, frequency_unit="rad/s", kind="tensile", poisson=0.4)
    assert tensile.contact_compliance(SPAN) == pytest.approx(shear.contact_compliance(SPAN), rel=1e-6, abs=0)


def test_from_dynamic__fits_the_loss_as_well():
    """Storage moduli alone leave the loss open; a loss that contradicts them shows in the misfit."""
    omega = np.geomspace(1e-2, 1e4, 60)
    storage, loss = dynamic(omega)
    assert stated_misfit(from_dynamic(omega, storage, 3 * loss, frequency_unit="rad/s")) > 0.3


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: from_creep_table((0, 1), (1, 2), kind="bulk"), r"kind is 'bulk': expected 'shear' or 'tensile'"),
        (lambda: from_creep_table((0, 1), (1, 2), kind="tensile", poisson=0.7), r"poisson is 0\.7"),
        (lambda: from_creep_table((0, 1), (1, -2), kind="tensile"), r"table row 1: compliance is -6"),
        (lambda: from_relaxation_table((0, 1, 1), (3, 2, 1)), r"table row 2: time 1 after 1: expected ascending time"),
        (lambda: from_relaxation_table((0, 1), (1, 0)), r"table row 1: modulus is 0: expected a positive modulus"),
        (lambda: from_relaxation_table((0, 1), (1, np.nan)), r"table row 1: modulus is nan"),
        (lambda: from_dynamic((1, 2), (1, 2), (1, 2), frequency_unit="1/s"), r"frequency_unit is '1/s'"),
        (lambda: from_dynamic((1, 0), (1, 2), (1, 2), frequency_unit="Hz"), r"table row 1: a frequency, a shift"),
        (lambda: from_dynamic((1, 2), (0, 2), (0, 2), frequency_unit="Hz"), r"table row 0: .* both moduli are 0"),
        (lambda: from_dynamic((1, 2), (1, 2), (1, -2), frequency_unit="Hz"), r"table row 1: loss modulus is -2"),
        (
            lambda: from_dynamic((1, 2), (1, 2), (1, 2), frequency_unit="Hz", shift_factors=(1,)),
            r"2 of frequency, 2 of storage modulus, 2 of loss modulus, 1 of shift factor: expected as many",
        ),
    ],
)
def test_bad_input__is_named(make, message):
    with pytest.raises(InputError, match=message):
        make()
