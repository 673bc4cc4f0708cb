"""Which memory models a material, and what it says of itself."""

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.mechanics.engine import SERIES_SHARE, engine_for
from roughvisc.mechanics.history import History
from roughvisc.mechanics.memory import Modes

ROWS = np.geomspace(1e-3, 10.0, 40)
NOISY = 1 + 0.01 * np.random.default_rng(1).standard_normal(40)


@pytest.mark.parametrize(
    ("material", "note"),
    [
        (rv.elastic(1.0), "no memory: elastic"),
        (rv.zener(1.0, 1.0, 1.0), "1 exponential"),
        (rv.maxwell(1.0, 1.0), "a fluidity"),
        (rv.Prony(1.0, 1.0, (1.0, 2.0), (1.0, 3.0)), "2 exponentials and a fluidity"),
    ],
)
def test_series__is_its_own_memory(material, note):
    engine = engine_for(material, 10.0, 1e-3)
    assert isinstance(engine.memory, Modes)
    assert engine.memory.material is material
    assert (engine.series_error, engine.note) == (0.0, note)


@pytest.mark.parametrize("exponent", [0.2, 0.5, 0.8])
def test_power_law__has_a_certified_series(exponent):
    material = rv.PowerLaw(0.1, 1.0, exponent)
    engine = engine_for(material, 10.0, 1e-3)
    assert isinstance(engine.memory, Modes)
    assert engine.series_error <= SERIES_SHARE * 1e-3
    t = np.geomspace(1e-5, 10.0, 777)
    off = engine.memory.material.contact_compliance(t) / material.contact_compliance(t) - 1
    assert np.abs(off).max() <= 1.02 * engine.series_error


def test_noisy_table__gets_the_direct_history_and_says_why():
    material = rv.Tabulated(tuple(ROWS), tuple((0.5 + ROWS**0.4) * NOISY), noise=0.1)
    engine = engine_for(material, 10.0, 1e-3)
    assert isinstance(engine.memory, History)
    assert "missed the tolerance" in engine.note


def test_table_without_instantaneous_compliance__gets_the_best_series_with_its_error():
    material = rv.Tabulated((0.0, *ROWS), (0.0, *(ROWS**0.4 * np.maximum.accumulate(NOISY))), noise=0.1)
    engine = engine_for(material, 10.0, 1e-3)
    assert isinstance(engine.memory, Modes)
    assert engine.series_error > SERIES_SHARE * 1e-3
    assert f"{engine.series_error:.1e}" in engine.note


def test_table_shorter_than_the_program__is_refused():
    material = rv.Tabulated(tuple(ROWS), tuple(0.5 + ROWS**0.4))
    with pytest.raises(rv.InputError, match="the table ends at 10 s"):
        engine_for(material, 11.0, 1e-3)
