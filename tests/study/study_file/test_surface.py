"""``[surface]``: the second face, and the boundary for which a surface is made."""

import json

import numpy as np
import pytest
from support import refused

import roughvisc as rv
from roughvisc.study.case import Case, vary

BALL = {"generate": "sphere", "radius": 1e-2, "size": 1e-3, "shape": [12, 10]}
ROUGH = {"generate": "self_affine", "size": 1e-3, "shape": 16, "hurst": 0.8, "rms_slope": 0.1, "seed": 1}
WAVES = {"generate": "wavy", "amplitude": 5e-6, "wavelength": "0.3 mm", "size": ["0.9 mm", "1.2 mm"], "shape": [30, 40]}
SECOND = ROUGH | {"shape": [64, 48], "seed": 4}
SCAN, CARD = {"file": "rough.nc"}, {"file": "ball.toml"}
PRESSED = [{"pressure": 1e3, "over": 0}]


@pytest.fixture
def surface(read_one, tmp_path):
    """Reads the case of a table of a surface; scans and cards lie beside the study."""
    rv.self_affine(1e-3, (12, 10), hurst=0.8, rms_height=1e-6, seed=1).to_netcdf(tmp_path / "rough.nc")
    (tmp_path / "ball.toml").write_text('generate = "cone"\nslope = 0.1\nsize = 1e-3\nshape = [12, 10]\n')
    (tmp_path / "scan.toml").write_text('file = "rough.nc"\n')

    def case(table, **solve):
        return read_one(surface=table, program=PRESSED, solve=solve or None)

    return case


@pytest.mark.parametrize(
    ("table", "word"),
    [
        (BALL, "free"),
        (ROUGH, "periodic"),
        (WAVES, "periodic"),
        (BALL | {"level": False}, "free"),
        (ROUGH | {"resample": 8}, "periodic"),
        (ROUGH | {"realisation": 1, "second": BALL}, "periodic"),
        (SCAN | {"realisation": 3}, "periodic"),
        (SCAN | {"level": 1, "realisation": 1}, "periodic"),
        (CARD, "free"),
        ({"file": "scan.toml", "realisation": 1}, "periodic"),
    ],
)
def test_boundary__is_the_one_that_the_surface_was_made_for_in_the_key_too(surface, table, word):
    found = surface(table)
    assert found.settings.boundary == word
    assert found.key == surface(table, boundary=word).key == Case.from_json(found.to_json()).key


def test_boundary__of_a_scan_with_an_accepted_edge_is_free(surface):
    assert surface(SCAN, edge="accept").key == surface(SCAN, edge="accept", boundary="free").key


@pytest.mark.parametrize(
    "table",
    [
        SCAN,
        SCAN | {"level": 1},
        ROUGH | {"level": 1},
        ROUGH | {"crop": {"x": [0, "0.5 mm"]}},
        BALL | {"level": 0},
        BALL | {"second": BALL},
        ROUGH | {"resample": 8, "second": BALL},
        {"file": "scan.toml"},
        CARD | {"level": 0},
    ],
)
def test_boundary__of_any_other_surface_has_to_be_stated(surface, table):
    for solve in ({}, {"boundary": "auto"}):
        with refused("solve.boundary"):
            surface(table, **solve)


def test_vary__to_another_surface_decides_anew(surface):
    ball, stated = surface(BALL), surface(BALL, boundary="free")
    assert vary(ball, {"surface": ROUGH}).settings.boundary == "periodic"
    assert vary(ball, {"surface": CARD}).settings.boundary == "free"
    assert vary(ball, {"surface": ROUGH, "solve.boundary": "free"}).settings.boundary == "free"
    with refused("solve.boundary"):
        vary(ball, {"surface.level": 1})
    assert vary(stated, {"surface": ROUGH}).settings.boundary == "free"
    assert vary(Case.from_json(ball.to_json()), {"surface": ROUGH}).settings.boundary == "periodic"


