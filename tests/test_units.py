"""Quantities with units: their conversion to SI units, what is refused, and the unit in which values are shown."""

import contextlib
import math

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from support import refused

from roughvisc.errors import InputError
from roughvisc.units import number, unit_for

PREFIXES = {"f": -15, "p": -12, "n": -9, "u": -6, "µ": -6, "m": -3, "": 0, "k": 3, "M": 6, "G": 9, "T": 12}
UNITS = st.sampled_from(["m", "N", "Pa", "s", "Pa s"])


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [
        ("10um", "m", 1e-5),
        ("10 μm", "m", 1e-5),  # the other Greek mu
        ("-3.5 nm", "m", -3.5e-9),
        ("1 Em", "m", 1e18),
        ("1 inch", "m", 0.0254),
        ("0.1 MPa*s", "Pa s", 1e5),
        ("2 s kPa", "Pa s", 2e3),
        ("3 N/m^2", "Pa", 3.0),
        ("3 N/m²", "Pa", 3.0),
        ("3 N/mm2", "Pa", 3e6),
        ("5 s-1", "1/s", 5.0),
        ("1 hPa", "Pa", 100.0),
        ("2 kg m/s^2", "N", 2.0),
        ("2 min", "s", 120.0),
        ("0.3", "1", 0.3),
        ("50 %", "1", 0.5),
        ("5 MPa/MPa", "1", 5.0),
        ("1e3 Hz", "1/s", 1e3),
        ("180 degree", "rad", math.pi),
        ("20 degC", "K", 293.15),
        ("5 delta_degC", "K", 5.0),
        ("0.2 W/m/degC", "W/m/K", 0.2),
    ],
)
def test_number__reads_number_and_unit(text, unit, expected):
    assert number(text, unit) == pytest.approx(expected, rel=2e-15)


@given(st.decimals(min_value="0.001", max_value="9999", places=3), st.sampled_from([*PREFIXES]), UNITS)
def test_number__is_the_float_that_a_person_would_write(value, prefix, unit):
    assert number(f"{value} {prefix}{unit}", unit) == float(f"{value}e{PREFIXES[prefix]}")


@pytest.mark.parametrize("value", [3, 3.0, np.float64(3), np.int32(3), np.array(3.0), xr.DataArray(3.0)])
def test_number__of_a_plain_number_is_a_float(value):
    assert number(value, "m") == 3.0
    assert type(number(value, "m")) is float


@pytest.mark.parametrize(
    ("value", "unit"),
    [
        *(
            (f"1 {unit}", "m")
            for unit in ("smm", "mkm", "Mkg", "mm/s", "k", "N", "s", "bananas", "nan", "m^0", "abohm^0")
        ),
        *((f"1 {unit}", "m") for unit in ("m \u037a", "dB^2", "dBW")),
        ("3 Pa", "Pa s"),
        ("3 degC^2", "K"),
        ("45 degree", "1"),
        *((text, "m") for text in ("3", "um", "", "3 + 4 m", "1e999 m", "nan m")),
        *((value, "m") for value in (True, None, [1], math.nan, math.inf)),
    ],
)
def test_number__of_another_kind_is_refused(value, unit):
    with refused("radius", value):
        number(value, unit, "radius")


@pytest.mark.timeout(60)
@pytest.mark.parametrize(
    "text",
    ["9**9**9**9 m", "1 m**9**9**9", "1 " + "m " * 40_000, "1 m^99999999", "1 " + "a" * 90, "1 " + "a" * 90 + "!"],
)
def test_number__does_not_hang_on_hostile_text(text):
    with refused(found=text):
        number(text, "m")


@given(st.text(max_size=40))
def test_number__of_any_text_is_finite_or_an_input_error(text):
    with contextlib.suppress(InputError):
        assert math.isfinite(number(text, "m"))


@pytest.mark.parametrize(
    ("value", "bounds"),
    [
        (0, {"above": 0}),
        (2.0, {"above": 2}),
        (1e-320, {"above": 0}),  # no double is its reciprocal
        ("-1 mm", {"least": 0}),
        (0.7, {"above": 0, "most": 0.5}),
        (1.0, {"least": 0, "below": 1}),
        (np.float32(2.0), {"most": 1}),
    ],
)
def test_number__outside_its_bounds_is_refused(value, bounds):
    with refused("radius", value):
        number(value, "m", "radius", **bounds)


def test_number__states_its_limit_in_a_suitable_unit():
    with pytest.raises(InputError) as refusal:
        number(1e-6, "m", "cutoff", least=6.25e-5)
    assert "62.5 µm" in str(refusal.value)


@pytest.mark.parametrize(
    ("values", "si", "text"),
    [
        ([3e-9], "m", "3 nm"),
        ([-2e-6, 1e-9], "m", "2 µm"),
        ([0.9999999], "N", "1 N"),
        ([999.0], "N", "999 N"),
        ([4e5], "N/m", "400 kN/m"),
        ([0.05e-6], "m^2", "0.05 mm²"),
        ([7200.0], "s", "2 h"),
        ([3000.0], "s", "3000 s"),
        ([3 * 86400.0], "s", "3 d"),
        ([2e-5], "J", "20 µJ"),
        ([0.0, np.nan], "Pa", "0 Pa"),
        ([2e5], "Pa s", "200 kPa s"),
        ([4e-7], "1/Pa", "0.4 1/MPa"),
        ([2e-5], "1/(Pa s)", "20 1/(MPa s)"),
        ([0.0], "1/Pa", "0 1/Pa"),
        ([0.25], "1", "0.25"),
    ],
)
def test_unit_for__reads_well(values, si, text):
    assert unit_for(values, si).text(np.nanmax(np.abs(values))) == text
