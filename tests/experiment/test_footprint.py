"""The memory that a march is said to take, against what it takes."""

import gc
import tracemalloc

import pytest

import roughvisc as rv
from roughvisc.experiment import loading
from roughvisc.experiment.resources import march_bytes
from roughvisc.experiment.scene import memory_options
from roughvisc.mechanics import arrays as passes
from roughvisc.mechanics import arrays as reuse
from roughvisc.mechanics.bodies import operator
from roughvisc.mechanics.hereditary.choice import choose_memory
from roughvisc.study.execution.run import run_case
from roughvisc.study.statement.case import read_study, vary
from roughvisc.study.storage.store import open_result
from roughvisc.topography.grid import nominal_area

ROUGH = """
title = "Rough"
[surface]
generate = "self_affine"
size = "1 mm"
shape = [160, 144]
hurst = 0.8
rms_slope = 0.1
rolloff = "0.25 mm"
shortcut = "50 um"
seed = 4
[material]
model = "zener"
shear_modulus = "3 MPa"
kelvin_modulus = "1 MPa"
kelvin_viscosity = "0.1 MPa s"
[[program]]
pressure = "6 kPa"
over = "10 ms"
[[program]]
hold = "0.5 s"
[solve]
boundary = "periodic"
tolerance = 1e-2
[keep]
fields = ["pressure"]
times = 2
"""
ELASTIC = {"material": {"model": "elastic", "shear_modulus": 3e6}, "surface.shape": [400, 360]}
THREE = {"model": "prony", "glassy": 3e-7, "compliances": [1e-7, 2e-7, 1e-7], "times": [0.01, 0.05, 0.3]}
DIRECT = {"solve.memory": "direct", "surface.shape": [400, 360]}
FULL = {"program": [{"pressure": "3 MPa", "over": "10 ms"}, {"hold": "0.5 s"}]}
FREE = {"surface.shape": [400, 360], "solve.boundary": "free", "solve.edge": "accept"}


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """The case, and a folder in which it was computed once, so that what is imported late is there."""
    folder = tmp_path_factory.mktemp("footprint")
    (folder / "rough.toml").write_text(ROUGH)
    case = read_study(folder / "rough.toml")
    run_case(vary(case, {"surface.shape": [48, 45]}), folder)
    return case, folder


@pytest.mark.parametrize(
    "changes",
    [ELASTIC, {}, *(pytest.param(one, marks=pytest.mark.long) for one in (FREE, {"material": THREE}, DIRECT, FULL))],
)
def test_march__takes_the_memory_that_is_stated(study, changes, monkeypatch):
    # as on a wide grid: by parts that are a small part of it, in memory that is used again
    monkeypatch.setattr(passes, "_BLOCK", 1 << 12)
    monkeypatch.setattr(reuse, "_FROM", 1 << 17)
    case, folder = vary(study[0], changes), study[1]
    gc.collect()
    tracemalloc.start()
    try:
        path = run_case(case, folder)
        taken = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    with open_result(path) as ds:
        contact = float(ds.contact_area_counted.max()) / nominal_area(ds)
        rows, cells = ds.sizes["time"], ds.sizes["x"] * ds.sizes["y"]
        steps = ds.sizes.get("step", 0)
    settings = case.solving()
    memory = choose_memory(case.material(), **memory_options(case.program().on_area(1e-6), settings)).memory
    stated = march_bytes(settings, cells, memory, contact=contact, rows=rows, steps=steps)
    assert stated == pytest.approx(taken, rel=0.1), (
        f"{taken / 8 / cells:.1f} fields taken, {stated / 8 / cells:.1f} stated"
    )


@pytest.mark.parametrize(("cells", "layer"), [(1 << 20, 8), ((1 << 20) + 1, 1)])
def test_file_of_many_frames__is_written_a_layer_of_chunks_at_a_time(study, cells, layer):
    """Which no solution of an elastic case takes as much as: the state, the surface and a layer count."""
    settings = vary(study[0], ELASTIC).solving()
    elastic = choose_memory(rv.elastic(1e6), **memory_options(study[0].program().on_area(1e-6), settings)).memory
    few, many = (march_bytes(settings, cells, elastic, rows=rows) / 8 / cells for rows in (1, 24))
    assert (many - few > 1) == (layer > 1)
    if layer > 1:
        assert many == pytest.approx(2.1 + 4.5 + layer)


COUNTED = (161, 144)


@pytest.fixture
def held(monkeypatch):
    """Fields that a march of that shape holds, as on a wide grid: how many now, and how many at most."""
    gc.collect()  # what others have left would be counted as given back
    size, counts = 8 * COUNTED[0] * COUNTED[1], {"now": 0, "most": 0}
    monkeypatch.setattr(reuse, "_FROM", 1)
    monkeypatch.setattr(passes, "_BLOCK", 1 << 10)
    monkeypatch.setattr(operator, "_BLOCKED", 1)
    monkeypatch.setattr(loading, "is_wide", lambda size: True)
    lend, take_back = reuse._Kept.lend, reuse._Kept.take_back

    def lent(self, bytes_):
        counts["now"] += bytes_ == size
        counts["most"] = max(counts["most"], counts["now"])
        return lend(self, bytes_)

    def taken_back(self, memory):
        counts["now"] -= memory.size == size
        take_back(self, memory)

    monkeypatch.setattr(reuse._Kept, "lend", lent)
    monkeypatch.setattr(reuse._Kept, "take_back", taken_back)
    return counts


@pytest.mark.parametrize(("over", "fields"), [(0.0, 9), (0.01, 10)])
def test_march_with_one_exponential__holds_few_fields_beside_gap_and_heights(over, fields, held):
    """Counted by hand: the contact solver's gap, pressure, displacement and response; displacements of two
    instants of the march and of one of its companion; what both remember. Pressures are held by their cells. While a
    step after a corner waits for its companion, what it remembers and the displacement before it are held too."""
    surface = rv.self_affine(1e-3, COUNTED, hurst=0.8, rms_slope=0.1, rolloff=2.5e-4, shortcut=5e-5, seed=4)
    material = rv.zener(shear_modulus=3e6, kelvin_modulus=1e6, kelvin_viscosity=1e5)
    program = rv.Program().pressure(6e3, over=over).hold(0.5)
    settings = {"boundary": "periodic", "tolerance": 1e-2, "times": [0.5 + over], "fields": (), "progress": False}
    rv.simulate(surface, material, program, **settings)
    assert held["most"] == fields
    gc.collect()
    assert held["now"] == 0


@pytest.mark.parametrize("every", [None, 1])
def test_run_that_can_be_interrupted__holds_one_field_more(study, held, tmp_path, every):
    """Of the state that a checkpoint is made of; and the pressure of a kept row, till that is written."""
    case = vary(study[0], {"surface.shape": list(COUNTED)})
    run_case(case, tmp_path, progress=False, checkpoint_steps=every)
    assert held["most"] == 11 + (every is None)
