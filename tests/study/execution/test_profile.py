"""Where the time goes: every part is counted once, and nothing stays wrapped."""

import time

import pytest
from click.testing import CliRunner
from support import run_whole

from roughvisc.cli import main
from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.study.execution.profile import REST, TimeProfile, profiled

STUDY = """
[surface]
generate = "sphere"
radius = "1 mm"
size = "0.2 mm"
shape = [101, 97]
[material]
model = "zener"
shear_modulus = "1 MPa"
kelvin_modulus = "1 MPa"
kelvin_viscosity = "0.1 MPa s"
[[program]]
load = "1 mN"
over = "10 ms"
[solve]
tolerance = 1e-2
[keep]
times = 3
"""


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(f'title = "Profiled"\n{STUDY}')
    return path


def test_profile__sums_up_to_the_whole_and_counts_the_transforms(study, tmp_path):
    original = Operator.displacement
    with profiled() as profile:
        ds = run_whole(study, tmp_path / "out", progress=False)
        assert Operator.displacement is not original
    assert Operator.displacement is original
    assert sum(profile.seconds.values()) == pytest.approx(profile.whole)
    assert all(seconds > 0 for seconds in profile.seconds.values())
    assert profile.calls["transforms"] >= int(ds.convolutions.sum())
    assert profile.calls["result file"] == 1
    assert profile.calls["checkpoints"] >= 1
    assert profile.calls["memory"] > 0
    assert profile.share("transforms") + profile.share(REST) < 1


def test_profile__counts_the_inner_of_two_parts():
    profile = TimeProfile()
    inner = profile.timed("inner", lambda: time.sleep(0.02))
    outer = profile.timed("outer", lambda: [inner() for _ in range(3)])
    outer()
    assert profile.calls == {"inner": 3, "outer": 1}
    assert profile.seconds["inner"] >= 0.06
    assert profile.seconds["outer"] < profile.seconds["inner"]


def test_profile__is_restored_when_the_run_fails():
    original = Operator.displacement
    with pytest.raises(ZeroDivisionError), profiled():
        1 / 0  # noqa: B018
    assert Operator.displacement is original


def test_run_profile__prints_a_table_and_refuses_other_processes(study, tmp_path):
    out = ["--out", str(tmp_path / "out"), "--no-plots", "--profile"]
    found = CliRunner().invoke(main, ["run", str(study), *out])
    assert found.exit_code == 0, found.output
    assert "Where the time went" in found.output
    assert "transforms" in found.output
    refused = CliRunner().invoke(main, ["run", str(study), *out, "--workers", "2"])
    assert refused.exit_code == 2
    assert "--profile" in refused.output
