"""Materials from measurements: known materials are found again, in shear, in tension, and along a master curve."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from references.half_space import relaxation_spectrum
from strategies import examples
from support import refused

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.mechanics.materials.series import series

# --- creep ----------------------------------------------------------------------------------------------------------

ROWS = np.geomspace(1e-3, 1e3, 60)
CREEP = {
    "power": lambda t: 0.5 + t**0.3,
    "stretched": lambda t: 1 - 5 * np.expm1(-(t**0.4)),
    "logarithm": lambda t: 1 + 0.3 * np.log1p(t / 1e-2),
    "one exponential": lambda t: 1 - 4 * np.expm1(-t / 0.37),
}


def off(material, curve, t=None):
    """Largest relative deviation of the creep compliance from a curve."""
    t = np.geomspace(1e-3, 1e3, 500) if t is None else t
    return float(np.abs(material.creep_compliance(t) / curve(t) - 1).max())


def stated_misfit(material):
    return float(re.search(r"largest misfit ([\d.e+-]+)", material.note)[1])


@pytest.mark.parametrize("name", CREEP)
@pytest.mark.parametrize(("rows", "most"), [(7, 0.03), (13, 6e-3), (25, 1e-3), (1500, 1e-3)])
def test_creep_table__finds_the_creep_between_the_rows(name, rows, most):
    """From a row a decade on; the rows themselves are met as stated."""
    t = np.geomspace(1e-3, 1e3, rows)
    material = rv.creep_table(t, CREEP[name](t), kind="shear")
    assert off(material, CREEP[name]) < most
    assert off(material, CREEP[name], t) == pytest.approx(stated_misfit(material), rel=0.06, abs=1e-12)
    assert material.misfit == pytest.approx(stated_misfit(material), rel=0.06, abs=1e-12)


@pytest.mark.parametrize("name", CREEP)
@pytest.mark.parametrize("seed", range(3))
def test_creep_table__finds_the_curve_below_the_noise(name, seed):
    """The rows are off by the noise, the curve that they were made from by less; with few terms."""
    noise = 1 + 0.03 * np.random.default_rng(seed).standard_normal(ROWS.size)
    material = rv.creep_table(ROWS, CREEP[name](ROWS) * noise, noise=0.4, kind="shear")
    found = material.creep_compliance(ROWS)
    assert np.sqrt(np.mean((found / (CREEP[name](ROWS) * noise) - 1) ** 2)) == pytest.approx(0.03, rel=0.35)
    assert np.sqrt(np.mean((found / CREEP[name](ROWS) - 1) ** 2)) < 0.02
    assert material.misfit == 0, "within the noise"
    terms = [len(series(material, 1e-3, 1e3, tolerance)[0].times) for tolerance in (1e-3, 1e-5)]
    assert max(terms) <= 15


#: creep -> its compliance at time zero
BEGINNINGS = {
    "power": (lambda t: 2 + t**0.5, 2.0),
    "almost all at once": (lambda t: 2 - np.exp(-t / 0.4), 1.0),
    "stretched": (lambda t: 1 - 5 * np.expm1(-(t**0.4)), 1.0),
}


@pytest.mark.parametrize("name", BEGINNINGS)
def test_before_the_first_row__creep_goes_on_as_it_does_after(name):
    creep, at_once = BEGINNINGS[name]
    t = np.geomspace(1e-3, 10.0, 60)
    table = rv.creep_table(t, creep(t), kind="shear")
    assert float(table.creep_compliance(0.0)) == pytest.approx(at_once, rel=0.04, abs=0)
    early = np.geomspace(1e-5, 1e-3, 50)
    assert table.creep_compliance(early) == pytest.approx(creep(early), rel=0.08, abs=0)
    assert "nothing was measured before 0.001 s: instantaneous compliance of " in table.note


def test_before_the_first_row__a_logarithm_goes_on_for_a_decade():
    t = np.geomspace(2.0, 2e3, 20)
    first = 5 + 0.1 * np.log(2)
    table = rv.creep_table(t, 5.0 + 0.1 * np.log(t), kind="shear")
    assert float(table.creep_compliance(0.0)) == pytest.approx(first - 0.1 * (1 + np.log(10)), rel=1e-12, abs=0)
    assert rv.creep_table((2.0, 4.0), (5.0, 5.0), kind="shear").creep_compliance(0.0) == 5.0
    assert rv.creep_table((2.0, 4.0), (5.0, 15.0), kind="shear").creep_compliance(0.0) == pytest.approx(0.5)


@pytest.mark.parametrize(
    "ask",
    [
        lambda table, t: table.creep_compliance([1.0, t]),
        lambda table, t: table.contact_compliance(t),
        lambda table, t: table.contact_integral(t),
        lambda table, t: series(table, 1.0, t, 1e-3),
        lambda table, t: rv.pair(table, rv.elastic(1.0)).contact_compliance(t),
    ],
)
def test_creep_table__is_not_extrapolated(ask):
    table = rv.creep_table((0.0, 1.0, 100.0), (1.0, 3.0, 7.0), poisson=0.0, kind="shear")
    ask(table, 100.0 * (1 + 1e-13))  # rounding of a sum of steps
    with pytest.raises(InputError, match=r"and the table ends at 100 s"):
        ask(table, 101.0)
    with pytest.raises(InputError, match="creep is requested at nan s"):
        rv.elastic(1.0).creep_compliance(np.nan)


@pytest.mark.parametrize(("key", "found"), [("noise", -0.1), ("noise", np.nan), ("poisson", 0.6), ("kind", "bulk")])
def test_bad_number__is_named(key, found):
    with refused(key, found):
        rv.creep_table((0, 1), (1, 2), **{"kind": "shear", key: found})


def test_noise__counts_from_the_largest_earlier_row():
    """Small decreases that add up are no noise."""
    with pytest.raises(InputError, match="table row 3"):
        rv.creep_table((0, 1, 2, 3), (1.0, 0.996, 0.992, 0.988), noise=0.01, kind="shear")
    rv.creep_table((0, 1, 2, 3), (1.0, 0.996, 0.992, 0.988), noise=0.02, kind="shear")


@given(st.lists(st.floats(0.96, 1.04), min_size=4, max_size=30), st.floats(0.05, 0.9))
@examples(60)
def test_noisy_table__ascends_within_the_noise(noise, exponent):
    t = np.geomspace(1e-3, 1e3, len(noise))
    raw = t**exponent * np.array(noise)
    table = rv.creep_table(t, raw, noise=0.08, kind="shear")
    assert np.abs(table.creep_compliance(t) / raw - 1).max() <= 0.09
    sampled = table.creep_compliance(np.geomspace(1e-4, 1e3, 500))
    assert (np.diff(sampled) >= -1e-15 * sampled[1:]).all()


# --- relaxation and dynamic moduli ----------------------------------------------------------------------------------

EQUILIBRIUM, MODULI, TIMES = 1e5, np.array([3e6, 2e6, 5e5]), np.array([2e-3, 0.07, 4.0])
EXACT = rv.from_relaxation(EQUILIBRIUM, MODULI, TIMES, poisson=0.4)
SPAN = np.geomspace(1e-3, 10.0, 300)


def relaxation(t):
    return EQUILIBRIUM + np.exp(-np.asarray(t)[:, None] / TIMES) @ MODULI


def dynamic(omega):
    x = omega[:, None] * TIMES
    return EQUILIBRIUM + x**2 / (1 + x**2) @ MODULI, x / (1 + x**2) @ MODULI


def distance(material, t=SPAN):
    return np.abs(material.contact_compliance(t) / EXACT.contact_compliance(t) - 1).max()


def modulus(material, t):
    equilibrium, moduli, times = relaxation_spectrum(material)
    return equilibrium + np.exp(-t[:, None] / times) @ moduli


@pytest.mark.parametrize("first", [(), (0.0,)])
def test_relaxation_table__finds_the_creep(first):
    t = np.append(first, np.geomspace(1e-4, 100.0, 80))
    material = rv.relaxation_table(t, relaxation(t), poisson=0.4, kind="shear")
    assert distance(material) < 5e-3
    assert stated_misfit(material) < 0.01
    assert material.note.startswith(f"{len(material.times) + 1} terms fitted to {t.size} values")
    assert f"times {t[0]:g} to 100 s" in material.note
    # the misfit stated is that of the rows
    misfit = np.abs(modulus(material, t) / relaxation(t) - 1).max()
    assert stated_misfit(material) == pytest.approx(misfit, rel=0.06, abs=0)


@pytest.mark.parametrize("seed", range(3))
def test_noisy_moduli__leave_the_creep_at_early_times(seed):
    """A term faster than the first row is hardly seen there, and would make the material as stiff as it likes."""
    noise = 1 + 0.02 * np.random.default_rng(seed).standard_normal((3, 60))
    t, omega = np.geomspace(1e-4, 100.0, 60), np.geomspace(1e-2, 1e4, 60)
    storage, loss = dynamic(omega)
    assert distance(rv.relaxation_table(t, relaxation(t) * noise[0], poisson=0.4, kind="shear")) < 0.04
    moduli = storage * noise[1], loss * noise[2]
    assert distance(rv.dynamic_table(omega, *moduli, frequency_unit="rad/s", poisson=0.4, kind="shear")) < 0.03


WIDE = {
    "power": lambda t: 1e5 + 1e6 * t**-0.3,
    "stretched": lambda t: 1e5 + 2e6 * np.exp(-((t / 0.1) ** 0.4)),
    "logarithm": lambda t: 2e6 / (1 + 0.3 * np.log1p(t / 1e-4)),
}


@pytest.mark.parametrize(("rows", "most"), [(6, 0.05), (12, 4e-3), (30, 1e-3)])
@pytest.mark.parametrize("name", WIDE)
def test_relaxation_table__follows_a_wide_spectrum_between_few_rows(name, rows, most):
    """The terms that meet the rows with the fewest would be up to 33 % off."""
    t, between = np.geomspace(1e-4, 1e2, rows), np.geomspace(1e-4, 1e2, 500)
    material = rv.relaxation_table(t, WIDE[name](t), kind="shear")
    assert np.abs(modulus(material, between) / WIDE[name](between) - 1).max() <= most


@pytest.mark.parametrize("exponent", [0.2, 0.5])
def test_relaxation_table__goes_on_before_its_first_row(exponent):
    """A power law: without earlier rows the compliance at the first one would be 10 and 30 % too large."""
    times = np.geomspace(1e-10, 1e5, 150)
    moduli = times**-exponent
    exact = rv.from_relaxation(0.01, moduli, times)
    t = np.geomspace(0.01, 100.0, 40)
    material = rv.relaxation_table(t, 0.01 + np.exp(-t[:, None] / times) @ moduli, kind="shear")
    assert off(material, exact.creep_compliance, t) < 0.06
    assert "modulus extrapolated" in material.note
    flat = rv.relaxation_table(t, 1.0 + np.exp(-t), kind="shear")
    assert off(flat, rv.from_relaxation(1.0, [1.0], [1.0]).creep_compliance, t) < 2e-3


@pytest.mark.parametrize(("unit", "factor"), [("rad/s", 1.0), ("Hz", 2 * np.pi)])
def test_dynamic_table__finds_the_creep(unit, factor):
    omega = np.geomspace(1e-2, 1e4, 60)
    material = rv.dynamic_table(omega / factor, *dynamic(omega), frequency_unit=unit, poisson=0.4, kind="shear")
    assert distance(material) < 0.01
    assert stated_misfit(material) < 0.02
    assert material.note.startswith(f"{len(material.times) + 1} terms fitted to 120 values")
    assert material.note.endswith("frequencies 0.01 to 10000 rad/s")


def test_tables__in_tension_are_those_in_shear():
    """Young's modulus is ``2 (1 + poisson)`` times the shear modulus."""
    t, omega = np.geomspace(1e-3, 10.0, 40), np.geomspace(1e-2, 1e4, 60)
    tension, unit = {"kind": "tensile", "poisson": 0.3}, {"frequency_unit": "rad/s"}
    creep, moduli, (storage, loss) = EXACT.creep_compliance(t), relaxation(t), dynamic(omega)
    for shear, tensile in (
        (rv.creep_table(t, creep, poisson=0.3, kind="shear"), rv.creep_table(t, creep / 2.6, **tension)),
        (rv.relaxation_table(t, moduli, poisson=0.3, kind="shear"), rv.relaxation_table(t, 2.6 * moduli, **tension)),
        (
            rv.dynamic_table(omega, storage, loss, poisson=0.3, **unit, kind="shear"),
            rv.dynamic_table(omega, 2.6 * storage, 2.6 * loss, **unit, **tension),
        ),
    ):
        assert tensile.contact_compliance(t) == pytest.approx(shear.contact_compliance(t), rel=1e-6, abs=0)


