"""Materials of the user's own: any creep compliance and its integral, by a series."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from references.reduction import reduced_contact
from scipy.special import gammainc

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.mechanics.closed_forms import Paraboloid, lee_radok_step
from roughvisc.mechanics.hereditary.choice import choose_memory
from roughvisc.mechanics.materials.models import Material
from roughvisc.mechanics.materials.protocol import complete, mean_of
from roughvisc.mechanics.materials.series import series_of


@dataclass(frozen=True)
class Stretched:
    """Kohlrausch, Williams and Watts: ``C = glassy + creep (1 - exp(-(t/time)^exponent))``."""

    glassy: float = 1e-7
    creep: float = 3e-7
    time: float = 0.2
    exponent: float = 0.5

    def contact_compliance(self, t):
        return self.glassy - self.creep * np.expm1(-((t / self.time) ** self.exponent))

    def contact_integral(self, t):
        power = 1 / self.exponent
        left = self.time * power * math.gamma(power) * gammainc(power, (t / self.time) ** self.exponent)
        return (self.glassy + self.creep) * t - self.creep * left


@dataclass(frozen=True)
class Logarithmic:
    """``C = glassy + slope log(1 + t/time)``, with all that a material may say."""

    glassy: float = 1e-7
    slope: float = 5e-8
    time: float = 1e-3
    poisson: float = 0.4
    note: str = "logarithmic creep"

    def contact_compliance(self, t):
        return self.glassy + self.slope * np.log1p(t / self.time)

    def contact_integral(self, t):
        return self.glassy * t + self.slope * ((t + self.time) * np.log1p(t / self.time) - t)


class Inherited(Material):
    """What is left out comes from the protocol."""

    def contact_compliance(self, t):
        return Stretched().contact_compliance(t)

    def contact_integral(self, t):
        return Stretched().contact_integral(t)


RADIUS = 1e-3
BALL = rv.sphere(RADIUS, 2e-4, (45, 41))
STEP = rv.Program().load(1e-3, over=0).hold(2.0)
OWN = [Stretched(), Logarithmic()]


def pressed(material, program=STEP, **settings):
    given = {"times": [0.0, 0.01, 0.3, 2.0], "tolerance": 1e-3, "progress": False, "fields": ()}
    return rv.simulate(BALL, material, program, **{**given, **settings})


@pytest.mark.parametrize("material", [*OWN, Inherited()], ids=lambda m: type(m).__name__)
def test_a_step_load__has_the_approach_of_the_compliance_then(material):
    """Lee and Radok: while the contact grows, it is the elastic one of the compliance then, on any grid."""
    ds = pressed(material)
    compliance = material.contact_compliance(ds.time.values)
    first = rv.Program().load(1e-3, over=0)
    on_this_grid = [
        float(pressed(rv.elastic(1 / (4 * c)), first, times=[0.0], tolerance=1e-4).approach[0]) for c in compliance
    ]
    assert ds.approach.values == pytest.approx(on_this_grid, rel=1e-3)
    assert ds.approach.values == pytest.approx(
        lee_radok_step(RADIUS, material, 1e-3).approach(ds.time.values), rel=0.02
    )
    power = (ds.approach.values / ds.approach.values[0]) ** 1.5
    assert power == pytest.approx(compliance / compliance[0], rel=0.02)
    assert (ds.stated_error.values <= 1e-3).all()
    assert 0 < ds.attrs["series_error"] <= 1e-4
    assert "exponentials" in ds.attrs["memory"]
    assert "in place of the compliance" in ds.attrs["memory"]


@pytest.mark.thorough
@pytest.mark.parametrize("material", OWN, ids=lambda m: type(m).__name__)
def test_a_cycle__is_that_of_all_past_forces_without_a_series(material):
    """The method of dimensionality reduction, with the material's own compliance and integral."""
    program = rv.Program().load(1e-3, over=0.2).load(3e-4, over=0.2).hold(0.4)
    times = [0.1, 0.2, 0.4, 0.8]
    exact = reduced_contact(Paraboloid(RADIUS), complete(material), program, times, steps=60, elements=2000)
    assert exact.error < 1e-5
    ds = pressed(material, program, times=times)
    # a tolerance, and the grid: about 4 % of the square of a cell over the contact radius, which is ten cells
    assert ds.approach.values == pytest.approx(exact.approach, rel=2e-3)
    assert ds.work.values == pytest.approx(exact.work, rel=2e-3)
    assert np.sqrt(ds.contact_area.values / np.pi) == pytest.approx(exact.radius, rel=0.02)


