"""Sweeps that are called from scripts."""

import re
import runpy
from pathlib import Path

import pytest

import roughvisc as rv

WORKFLOWS = Path(__file__).parents[3] / "workflows"
CHECK = "from roughvisc.study.execution.cluster import refuse_unguarded_script as check\n"


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
    said = str(error.value)
    assert re.fullmatch(r".*script\.py, line 3: rv\.sweep starts processes .*`if __name__ == \"__main__\":`.*", said)
    assert "\n" not in said
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("text", "refused"),
    [
        ("check()", True),
        ("def main():\n    check()\n\nmain()", True),
        ('if __name__ == "__main__":\n    pass\ncheck()', True),
        ("if True:\n    check()", True),
        ('if __name__ == "__main__":\n    check()', False),
        ('def main():\n    check()\n\nif "__main__" == __name__:\n    main()', False),
    ],
)
def test_script__is_refused_where_its_line_would_run_again(tmp_path, text, refused):
    if not refused:
        return run(tmp_path, CHECK + text)
    with pytest.raises(rv.InputError, match="expected the call below"):
        run(tmp_path, CHECK + text)
    return None


def test_script__that_is_imported_and_a_notebook_cell_are_no_concern(tmp_path):
    (tmp_path / "script.py").write_text(CHECK + "check()")
    runpy.run_path(str(tmp_path / "script.py"), run_name="other")
    exec(compile(CHECK + "check()", "<cell>", "exec"), {"__name__": "__main__"})
