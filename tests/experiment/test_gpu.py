"""``device = "gpu"``: a stand-in for CuPy gives the results of NumPy to rounding; without a GPU a run is refused."""

import sys
from functools import partial
from importlib import import_module
from types import SimpleNamespace

import device
import numpy as np
import pytest
from samples import GEL as ZENER
from samples import HOLED
from samples import SMALL_ROUGH as ROUGH
from support import BALL, FRICTION

import roughvisc as rv
from roughvisc.cli import main
from roughvisc.experiment.loading import Loading
from roughvisc.experiment.problem import Problem
from roughvisc.runs.checkpoint import CheckpointWriter
from roughvisc.settings import Settings
from roughvisc.solve import solve

PRESS = rv.Program().pressure(2e4, over=0).hold(0.3).pressure(5e3, over=0.1)
GPU = rv.Numerics(device="gpu")


@pytest.fixture
def gpu(monkeypatch):
    """The stand-in in CuPy's place, which must be used; SciPy transforms on both."""
    asarray, shapes = device.asarray, []
    monkeypatch.setattr(
        device, "asarray", lambda values: (shapes.append(getattr(values, "shape", ())), asarray(values))[1]
    )
    yield device.install(monkeypatch)
    assert shapes


SCENES = {
    "part of a ball": (rv.sphere(1e-3, 1e-3, 71), ZENER, rv.Program().load(1e-4, over=0.1).hold(0.2), {}),
    "periodic": (ROUGH, ZENER, PRESS, {"boundary": "periodic"}),
    "mirror, absent cells": (HOLED, ZENER, PRESS, {"boundary": "mirror", "missing": "absent"}),
    "loss of contact": (
        ROUGH,
        rv.Prony(1e-6, 2e-7, (1e-6, 2e-6), (0.03, 0.3)),
        rv.Program().approach(4e-6, over=0.2).approach(-1e-6, over=0.2).approach(4e-6, over=0.3),
        {"boundary": "free", "edge": "accept"},
    ),
    "slide": (
        ROUGH,
        ZENER,
        rv.Program().pressure(2e4, over=0.1).slide(2e-4, speed=1e-3).slide(1e-4, speed=1e-3, direction="-y").hold(0.1),
        {"boundary": "periodic"},
    ),
    "sheet": (ROUGH, rv.sheet(ZENER, 2e-4), PRESS, {"boundary": "mirror"}),
    "layer": (ROUGH, rv.layer(ZENER, 1e-4, on=rv.elastic(5e6)), PRESS, {"boundary": "periodic"}),
    "layer, free": (ROUGH, rv.layer(ZENER, 1e-4, on=rv.zener(3e6, 1e6, 2e5)), PRESS, {"edge": "accept"}),
    "soft": (
        ROUGH,
        rv.kelvin_voigt(1e6, 1e5),
        rv.Program().pressure(2e4, over=0.1),
        {"boundary": "periodic", "tolerance": 1e-2},
    ),
    "grid error": (ROUGH, ZENER, PRESS, {"boundary": "periodic", "grid_error": True}),
}


SLOW = ("soft", "loss of contact", "slide", "layer, free")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.thorough if name in SLOW else ()) for name in SCENES]
)
def test_simulate__on_a_device_gives_what_a_cpu_gives(gpu, monkeypatch, name):
    monkeypatch.setattr("roughvisc.mechanics.stepping.PACKED_FROM", 300)  # packs the pressures of most scenes
    height, body, program, settings = SCENES[name]
    settings = {"times": 4, "fields": ("pressure", "gap", "displacement"), "progress": False, **settings}
    found, expected = (rv.simulate(height, body, program, numerics=one, **settings) for one in (GPU, rv.Numerics()))
    for variable in expected.data_vars:
        if variable != "wall_time":
            scale = float(abs(expected[variable]).max()) or 1.0
            np.testing.assert_allclose(found[variable], expected[variable], 0, 1e-8 * scale, err_msg=str(variable))
    assert found.attrs["memory"] == expected.attrs["memory"]
    if name == "loss of contact":
        assert (np.diff((expected.roughvisc.steps.force > 0).astype(int)) < 0).any()