def test_dynamic_table__shift_factors_make_a_master_curve():
    """Three temperatures, each over two decades, in any order."""
    window = np.geomspace(1.0, 100.0, 15)
    shifts = np.repeat([1.0, 1e-2, 1e2], 15)
    frequencies = np.tile(window, 3)
    material = rv.dynamic_table(
        frequencies,
        *dynamic(frequencies * shifts),
        frequency_unit="rad/s",
        shift_factors=shifts,
        poisson=0.4,
        kind="shear",
    )
    assert distance(material) < 0.01
    assert material.note.endswith("frequencies 0.01 to 10000 rad/s")
    same = rv.dynamic_table(
        window, *dynamic(window * 10), frequency_unit="rad/s", shift_factors=10.0, poisson=0.4, kind="shear"
    )
    assert same == rv.dynamic_table(
        window * 10, *dynamic(window * 10), frequency_unit="rad/s", poisson=0.4, kind="shear"
    )


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: rv.creep_table((0, 1, 2), (1, -2, 3), kind="shear"),
            r"table row 1: compliance is -2: expected at least",
        ),
        (lambda: rv.creep_table((0, 1, 2), (1, 2, np.nan), kind="shear"), r"table row 2: compliance is nan"),
        (lambda: rv.creep_table((0, np.inf, 2), (1, 2, 3), kind="shear"), r"table row 1: time is inf"),
        (
            lambda: rv.creep_table((0, 2, 1), (1, 2, 3), kind="shear"),
            r"table row 2: time 1 after 2: expected ascending time",
        ),
        (lambda: rv.creep_table((0, 2, 2), (1, 2, 5), kind="shear"), r"table row 1: other compliance than a row with"),
        (
            lambda: rv.creep_table((0, 1), (1, 2, 3), kind="shear"),
            r"table has 2 of time, 3 of compliance: expected as many",
        ),
        (lambda: rv.creep_table((1,), (1,), kind="shear"), r"at least two"),
        (lambda: rv.creep_table((0, 1, 2), (1, 2, 1.9), kind="shear"), r"table row 2: .* 5\.00% below an earlier row"),
        (lambda: rv.creep_table((1, 1), (4, 4), kind="shear"), r"at least two"),
        (lambda: rv.creep_table((0, 1, 2), (0, -1, 4), kind="shear"), r"table row 1: compliance is -1"),
        (lambda: rv.creep_table((0, 1), (1, -2), kind="tensile"), r"table row 1: compliance is -2"),
        (
            lambda: rv.relaxation_table((0, 2, 1), (3, 2, 1), kind="shear"),
            r"table row 2: time 1 after 2: expected ascending",
        ),
        (
            lambda: rv.relaxation_table((0, 1), (1, -0.1), kind="shear"),
            r"table row 1: modulus is -0.1: expected at least",
        ),
        (lambda: rv.relaxation_table((0, 1), (0, 1), kind="shear"), r"table row 0: modulus is 0 at time zero"),
        (lambda: rv.relaxation_table((0, 1), (1, np.nan), kind="shear"), r"table row 1: modulus is nan"),
        (
            lambda: rv.dynamic_table((1, 2), (1, 2), (1, 2), frequency_unit="1/s", kind="shear"),
            "frequency_unit: found '1/s'",
        ),
        (
            lambda: rv.dynamic_table((1, 0), (1, 2), (1, 2), frequency_unit="Hz", kind="shear"),
            r"table row 1: a frequency, a shift",
        ),
        (
            lambda: rv.dynamic_table((1, 2), (0, 2), (0, 2), frequency_unit="Hz", kind="shear"),
            r"table row 0: .* both moduli are 0",
        ),
        (
            lambda: rv.dynamic_table((1, 2), (1, 2), (1, -2), frequency_unit="Hz", kind="shear"),
            r"table row 1: loss modulus is -2",
        ),
        (
            lambda: rv.dynamic_table((1, 2), (1, 2), (1, 2), frequency_unit="Hz", shift_factors=(1,), kind="shear"),
            r"2 of frequency, 2 of storage modulus, 2 of loss modulus, 1 of shift factor: expected as many",
        ),
    ],
)
def test_bad_input__is_named(make, message):
    with pytest.raises(InputError, match=message):
        make()


