"""Domain of a free contact: what it holds, and that a run which outgrows it begins anew."""

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.experiment import profile as domain

ZENER, TOLERANCE = rv.zener(1e6, 5e5, 1e5), 3e-3
PRESS = rv.Program().load(2e-5, over=0.2).hold(0.5)
SETTINGS = {"boundary": "free", "times": 4, "tolerance": TOLERANCE, "fields": ("pressure", "gap", "displacement")}


def bump(shape=(121, 104)):
    """A scan with one hill, beside its middle, and waves upon it."""
    x, y = (1e-6 * (np.arange(n) - 0.4 * n) for n in shape)
    hill = -(x[:, None] ** 2 + y**2) / 2e-3
    waves = 2e-9 * np.cos(x[:, None] / 2e-6) * np.cos(y / 3e-6)
    return rv.from_array(hill + waves, spacing=1e-6)


def pressed(height, **settings):
    return rv.simulate(height, ZENER, PRESS, progress=False, **{**SETTINGS, **settings})


def assert_same(found, whole):
    depth, force = float(whole.approach.max()), float(whole.force.max())
    area = 1e-12
    assert found.sizes == whole.sizes
    assert np.abs(found.approach - whole.approach).max() <= 2 * TOLERANCE * depth
    assert (np.abs(found.pressure - whole.pressure).sum(("x", "y")) * area).max() <= 2 * TOLERANCE * force
    for field in ("gap", "displacement"):
        assert np.abs(found[field] - whole[field]).max() <= 1e-2 * depth
    assert found.mean_gap.values == pytest.approx(found.gap.mean(("x", "y")).values, rel=1e-6)


def test_contact_that_outgrows_its_domain__begins_anew(monkeypatch):
    whole = pressed(bump())
    anew = []
    monkeypatch.setattr(domain, "MARGIN", 0.4)
    monkeypatch.setattr("roughvisc.solve.Recorder.restart", counted(anew))
    assert_same(pressed(bump()), whole)
    assert anew, "the first domain was too small"


def counted(calls):
    from roughvisc.solve import Recorder

    sound = Recorder.restart
    return lambda self: calls.append(self) or sound(self)


def test_indenter__gets_a_surface_as_large_as_its_contact():
    small = rv.sphere(1e-3, 2e-5, 21)
    found = pressed(small, fields=("pressure",))
    assert found.sizes["x"] > 21
    pressure = found.pressure.values[-1]
    assert not any(line.any() for line in (pressure[0], pressure[-1], pressure[:, 0], pressure[:, -1]))
    assert float(found.nominal_pressure[-1]) == pytest.approx(2e-5 / 2e-5**2, rel=1e-9)