@pytest.mark.parametrize("boundary", ["periodic", "mirror"])
def test_friction__on_a_device_is_that_of_a_cpu(gpu, boundary):
    settings = {"pressure": 2e4, "speeds": [1e-3, 1e-2], "boundary": boundary, "fields": ("pressure", "gap")}
    found, expected = (
        rv.friction(ROUGH, ZENER, numerics=one, progress=False, **settings) for one in (GPU, rv.Numerics())
    )
    for variable in ("friction_force", "friction_force_across", "approach", "contact_area", "pressure", "gap"):
        scale = float(abs(expected[variable]).max())
        np.testing.assert_allclose(found[variable], expected[variable], rtol=0, atol=1e-7 * scale, err_msg=variable)


@pytest.mark.parametrize(
    "name", ["part of a ball", *(pytest.param(name, marks=pytest.mark.thorough) for name in ("slide", "layer", "soft"))]
)
def test_run__that_was_stopped_on_a_device_continues_to_the_same_bits(gpu, name, tmp_path):
    height, body, program, settings = SCENES[name]
    settings = Settings(times=6, **({"boundary": "free"} | settings), device="gpu")
    problem = Problem(height, body if isinstance(body, rv.Body) else rv.Body(body), settings)
    whole = solve(problem, Loading(program))
    count = iter(range(1000))
    stopped = CheckpointWriter(tmp_path / "run", seconds=0, stop=lambda: next(count) == 4)
    with pytest.raises(KeyboardInterrupt):
        solve(problem, Loading(program), stopped)
    stopped.save()
    stopped.close()
    resumed = CheckpointWriter(tmp_path / "run")
    resumed.resume()
    assert 0 < resumed.latest.done < program.duration
    found = solve(problem, Loading(program), resumed).load()
    resumed.close()
    for variable in ("pressure", "force", "approach", "stated_error"):
        np.testing.assert_array_equal(found[variable], whole[variable], err_msg=variable)


def test_surface__that_exceeds_the_memory_of_the_device_is_refused(monkeypatch):
    gpu = device.install(monkeypatch)
    monkeypatch.setattr(gpu.cuda.runtime, "memGetInfo", lambda: (10 << 20, 8 << 30))
    large = rv.from_array(np.random.default_rng(1).random((512, 512)), spacing=1.0)
    with pytest.raises(rv.TooLargeError, match="free on the GPU"):
        rv.simulate(large, ZENER, PRESS, boundary="periodic", numerics=GPU, progress=False)


#: Parts of CuPy that miss something, and the complaint.
BROKEN = [
    (None, "roughvisc[gpu]"),
    ({"runtime": SimpleNamespace(getDeviceCount=lambda: 0)}, "finds none on this machine"),
    ({"nvrtc": SimpleNamespace(getVersion=partial(import_module, "libnvrtc"))}, "(No module named 'libnvrtc')"),
]


@pytest.mark.parametrize(("parts", "expected"), BROKEN)
def test_command__without_a_device_ends_with_status_2_and_writes_nothing(
    monkeypatch, tmp_path, capsys, parts, expected
):
    cupy = parts and SimpleNamespace(cuda=SimpleNamespace(**(vars(device.cuda) | parts)))
    monkeypatch.setitem(sys.modules, "cupy", cupy)
    study = tmp_path / "study.toml"
    study.write_text(BALL)
    with pytest.raises(SystemExit) as ended:
        main(["run", str(study), "--device", "gpu"])
    assert ended.value.code == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "device" in said
    assert expected in said
    assert [path.name for path in tmp_path.iterdir()] == ["study.toml"]


PERIODIC = BALL.replace("[24, 21]", "[150, 140]").replace("free", "periodic")  # longer than the coarse run of a plan


@pytest.mark.parametrize("study", [PERIODIC, FRICTION.replace("[26, 21]", "[60, 50]")])
def test_plan__on_the_device_is_that_of_the_processor(monkeypatch, tmp_path, study):
    device.install(monkeypatch)
    found = []
    for where in ("cpu", "gpu"):
        (tmp_path / "study.toml").write_text(study.replace("[solve]", f'[solve]\ndevice = "{where}"'))
        found.append(rv.plan(tmp_path / "study.toml"))
    for name in ("steps", "convolutions", "contact_fraction"):
        np.testing.assert_allclose(*(plan[name] for plan in found), rtol=0.01)