@pytest.mark.parametrize("step", [10.0, 100.0])
def test_rows_more_than_a_decade_apart__are_a_warning(step):
    """Three rows over six decades of a power law gave approaches 0.74 to 1.16 times as large as the true ones."""
    t = step ** np.arange(4.0)
    tables = rv.creep_table(t, t**0.3, kind="shear"), rv.relaxation_table(t, t**-0.3, kind="shear")
    tables += (
        rv.dynamic_table(1 / t, *dynamic(1 / t), frequency_unit="rad/s", kind="shear"),
        rv.pair(tables[0], rv.elastic(1.0)),
    )
    for material in tables:
        assert ("between 1 s and 100 s" in material.warning) == (step > 10)
        assert bool(material.warning) == (step > 10)


# --- several temperatures -------------------------------------------------------------------------------------------


def test_several_temperatures_or_amplitudes__in_one_table_are_refused():
    """Times fall back, frequencies return with other moduli anywhere in the table, or all rows have one frequency."""
    window = np.geomspace(1e-2, 10.0, 12)
    times, shifts = np.tile(window, 3), np.repeat([1.0, 1e-2, 1e2], 12)
    storage, loss = dynamic(times * shifts)
    by_frequency = np.argsort(times, kind="stable")
    softer = np.repeat([1.0, 0.89], 12)  # of a second temperature, after the first
    for make, remedy in (
        (lambda: rv.relaxation_table(times, relaxation(times * shifts), kind="shear"), "temperature"),
        (lambda: rv.creep_table(times, 1e-6 * (1 + (times * shifts) ** 0.3), noise=0.9, kind="shear"), "part"),
        (lambda: rv.dynamic_table(times, storage, loss, frequency_unit="Hz", kind="shear"), "temperature"),
        (
            lambda: rv.dynamic_table(
                *(one[by_frequency] for one in (times, storage, loss)), frequency_unit="Hz", kind="shear"
            ),
            "part",
        ),
        (
            lambda: rv.dynamic_table(
                np.tile(window, 2),
                *(np.tile(one, 2) * softer for one in dynamic(window)),
                frequency_unit="Hz",
                kind="shear",
            ),
            "temperature",
        ),
        (
            lambda: rv.dynamic_table([10.0] * 5, [5e6] * 5, [1e6] * 5, frequency_unit="Hz", kind="shear"),
            "several frequencies.*part",
        ),
    ):
        with pytest.raises(InputError, match=f"table.*: .*{remedy}"):
            make()


