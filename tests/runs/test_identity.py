"""A case's key, the checksum in its result and the heights that were pressed are those of the same bytes."""

import hashlib

import numpy as np
import pytest
import xarray as xr
from support import BALL

from roughvisc.api import run
from roughvisc.errors import RoughviscError
from roughvisc.runs import run as run_module
from roughvisc.runs.display import Display
from roughvisc.runs.folder import case_path
from roughvisc.runs.sweep import run_cases, sweep
from roughvisc.study.case import read_cases, read_study

SCAN = 'file = "scan.npy"\nunit = "m"\nspacing = "40 um"\n'
STUDY = BALL[: BALL.index("generate")] + SCAN + BALL[BALL.index("level") :]
TWO_LOADS = STUDY + '[sweep]\n"program.0.load" = ["4 mN", "5 mN"]\n'


def bump(path, height):
    """A paraboloid, higher or lower."""
    x, y = np.meshgrid(np.linspace(-1, 1, 12), np.linspace(-1, 1, 9), indexing="ij")
    np.save(path, -height * (x**2 + y**2))
    return path


@pytest.fixture
def scan(tmp_path):
    return bump(tmp_path / "scan.npy", 1e-5)


@pytest.fixture
def study(tmp_path, scan):
    path = tmp_path / "bump.toml"
    path.write_text(TWO_LOADS)
    return path


def after_the_first(monkeypatch, change):
    """Changes something when the first case has been computed."""
    press, pressed = run_module.solve, []

    def pressing(*args, **settings):
        ds = press(*args, **settings)
        if not pressed:
            change()
        pressed.append(1)
        return ds

    monkeypatch.setattr(run_module, "solve", pressing)
    return pressed


@pytest.mark.thorough
def test_sweep__a_scan_that_changes_is_not_pressed_under_the_old_key(study, scan, tmp_path, monkeypatch):
    before = hashlib.sha256(scan.read_bytes()).hexdigest()
    cases = read_cases(study)
    pressed = after_the_first(monkeypatch, lambda: bump(scan, 2e-5))
    outcomes = list(run_cases(cases, tmp_path / "out", display=Display(False), workers=0).values())
    assert [outcome.kind for outcome in outcomes] == ["done", "hindered"]
    assert len(pressed) == 1
    assert f"{scan}: was changed after the study was read" in outcomes[1].message
    assert outcomes[0].entry.attributes["surface_sha256"] == before, "of what was pressed, not of what lies there now"
    assert [path.name for path in (tmp_path / "out").glob("*.nc")] == [f"{cases[0].key}.nc"]
    assert not case_path(tmp_path / "out", cases[1].key, "failure").exists()
    again = sweep(study, tmp_path / "out", workers=0, progress=False)
    assert set(again.case_key.values).isdisjoint(case.key for case in cases)
    xr.testing.assert_equal(again, sweep(study, tmp_path / "fresh", workers=0, progress=False))


def test_run__refuses_a_case_whose_scan_is_another_now(study, scan, tmp_path):
    study.write_text(STUDY)
    case = read_study(study)
    key = case.key
    bump(scan, 2e-5)
    text = r"bump\.toml: surface: .*scan\.npy: was changed after the study was read"
    with pytest.raises(RoughviscError, match=text) as caught:
        run(case, tmp_path / "out", progress=False)
    assert caught.value.transient
    assert not (tmp_path / "out").exists()
    assert read_study(study).key != key
