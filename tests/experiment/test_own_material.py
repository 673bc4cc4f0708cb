"""Materials by a creep function of the user, which the solver replaces by a series."""

import numpy as np
import pytest
from support import refused

import roughvisc as rv
from roughvisc.errors import InputError

#: Contact compliances ``(1 - nu) J / 2``: Kohlrausch, Williams and Watts, with a singular rate; and without an end.
CURVES = {
    "stretched": lambda t: 1e-7 - 3e-7 * np.expm1(-np.sqrt(t / 0.2)),
    "logarithmic": lambda t: 1e-7 + 5e-8 * np.log1p(t / 1e-3),
}


def of(curve, poisson=0.5):
    return rv.creep(lambda t: 2 / (1 - poisson) * curve(t), poisson)


RADIUS = 1e-3
BALL = rv.sphere(RADIUS, 2e-4, (45, 41))
STEP = rv.Program().load(1e-3, over=0).hold(2.0)


def pressed(material, program=STEP, **settings):
    given = {"times": [0.0, 0.01, 0.3, 2.0], "tolerance": 1e-3, "progress": False, "fields": ()}
    return rv.simulate(BALL, material, program, **{**given, **settings})


@pytest.mark.parametrize("curve", CURVES.values(), ids=CURVES)
def test_a_step_load__has_the_approach_of_the_compliance_then(curve):
    """Lee and Radok: while the contact grows, it is the elastic one of the compliance then, on any grid."""
    material = of(curve)
    ds = pressed(material)
    compliance = curve(ds.time.values)
    first = rv.Program().load(1e-3, over=0)
    on_this_grid = [
        float(pressed(rv.elastic(1 / (4 * c)), first, times=[0.0], tolerance=1e-4).approach[0]) for c in compliance
    ]
    assert ds.approach.values == pytest.approx(on_this_grid, rel=1e-3)
    assert (ds.stated_error.values <= 1e-3).all()
    assert 0 < ds.attrs["series_error"] <= 1e-4


def test_a_compliance_of_no_passive_material__is_said_to_be_none():
    # a delay: no positive sum of exponentials
    ds = pressed(rv.creep(lambda t: 4e-7 + 4e-7 * np.clip((t - 0.1) / 0.01, 0, 1)))
    assert ds.attrs["series_error"] > 1e-2
    assert (ds.stated_error.values > 1e-2).all()
    assert "the material is not passive" in ds.attrs["memory"]


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (lambda t: -4.0 - t, r"creep of .*lambda.* is -4 1/Pa at 0 s"),
        (lambda t: 1 / (1 + t), r"is 0\.9\d* 1/Pa at .*no less than before"),
        (lambda t: 1e-7, "expected a number each"),
        (lambda t: 0 * t, "is 0 1/Pa at .* expected a positive compliance"),
    ],
)
def test_what_is_no_creep__is_refused(function, words):
    with pytest.raises(InputError, match=words):
        pressed(rv.creep(function))


def test_creep__refuses():
    with refused("poisson", 0.7):
        rv.creep(np.sqrt, poisson=0.7)
    with refused("function", 3.0):
        rv.creep(3.0)


@pytest.mark.parametrize("material", [3.0, np.sqrt], ids=["number", "function"])
def test_what_is_no_material__is_refused(material):
    for use in (pressed, lambda one: rv.pair(one, rv.elastic(1.0)), lambda one: rv.shift(one, 2.0)):
        with refused("material", material):
            use(material)
