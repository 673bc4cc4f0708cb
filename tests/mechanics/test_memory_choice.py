"""Which memory models a material, and the error that it states."""

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.labels import warnings_of
from roughvisc.mechanics.memory_choice import choose_memory

ROWS = np.geomspace(1e-3, 10.0, 40)
NOISY = 1 + 0.01 * np.random.default_rng(1).standard_normal(40)


@pytest.mark.parametrize(
    "material",
    [
        rv.power_law(0.1, 1.0, 0.3, poisson=0.2),
        rv.power_law(0.0, 1.0, 0.3),
        rv.creep_table((0.0, 1.0, 2.0), (0.3, 1.0, 2.0)),
        rv.pair(rv.power_law(0.1, 1.0, 0.3, poisson=0.3), rv.zener(1.0, 1.0, 1.0)),
    ],
    ids=["power law", "no compliance at once", "table", "pair"],
)
def test_jumps_alone__need_the_instantaneous_compliance_only(material):
    choice = choose_memory(material, 0.0, 1e-3, 0.0)
    assert choice.series_error == 0
    exact = float(material.contact_compliance(0.0))
    assert choice.memory.series.contact_compliance(0.0) == pytest.approx(exact, rel=1e-15)
    if exact:
        assert choice.memory.series.contact_compliance(1.0) == pytest.approx(exact, rel=1e-15)


def test_table_far_from_any_passive_material__is_warned_of():
    """Creep that gathers speed; noise within what was said to be noise is none."""
    times = np.linspace(0.0, 1.0, 21)
    gathering = rv.creep_table(times, 1 + 20 * np.maximum(times - 0.3, 0))
    choice = choose_memory(gathering, 1.0, 1e-3, 1e-6)
    rows = choice.memory.series.creep_compliance(times) / (1 + 20 * np.maximum(times - 0.3, 0)) - 1
    assert choice.misfit == pytest.approx(np.abs(rows).max(), rel=1e-12)
    assert choice.misfit > 0.1
    noisy = rv.creep_table(ROWS, ROWS**0.4 * NOISY, noise=0.1)
    ball = rv.sphere(1e-3, 2e-4, 9)
    for material, duration, tolerance, is_warned in (
        (gathering, 1.0, 1e-3, True),
        (gathering, 1.0, 0.99, False),
        (noisy, 10.0, 1e-3, False),
    ):
        press = rv.Program().load(1e-12, over=0).hold(duration)
        ds = rv.simulate(ball, material, press, times=1, tolerance=tolerance, progress=False)
        assert ("no passive material" in warnings_of(ds.attrs).get("series", "")) is is_warned
