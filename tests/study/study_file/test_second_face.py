"""``[surface.second]``: the face that lies on the first."""

import json

import numpy as np
import pytest
from support import refused

import roughvisc as rv
from roughvisc.study.case import Case, vary

ROUGH = {"generate": "self_affine", "hurst": 0.7, "rms_height": "0.5 um", "size": "1 mm", "shape": [64, 48], "seed": 4}
HEAD = """
[surface]
generate = "wavy"
amplitude = "5 um"
wavelength = "0.3 mm"
size = ["0.9 mm", "1.2 mm"]
shape = [30, 40]
"""
REST = """
[material]
model = "elastic"
shear_modulus = "1 MPa"
[[program]]
load = "1 mN"
over = 0
[solve]
boundary = "periodic"
"""


@pytest.fixture
def one(tmp_path):
    (tmp_path / "one.toml").write_text(HEAD + REST)
    return rv.read_study(tmp_path / "one.toml")


@pytest.fixture
def two(one):
    return vary(one, {"surface.second": ROUGH})


def test_second__is_the_sum_of_both_faces_the_second_turned_over(one, two):
    other = rv.self_affine(1e-3, (64, 48), hurst=0.7, rms_height=5e-7, seed=4)
    np.testing.assert_array_equal(two.height(), rv.combine(one.height(), other, "x", align="centre"))
    moved = vary(two, {"surface.second.flip": "none", "surface.second.offset": ["20 um", 0]})
    np.testing.assert_array_equal(moved.height(), rv.combine(one.height(), other, align="centre", offset=(2e-5, 0)))


def test_second__each_face_is_conditioned_and_what_is_pressed_is_framed(one, two):
    """Steps of a face come before the sum; resampling after it."""
    case = vary(two, {"surface.invert": True, "surface.second.level": 2, "surface.resample": 20})
    other = rv.level(rv.self_affine(1e-3, (64, 48), hurst=0.7, rms_height=5e-7, seed=4), 2)
    both = rv.combine(rv.invert(one.height()), other, "x", align="centre")
    np.testing.assert_array_equal(case.height(), rv.resample(both, 20))


def test_second__counts_in_the_key_and_nothing_does_without_one(one, two):
    keys = {one.key, two.key, vary(two, {"surface.second.flip": "y"}).key, vary(two, {"surface.second.seed": 5}).key}
    assert len(keys) == 4
    assert Case.from_json(two.to_json()).key == two.key
    assert "second" not in json.loads(one.to_json())["surface"]
    assert two.surface_sha256 == one.surface_sha256  # that of the first face


def test_second__runs_and_says_so(two, tmp_path):
    ds = rv.run(two, tmp_path / "out", progress=False)
    assert "combined with a second face, reversed along x" in ds.attrs["history"]
    np.testing.assert_allclose(ds.height, two.height(), rtol=1e-12)
    ds.close()


@pytest.mark.parametrize(
    ("key", "value", "at_fault", "found"),
    [
        ("second", 3, "surface.second", 3),
        ("second", {"generate": "con"}, "surface.second.generate", "con"),
        ("second.flip", "z", "surface.second.flip", "z"),
        ("second.resample", 8, "surface.second.resample", 8),
        ("second.second", ROUGH, "surface.second.second", None),
        ("second", {"file": "gone.x3p"}, "surface.second.file", "gone.x3p"),
        ("second.offset", "1 um", "surface.second.offset", None),
    ],
)
def test_second__is_refused_at_the_key(two, key, value, at_fault, found):
    with refused(at_fault, found):
        vary(two, {f"surface.{key}": value})
