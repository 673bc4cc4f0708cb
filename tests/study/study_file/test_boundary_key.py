"""``boundary`` of a study that does not say it: as the surface was made, in the key too, or one question."""

import pytest
from support import refused

import roughvisc as rv
from roughvisc.study.case import Case, read_cases, read_study, vary

BODY = '[material]\nmodel = "elastic"\nshear_modulus = 1e6\n[[program]]\npressure = 1e3\nover = 0\n'
BALL = '[surface]\ngenerate = "sphere"\nradius = 1e-2\nsize = 1e-3\nshape = [12, 10]\n'
ROUGH = '[surface]\ngenerate = "self_affine"\nsize = 1e-3\nshape = 16\nhurst = 0.8\nrms_slope = 0.1\nseed = 1\n'
WAVES = '[surface]\ngenerate = "wavy"\namplitude = 1e-6\nwavelength = 1e-3\nsize = 1e-3\nshape = 16\n'
SECOND = BALL.replace("[surface]", "[surface.second]")
SCAN = '[surface]\nfile = "rough.nc"\n'


@pytest.fixture
def study(tmp_path):
    h = rv.self_affine(1e-3, (12, 10), hurst=0.8, rms_height=1e-6, seed=1)
    h.to_netcdf(tmp_path / "rough.nc")
    h.to_netcdf(tmp_path / "other.nc")
    (tmp_path / "ball.toml").write_text('generate = "cone"\nslope = 0.1\nsize = 1e-3\nshape = [12, 10]\n')
    (tmp_path / "scan.toml").write_text('file = "rough.nc"\n')
    (tmp_path / "rough.toml").write_text(ROUGH.removeprefix("[surface]\n"))

    def written(text):
        (tmp_path / "study.toml").write_text(text)
        return tmp_path / "study.toml"

    return written


@pytest.mark.parametrize(
    ("text", "word"),
    [
        (BALL, "free"),
        (ROUGH, "periodic"),
        (WAVES, "periodic"),
        (BALL + "level = false\n", "free"),
        (ROUGH + "resample = 8\n", "periodic"),
        (ROUGH + "realisation = 1\n" + SECOND, "periodic"),
        (SCAN + "realisation = 3\n", "periodic"),
        (SCAN + "level = 1\nrealisation = 1\n", "periodic"),
        (SCAN + '[solve]\nedge = "accept"\n', "free"),
        ('[surface]\nfile = "ball.toml"\n', "free"),
        ('[surface]\nfile = "scan.toml"\nrealisation = 1\n', "periodic"),
    ],
)
def test_key__holds_the_word_that_auto_stands_for(study, text, word):
    found = read_study(study(text + BODY))
    said = "[solve]\n" + f'boundary = "{word}"\n'
    stated = read_study(study((text.replace("[solve]\n", said) if "[solve]" in text else text + said) + BODY))
    assert found.settings.boundary == word
    assert found.key == stated.key
    assert Case.from_json(found.to_json()).key == found.key


@pytest.mark.parametrize(
    "text",
    [
        SCAN,
        SCAN + "level = 1\n",
        SCAN + '[solve]\nboundary = "auto"\n',
        ROUGH + "level = 1\n",
        ROUGH + 'crop = { x = [0, "0.5 mm"] }\n',
        BALL + "level = 0\n",
        BALL + SECOND,
        ROUGH + "resample = 8\n" + SECOND,
        '[surface]\nfile = "scan.toml"\n',
        '[surface]\nfile = "ball.toml"\nlevel = 0\n',
    ],
)
def test_study__of_any_other_surface_is_asked(study, text):
    with refused("solve.boundary"):
        read_study(study(text + BODY))


def test_sweep__over_surfaces_decides_for_each_case(study):
    sweep = '[sweep]\n"surface.file" = ["ball.toml", "rough.toml"]\n'
    surface = '[surface]\nfile = "ball.toml"\n'
    assert [case.settings.boundary for case in read_cases(study(surface + BODY + sweep))] == ["free", "periodic"]


def test_vary__to_another_surface_decides_anew(study):
    ball = read_study(study(BALL + BODY))
    rough = {"generate": "self_affine", "size": 1e-3, "shape": 16, "hurst": 0.8, "rms_slope": 0.1, "seed": 1}
    assert vary(ball, {"surface": rough}).settings.boundary == "periodic"
    assert vary(ball, {"surface.radius": 2e-2}).settings.boundary == "free"
    assert vary(ball, {"surface": rough, "solve.boundary": "free"}).settings.boundary == "free"
    with refused("solve.boundary"):
        vary(ball, {"surface.level": 1})
    stated = read_study(study(BALL + BODY + '[solve]\nboundary = "free"\n'))
    assert vary(stated, {"surface": rough}).settings.boundary == "free"
    assert vary(Case.from_json(ball.to_json()), {"surface": rough}).settings.boundary == "periodic"
