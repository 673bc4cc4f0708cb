"""Realisations of a surface in a study: which cases they are, and where they make no sense."""

import numpy as np
import pytest
from support import refused

import roughvisc as rv
from roughvisc.study.case import read_cases, read_study, vary

ROUGH = """
[surface]
generate = "self_affine"
size = "1 mm"
shape = [9, 7]
hurst = 0.8
rms_slope = 0.1
amplitudes = "gaussian"
seed = 5
"""
SCAN = """
[surface]
file = "rough.nc"
"""
MIRROR = '[solve]\nboundary = "mirror"\n'
BODY = """
[material]
model = "elastic"
shear_modulus = "1 MPa"
[[program]]
pressure = "10 kPa"
over = 0
"""


@pytest.fixture
def study(tmp_path):
    def write(text, sweep=""):
        (tmp_path / "rough.nc").write_text("a scan, by its name")
        (tmp_path / "ball.toml").write_text('generate = "sphere"\nradius = "1 mm"\nsize = "0.1 mm"\nshape = 9\n')
        path = tmp_path / "study.toml"
        path.write_text(text + BODY + sweep)
        return path

    return write


def test_realisations__of_generated_roughness_are_the_seeds_from_the_stated_one(study):
    plain = read_study(study(ROUGH))
    three = read_cases(study(ROUGH, "[sweep]\nrealisations = 3\n"))
    assert [dict(case.varied) for case in three] == [
        {"surface.seed": 4 + number, "realisation": number} for number in (1, 2, 3)
    ]
    assert [case.key for case in three] == [vary(plain, {"surface.seed": seed}).key for seed in (5, 6, 7)]
    more = read_cases(study(ROUGH, "[sweep]\nrealisations = 5\n"))
    assert [case.key for case in more[:3]] == [case.key for case in three], "those that are there are used again"


def test_realisations__of_a_scan_are_the_scan_itself_and_its_surrogates(study):
    plain = read_study(study(SCAN, MIRROR))
    cases = read_cases(study(SCAN, MIRROR + "[sweep]\nrealisations = 2\n"))
    assert [dict(case.varied) for case in cases] == [{"realisation": number} for number in (0, 1, 2)]
    assert cases[0].key == plain.key
    assert [c.key for c in cases[1:]] == [vary(plain, {"surface.realisation": number}).key for number in (1, 2)]


def test_realisations__are_crossed_with_lists_and_belong_to_their_table(study):
    crossed = read_cases(study(ROUGH, '[sweep]\nrealisations = 2\n"program.0.pressure" = ["1 kPa", "2 kPa"]\n'))
    told = [(case.varied["program.0.pressure"], case.varied["realisation"]) for case in crossed]
    assert told == [(1e3, 1), (1e3, 2), (2e3, 1), (2e3, 2)]
    tables = '[[sweep]]\nrealisations = 3\n"surface.hurst" = [0.6, 0.7]\n[[sweep]]\n"surface.hurst" = 0.9\n'
    found = [(case.surface["hurst"], case.varied.get("realisation")) for case in read_cases(study(ROUGH, tables))]
    assert found == [(0.6, 1), (0.6, 2), (0.6, 3), (0.7, 1), (0.7, 2), (0.7, 3), (0.9, None)]
    kinds = '[[sweep]]\nrealisations = 2\nsurface = [{ file = "rough.nc" }]\n'
    assert [case.varied["realisation"] for case in read_cases(study(ROUGH, MIRROR + kinds))] == [0, 1, 2]


def test_realisations__of_two_generated_faces_draw_both(study):
    faces = ROUGH + ROUGH.replace("[surface]", "[surface.second]").replace("seed = 5", "seed = 50")
    cases = read_cases(study(faces, '[solve]\nboundary = "periodic"\n[sweep]\nrealisations = 3\n'))
    assert [(c.surface["seed"], c.surface["second"]["seed"]) for c in cases] == [(5, 50), (6, 51), (7, 52)]
    alike = faces.replace("seed = 50", "seed = 5") + '[solve]\nboundary = "periodic"\n'
    assert len(read_cases(study(alike, "[sweep]\nrealisations = 3\n"))) == 3


@pytest.mark.parametrize(
    ("surface", "sweep"),
    [
        (ROUGH, "realisations = 1"),
        (ROUGH, "realisations = [6, 24]"),
        (ROUGH.replace('"gaussian"', '"fixed"').replace("amplitudes", "# "), "realisations = 3"),
        (ROUGH, 'realisations = 3\n"surface.seed" = [1, 2]'),
        (SCAN + "realisation = 2\n", "realisations = 3"),
        ('[surface]\nfile = "ball.toml"\n', "realisations = 3"),
        ('[surface]\ngenerate = "sphere"\nradius = "1 mm"\nsize = "0.1 mm"\nshape = 9\n', "realisations = 3"),
        (
            ROUGH + ROUGH.replace("[surface]", "[surface.second]").replace("seed = 5", "seed = 7"),
            "realisations = 3",
        ),
    ],
)
def test_realisations__are_refused_where_they_make_no_sense(study, surface, sweep):
    with refused("sweep.realisations"):
        read_cases(study(surface, f"[sweep]\n{sweep}\n"))


def test_surrogates__of_each_scan_are_drawn_anew_and_do_not_depend_on_its_treatment(tmp_path):
    """With a common seed, the first surrogates of all scans deviate in the same direction."""
    spectrum = {"hurst": 0.8, "rms_height": 1e-6, "rolloff": 4e-5}
    for seed in (1, 2):
        rv.save_scan(rv.self_affine(1e-4, (33, 30), **spectrum, seed=seed), tmp_path / f"{seed}.x3p")

    def waves(surface):
        (tmp_path / "study.toml").write_text(f"[surface]\nrealisation = 1\n{surface}\n" + BODY)
        found = np.fft.rfft2(read_study(tmp_path / "study.toml").height().values)[1:4, 1:4]
        return found / np.abs(found)  # of the longest, whose amplitudes are those of the scan

    first = waves('file = "1.x3p"')
    assert np.abs(np.angle(first / waves('file = "2.x3p"'))).max() > 0.5
    np.testing.assert_allclose(waves('file = "1.x3p"\nshortest_wave = "15 um"'), first, rtol=1e-6)
    checksum = read_study(tmp_path / "study.toml").surface_sha256
    (tmp_path / "card.toml").write_text(f'file = "1.x3p"\nsha256 = "{checksum}"\ntitle = "As measured"\n')
    np.testing.assert_allclose(waves('file = "card.toml"'), first)
    (tmp_path / "copy.x3p").write_bytes((tmp_path / "1.x3p").read_bytes())
    np.testing.assert_allclose(waves('file = "copy.x3p"'), first, err_msg="by the content, not by the name")
