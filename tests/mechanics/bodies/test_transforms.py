"""Transforms by SciPy and by ducc0: the same numbers, with the same arguments; which of them is taken."""

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.mechanics.bodies import ducc, transforms
from roughvisc.mechanics.bodies.body import Body
from roughvisc.mechanics.bodies.half_space import HALF_SPACE
from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.bodies.transforms import transform_library
from roughvisc.mechanics.bodies.window import FarFieldDisplacement, Window
from roughvisc.mechanics.sliding.steady import Sliding

SHAPES = [(9, 15), (8, 14), (1, 11), (7, 1), (36, 25)]


@pytest.fixture
def by_ducc0(monkeypatch):
    monkeypatch.delenv("ROUGHVISC_TRANSFORMS")
    assert transform_library().startswith("ducc0 ")


@pytest.mark.parametrize("kind", [np.float64, np.float32])
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("mirrored", [False, True])
def test_ducc0__gives_what_scipy_gives(mirrored, shape, kind):
    theirs, ours = transforms._SCIPY[mirrored], transforms._DUCC0[mirrored]
    field = np.random.default_rng(2).standard_normal(shape).astype(kind)
    (nx, ny), longer = shape, (2 * shape[0] + 1, shape[1] + 3)
    precision = 1e-14 if kind == np.float64 else 1e-5

    def agree(name, x, **given):
        expected, found = (getattr(engine, name)(x.copy(), **given) for engine in (theirs, ours))
        assert found.dtype == expected.dtype
        np.testing.assert_allclose(found, expected, rtol=0, atol=precision * np.abs(expected).max())
        return expected

    spectrum = agree("of_rows", field, n=longer[1], axis=1)
    agree("rows_back", spectrum, n=longer[1], axis=1, overwrite_x=True)
    agree("of_columns", spectrum, n=longer[0], axis=0)
    agree("columns_back", agree("of_columns", spectrum, axis=0, overwrite_x=True), axis=0, overwrite_x=True)
    agree("field_back", agree("of_field", field), s=(nx, ny), overwrite_x=True)


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_half_space__is_the_same_by_both(boundary, mirrored, monkeypatch):
    pressure = np.random.default_rng(0).random((33, 150))
    found = []
    for engine in ("scipy", "ducc0"):
        monkeypatch.setenv("ROUGHVISC_TRANSFORMS", engine)
        operator = Operator(pressure.shape, (1.0, 0.7), boundary, mirrored=mirrored)
        found.append((operator.displacement(pressure), operator.inverse(pressure.astype(np.float32))))
    for (a, b), precision in zip(zip(*found, strict=True), (1e-14, 1e-5), strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=precision * np.abs(a).max())


@pytest.mark.parametrize("mirrored", [False, True])
def test_reach__is_the_same_by_both(mirrored, monkeypatch):
    pressure = np.random.default_rng(0).random((13, 9))
    window = Window((40, 51), (0, 0), pressure.shape, mirrored=mirrored)
    found = []
    for engine in ("scipy", "ducc0"):
        monkeypatch.setenv("ROUGHVISC_TRANSFORMS", engine)
        found.append(
            np.concatenate(
                [rows.copy() for _, rows in FarFieldDisplacement(window, (1.0, 0.7), HALF_SPACE).rows(pressure)]
            )
        )
    np.testing.assert_allclose(found[0], found[1], rtol=1e-13)


def test_sliding__is_the_same_by_both_and_goes_by_the_one_that_is_stated(monkeypatch):
    pressure, body, calls, found = np.random.default_rng(0).random((15, 12)), Body(rv.zener(1e6, 1e6, 1e5)), [], []
    sound = ducc.ducc0.fft.r2c
    monkeypatch.setattr(ducc.ducc0.fft, "r2c", lambda *a, **kw: calls.append(a) or sound(*a, **kw))
    for engine, by_ducc0 in (("scipy", 0), ("ducc0", 3)):
        monkeypatch.setenv("ROUGHVISC_TRANSFORMS", engine)
        sliding = Sliding(body, pressure.shape, (1e-6, 2e-6), 0.1)
        found.append((sliding.displacement(pressure), sliding.full_contact(pressure)))
        assert sliding.convolutions == 3
        assert len(calls) == by_ducc0
    for (a, b), precision in zip(zip(*found, strict=True), (1e-14, 1e-5), strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=precision * np.abs(a).max())


def test_result__says_by_what_it_was_computed(by_ducc0, monkeypatch, tmp_path):
    study = tmp_path / "study.toml"
    study.write_text(
        '[surface]\ngenerate = "sphere"\nradius = "1 mm"\nsize = "0.3 mm"\nshape = [16, 15]\n'
        '[material]\nmodel = "elastic"\nshear_modulus = "1 MPa"\n[[program]]\nload = "1 mN"\nover = 0\n'
    )
    fast = rv.run(rv.read_study(study), tmp_path / "fast", progress=False)
    monkeypatch.setenv("ROUGHVISC_TRANSFORMS", "scipy")
    plain = rv.run(rv.read_study(study), tmp_path / "plain", progress=False)
    assert fast.attrs["transforms"].startswith("ducc0 ")
    assert plain.attrs["transforms"].startswith("scipy.fft ")
    np.testing.assert_allclose(fast.pressure, plain.pressure, rtol=0, atol=1e-9 * float(plain.pressure.max()))


def test_without_ducc0__scipy_is_taken(by_ducc0, monkeypatch):
    monkeypatch.setattr(ducc, "ducc0", None)
    assert transform_library().startswith("scipy.fft ")
    Operator((5, 4), (1.0, 1.0)).displacement(np.ones((5, 4)))
