"""Sweeps that are called from scripts."""

import runpy
from pathlib import Path

import pytest

import roughvisc as rv

WORKFLOWS = Path(__file__).parents[3] / "workflows"


def run(folder, text):
    """A script as Python runs it when it is named on the command line."""
    script = folder / "script.py"
    script.write_text(text)
    runpy.run_path(str(script), run_name="__main__")


def test_sweep__of_a_script_without_a_guard_is_refused_in_one_sentence(tmp_path):
    study = WORKFLOWS / "load_sweep.toml"
    text = f"import roughvisc as rv\n\nrv.sweep({str(study)!r}, {str(tmp_path / 'out')!r}, workers=2, progress=False)\n"
    with pytest.raises(rv.InputError) as error:
        run(tmp_path, text)
    assert f"{tmp_path / 'script.py'}: " in str(error.value)
    assert not (tmp_path / "out").exists()
