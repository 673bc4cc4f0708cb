"""What a user meets first: the public names, and arguments that are text with a unit."""

import inspect
import subprocess
import sys

import pytest

import roughvisc as rv


@pytest.mark.parametrize("module", [rv, rv.plot, rv.observables, rv.closed_forms], ids=lambda one: one.__name__)
def test_completion__shows_what_users_call_and_nothing_else(module):
    shown = dir(module)
    assert len(shown) > 15
    for name in set(shown) - {"__version__"}:
        one = getattr(module, name)
        assert not name.startswith("_")
        if inspect.ismodule(one):
            assert (module, name) in {(rv, "plot"), (rv, "observables"), (rv, "closed_forms")}
        else:
            assert callable(one), name
            assert one.__module__.startswith("roughvisc."), f"{name} comes from elsewhere"


def test_completion__is_whole_before_anything_is_used():
    code = "import roughvisc; print(*dir(roughvisc))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == dir(rv)


def test_case__is_what_read_study_returns(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(
        '[surface]\ngenerate = "sphere"\nradius = 1e-3\nsize = 1e-4\nshape = 8\n'
        '[material]\nmodel = "elastic"\nshear_modulus = 1e6\n[[program]]\nload = 1e-4\nover = 0\n'
    )
    case = rv.read_study(path)
    assert isinstance(case, rv.Case)
    assert all(isinstance(one, rv.Case) for one in rv.read_cases(path))
    assert inspect.signature(rv.read_study).return_annotation == "Case"
