"""Tables with several temperatures: known shift factors are found again, and what cannot be known is stated."""

import re

import numpy as np
import pytest
from support import refused

import roughvisc as rv

TIMES = np.geomspace(1e-14, 1e4, 60)
MODULI = 1e9 * np.exp(-0.5 * ((np.log10(TIMES) + 9) / 3.0) ** 2) / 12
MODULI += 3e5 * np.exp(-0.5 * ((np.log10(TIMES) + 1) / 2.5) ** 2)
EXACT = rv.from_relaxation(1e6, MODULI, TIMES)
LEVELS = 273.15 + np.arange(-40.0, 61.0, 10.0)
CONTACT = 293.15
LATE = np.geomspace(0.02, 100.0, 20)


def log_shift(temperature):
    """WLF with c1 = 6 and c2 = 120 K."""
    return -6 * (temperature - CONTACT) / (120 + temperature - CONTACT)


def measured(levels=LEVELS, rng=None, noise=0.01, gain=0.0, warmer=0.0, rubber=False):
    """Temperatures, frequencies [rad/s], storage and loss of a table, with faults of the machine."""
    rng = rng or np.random.default_rng(1)
    window, rows = 2 * np.pi * np.geomspace(0.1, 100, 10), []
    for level in levels:
        x = (window * 10 ** log_shift(level + warmer * rng.standard_normal()))[:, None] * TIMES
        moduli = np.array([1e6 + x**2 / (1 + x**2) @ MODULI, x / (1 + x**2) @ MODULI])
        moduli *= (level / CONTACT if rubber else 1.0) * (1 + gain * rng.standard_normal())
        rows.append([np.full(10, level), window, *moduli * (1 + noise * rng.standard_normal((2, 10)))])
    return np.concatenate(rows, axis=1)


def made(table, **keys):
    temperatures, *columns = table
    keys = {"temperature": CONTACT, "vertical": "none"} | keys
    return rv.dynamic_table(*columns, frequency_unit="rad/s", kind="shear", temperatures=temperatures, **keys)


def off(material, rows=slice(None)):
    ratio = material.contact_compliance(LATE[rows]) / EXACT.contact_compliance(LATE[rows])
    return float(np.abs(ratio - 1).max())


def test_shift_factors__are_found_within_their_stated_deviation():
    found = [made(measured(rng=np.random.default_rng(seed))).thermal.shift.__self__ for seed in range(6)]
    errors = np.array([one.log_shift - (log_shift(LEVELS) - log_shift(one.reference_temperature)) for one in found])
    assert np.abs(errors).max() < 0.03
    within = np.abs(errors) <= 2 * np.array([one.sigma for one in found]) + 1e-12
    assert within.mean() > 0.95


@pytest.mark.parametrize("rubber", [False, True])
def test_material__is_that_of_its_temperature(rubber):
    """Of one between measured ones too; and the same from any other temperature."""
    material = made(measured(rubber=rubber), vertical="rubber" if rubber else "none")
    assert off(material) < 0.02
    assert (
        made(measured(rubber=rubber), temperature="40 degC", vertical=("none", "rubber")[rubber]).at(CONTACT)
        == material
    )
    between = 288.15
    reached = material.at(between).scaled(10 ** -log_shift(between), CONTACT / between if rubber else 1.0)
    assert off(reached) < 0.03
    assert material.warning == ""


def test_note__states_what_the_misfit_does_not():
    """A wrong temperature or gain scatters the shifts, and the vertical factor changes them, with the same misfit."""

    def stated(what, **faults):
        return float(re.search(rf"{what} (?:up to |of )?([\d.e-]+)", made(measured(**faults)).note)[1])

    scatter, plain = "scatter", stated("scatter")
    assert plain < 0.02
    assert 0.02 < stated(scatter, warmer=0.5) < 0.06  # decades a kelvin: 0.05
    assert 0.04 < stated(scatter, gain=0.05) < 0.2
    assert stated("rms misfit", gain=0.05) == pytest.approx(stated("rms misfit"), rel=0.3)
    assert stated('vertical = "rubber" changes them by') > 0.05
    cold = measured()
    cold[3] *= np.where(cold[0] < 250, cold[1] ** 0.3, 1.0)  # loss of another material at low temperatures
    assert "thermorheologically" in made(cold).warning


def test_tables_over_time__are_superposed_too():
    window = np.geomspace(0.1, 100.0, 25)
    temperatures, times = np.repeat(LEVELS[4:], 25), np.tile(window, LEVELS.size - 4)
    reduced = times * 10 ** -log_shift(temperatures)
    keys = {"temperatures": temperatures, "temperature": CONTACT, "vertical": "none", "kind": "shear"}
    creep = rv.creep_table(times, EXACT.creep_compliance(reduced), noise=0.01, **keys)
    relaxation = rv.relaxation_table(times, 1e6 + np.exp(-reduced[:, None] / TIMES) @ MODULI, **keys)
    late = slice(5, None)  # after the first reduced time
    assert off(creep, late) < 0.02
    assert off(relaxation, late) < 0.01


def test_one_temperature__needs_no_shift():
    rows = measured(levels=[CONTACT])
    rows[0] += np.linspace(-0.2, 0.2, 10)
    plain = rv.dynamic_table(*rows[1:], frequency_unit="rad/s", kind="shear")
    assert made(rows, vertical=None) == made(rows, temperature=None, vertical=None) == plain


@pytest.mark.parametrize(
    ("key", "found"),
    [
        ("temperature", None),
        ("temperature", 400.0),
        ("vertical", None),
        ("vertical", "polymer"),
        ("temperature", 200.0),
    ],
)
def test_several_temperatures__need_a_temperature_within_and_vertical(key, found):
    with refused(key, found):
        made(measured(), **{key: found})


def test_temperature__without_those_of_the_rows_is_refused():
    with refused("temperature", 300.0):
        rv.creep_table((0, 1), (1, 2), kind="shear", temperature=300.0)
    with refused("shift_factors"):
        made(measured(), shift_factors=np.linspace(1, 2, 110))