def test_misfit_above_the_noise__is_a_warning():
    """Storage and loss of two materials, and a modulus that falls faster than any passive one."""
    t, omega = np.geomspace(1e-3, 10.0, 30), np.geomspace(1e-2, 1e4, 40)
    storage, loss = dynamic(omega)
    kept = {"kind": "shear", "poisson": 0.4}
    for make, good, bad in (
        (lambda m, **keys: rv.relaxation_table(t, m, **kept, **keys), relaxation(t), 1e5 + 1e6 * (t < 0.1)),
        (lambda m, **keys: rv.dynamic_table(omega, storage, m, frequency_unit="rad/s", **kept, **keys), loss, 3 * loss),
    ):
        assert make(good).warning == ""
        stated = float(re.search(r"deviate by ([\d.]+) \(rms", make(bad).warning)[1])
        assert 0.1 < stated < 0.7
        assert make(bad, noise=1.05 * stated).warning == ""


def test_creep_as_recorded__is_averaged_at_equal_times_and_starts_after_rows_at_most_zero():
    t = np.round(np.geomspace(0.01, 100.0, 150), 2)
    exact = CREEP["power"](t)
    recorded = exact.copy()
    recorded[t < 0.03] = [-0.01, *np.zeros(np.count_nonzero(t < 0.03) - 1)]
    material = rv.creep_table(t, recorded, kind="shear", noise=0.01)
    assert off(material, CREEP["power"], t[t >= 0.03]) < 0.02
    assert f"{np.count_nonzero(t < 0.03)} rows at most zero left out" in material.note
    assert "rows of equal times averaged" in material.note


def test_relaxation_down_to_the_noise__keeps_the_creep():
    """Absolute noise of 1e-4 of the largest modulus, with negative rows."""
    t = np.geomspace(1e-3, 30.0, 90)
    noisy = np.exp(-t[:, None] / TIMES) @ MODULI + 1e-4 * MODULI.sum() * np.random.default_rng(2).standard_normal(90)
    assert noisy.min() < 0
    exact, material = rv.from_relaxation(0.0, MODULI, TIMES), rv.relaxation_table(t, noisy, kind="shear", noise=0.01)
    early = np.geomspace(1e-3, 30.0, 50)
    assert material.contact_compliance(early) == pytest.approx(exact.contact_compliance(early), rel=0.02)
    assert material.warning == ""


def test_repeated_frequencies__of_one_temperature_are_fitted():
    omega = np.tile(np.geomspace(1e-2, 1e4, 40), 2)
    noise = 1 + 0.02 * np.random.default_rng(1).standard_normal((2, 80))
    storage, loss = dynamic(omega)
    assert (
        distance(
            rv.dynamic_table(
                omega, storage * noise[0], loss * noise[1], frequency_unit="rad/s", poisson=0.4, kind="shear"
            )
        )
        < 0.03
    )