def test_second__is_the_sum_of_both_faces_the_second_turned_over(surface):
    one, two = surface(WAVES).height(), surface(WAVES | {"second": SECOND}, boundary="periodic")
    other = rv.self_affine(1e-3, (64, 48), hurst=0.8, rms_slope=0.1, seed=4)
    np.testing.assert_array_equal(two.height(), rv.combine(one, other, "x"))
    moved = vary(two, {"surface.second.flip": "none", "surface.second.offset": ("20 um", 0)})
    np.testing.assert_array_equal(moved.height(), rv.combine(one, other, offset=(2e-5, 0)))
    # steps of a face come before the sum; resampling after it
    case = vary(two, {"surface.invert": True, "surface.second.level": 2, "surface.resample": 20})
    both = rv.combine(rv.invert(one), rv.level(other, 2), "x")
    np.testing.assert_array_equal(case.height(), rv.resample(both, 20))


def test_second__counts_in_the_key(surface, tmp_path):
    one, two = surface(WAVES, boundary="periodic"), surface(WAVES | {"second": SECOND}, boundary="periodic")
    keys = {one.key, two.key, vary(two, {"surface.second.flip": "y"}).key, vary(two, {"surface.second.seed": 5}).key}
    assert len(keys) == 4
    assert Case.from_json(two.to_json()).key == two.key
    assert "second" not in json.loads(one.to_json())["surface"]
    assert two.surface_sha256 == one.surface_sha256  # that of the first face
    with rv.run(two, tmp_path / "out", progress=False) as ds:
        assert "combined with a second face, reversed along x" in ds.attrs["history"]
        np.testing.assert_allclose(ds.height, two.height(), rtol=1e-12)


@pytest.mark.parametrize(
    ("second", "key", "found"),
    [
        (3, "second", 3),
        ({"generate": "con"}, "second.generate", "con"),
        (SECOND | {"flip": "z"}, "second.flip", "z"),
        (SECOND | {"resample": 8}, "second.resample", 8),
        (SECOND | {"second": ROUGH}, "second.second", None),
        ({"file": "gone.x3p"}, "second.file", "gone.x3p"),
        (SECOND | {"offset": "1 um"}, "second.offset", None),
    ],
)
def test_second__is_refused_at_the_key(surface, second, key, found):
    with refused(f"surface.{key}", found):
        surface(WAVES | {"second": second}, boundary="periodic")


def test_surrogates__of_each_scan_are_drawn_anew_and_do_not_depend_on_its_treatment(surface, tmp_path):
    """With a common seed, the first surrogates of all scans deviate in the same direction."""
    spectrum = {"hurst": 0.8, "rms_height": 1e-6, "rolloff": 4e-5}
    for seed in (1, 2):
        rv.save_scan(rv.self_affine(1e-4, (33, 30), **spectrum, seed=seed), tmp_path / f"{seed}.x3p")

    def waves(**table):
        found = np.fft.rfft2(surface(table | {"realisation": 1}).height().values)[1:4, 1:4]
        return found / np.abs(found)  # of the longest, whose amplitudes are those of the scan

    first = waves(file="1.x3p")
    assert np.abs(np.angle(first / waves(file="2.x3p"))).max() > 0.5
    np.testing.assert_allclose(waves(file="1.x3p", shortest_wave="15 um"), first, rtol=1e-6)
    checksum = surface({"file": "1.x3p", "realisation": 1}).surface_sha256
    (tmp_path / "card.toml").write_text(f'file = "1.x3p"\nsha256 = "{checksum}"\ntitle = "As measured"\n')
    np.testing.assert_allclose(waves(file="card.toml"), first)
    (tmp_path / "copy.x3p").write_bytes((tmp_path / "1.x3p").read_bytes())
    np.testing.assert_allclose(waves(file="copy.x3p"), first, err_msg="by the content, not by the name")