@pytest.mark.parametrize("material", OWN, ids=lambda m: type(m).__name__)
@pytest.mark.parametrize("shortest", [1e-8, 1e-4])
def test_the_series__is_within_the_tolerance_between_its_samples(material, shortest):
    series = series_of(material, shortest, 10.0, 1e-4)
    t = np.append(0.0, np.geomspace(shortest, 10.0, 3001))
    assert series.prony.contact_compliance(t) == pytest.approx(material.contact_compliance(t), rel=1.05e-4)
    assert series.error <= 1e-4
    assert series.prony.poisson == getattr(material, "poisson", 0.5)
    assert series.repair == ""


def test_no_compliance_at_once__has_a_series_too():
    material = Stretched(glassy=0.0)
    series = series_of(material, 1e-6, 10.0, 1e-4)
    assert series.prony.glassy == 0
    assert series.error <= 1e-4


@pytest.mark.parametrize("s", [0.0, 1e-9, 0.3, 1e6])
def test_means__keep_their_digits(s):
    known = rv.zener(1e6, 5e5, 1e5)
    h = np.array([0.0, 1e-12, 1e-6, 0.02, 0.5, 40.0]) if s else np.array([1e-12, 1e-6, 0.02, 0.5, 40.0])
    found = mean_of(known.contact_compliance, known.contact_integral, s, h)
    assert found == pytest.approx(known.mean_contact_compliance(s, h), rel=1e-13)


def test_a_pair__takes_one():
    both = rv.pair(Stretched(), rv.zener(1e6, 1e6, 1e5))
    alone = Stretched()
    t = np.array([0.0, 0.1, 2.0])
    rest = rv.zener(1e6, 1e6, 1e5).contact_compliance(t)
    assert both.contact_compliance(t) == pytest.approx(alone.contact_compliance(t) + rest)
    choice = choose_memory(both, 2.0, 1e-3)
    assert choice.series_error <= 1e-4
    assert choice.material.contact_compliance(t) == pytest.approx(both.contact_compliance(t), rel=1e-4)


def test_a_compliance_of_no_passive_material__is_said_to_be_none():
    class Late(Stretched):  # a delay: no positive sum of exponentials
        def contact_compliance(self, t):
            return 1e-7 + 1e-7 * np.clip((np.asarray(t) - 0.1) / 0.01, 0, 1)

        def contact_integral(self, t):
            late = np.clip(np.asarray(t) - 0.1, 0, 0.01)
            return 1e-7 * t + 1e-7 * (late**2 / 0.02 + np.maximum(np.asarray(t) - 0.11, 0))

    ds = pressed(Late())
    assert ds.attrs["series_error"] > 1e-2
    assert (ds.stated_error.values > 1e-2).all()
    assert "the material is not passive" in ds.attrs["memory"]


def changed(**functions):
    return type("Wrong", (Stretched,), {name: lambda self, t, f=f: f(t) for name, f in functions.items()})()


@pytest.mark.parametrize(
    ("material", "words"),
    [
        (3.0, "material is a float: expected one of roughvisc's materials, or an object with contact_compliance"),
        (type("Half", (), {"contact_compliance": lambda self, t: t})(), "it has no contact_integral"),
        (changed(contact_compliance=lambda t: -1.0 - t), r"contact_compliance is -1 at 0 s: expected no negative"),
        (changed(contact_compliance=lambda t: t * np.nan), r"contact_compliance is nan at 0 s"),
        (changed(contact_compliance=lambda t: 1 / (1 + t)), r"contact_compliance is .*: expected no less than before"),
        (changed(contact_compliance=lambda t: 1e-7), r"gives \(\) of .* times: expected a number each"),
        (changed(contact_integral=lambda t: 1.01 * Stretched().contact_integral(t)), r"expected the antiderivative"),
        (changed(contact_integral=lambda t: 1e-9 + Stretched().contact_integral(t)), r"1e-09 at 0 s: expected the"),
        (changed(contact_compliance=lambda t: 0 * t, contact_integral=lambda t: 0 * t), "is 0 at .* expected creep"),
        (Logarithmic(poisson=0.7), "poisson is 0.7: expected a number above -1"),
    ],
)
def test_what_is_no_material__is_refused(material, words):
    with pytest.raises(InputError, match=words):
        pressed(material)
