"""What a plan foresees of grids and windows that grow with the contact, against what a run takes."""

import io
import pathlib

import numpy as np
import pytest
from rich.console import Console
from support import BALL

import roughvisc as rv
from roughvisc.errors import EdgeContactError
from roughvisc.experiment import profile as profile_module
from roughvisc.experiment.profile import Profile
from roughvisc.experiment.resources import march_bytes
from roughvisc.experiment.scene import build_scene
from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.hereditary.choice import choose_memory
from roughvisc.settings import Settings
from roughvisc.study.cost import estimate
from roughvisc.study.cost.estimate import CostEstimate, Passed, Stage, solved_on, stage_at, stages_of
from roughvisc.study.statement.case import read_cases, vary
from roughvisc.views.console.tables import plan_tables

HEAD = """
title = "Growing"
[solve]
tolerance = 1e-2
[keep]
times = 4
fields = ["pressure"]
"""
RUBBER = """
[material]
model = "zener"
shear_modulus = "3 MPa"
kelvin_modulus = "1 MPa"
kelvin_viscosity = "0.1 MPa s"
"""
SOFT = """
[material]
model = "power_law"
glassy = 2e-7
coefficient = 1e-6
exponent = 0.3
"""


def ball(size, shape, radius="10 mm"):
    return f'[surface]\ngenerate = "sphere"\nradius = "{radius}"\nsize = "{size}"\nshape = {shape}\n'


def loaded(load, over):
    return f'[[program]]\nload = "{load}"\nover = {over}\n[[program]]\nhold = "0.95 s"\n'


GROWING = {
    "mirrored": ball("0.2 mm", [16, 16]) + RUBBER + loaded("0.5 N", 0.05),
    "jump": ball("0.3 mm", [25, 24]) + RUBBER + loaded("0.4 N", 0),
    "approach": '[surface]\ngenerate = "cone"\nslope = 0.1\nsize = "0.1 mm"\nshape = [20, 20]\n'
    + RUBBER
    + '[[program]]\napproach = "30 um"\nover = "0.5 s"\n[[program]]\nhold = "0.5 s"\n',
    "oblong": ball("0.5 mm", [41, 24]) + SOFT + loaded("0.2 N", 0.05),
    "window": ball("0.4 mm", [100, 101], "1 mm") + RUBBER + loaded("0.15 N", 0.05),
}


@pytest.fixture
def study(tmp_path):
    def write(text):
        path = tmp_path / "study.toml"
        path.write_text(text)
        return read_cases(path)[0]

    return write


@pytest.fixture
def convolved(monkeypatch):
    """Cells of each convolution."""
    cells = []
    displacement = Operator.displacement

    def noted(self, *rest, **named):
        cells.append(np.prod(self.shape))
        return displacement(self, *rest, **named)

    monkeypatch.setattr(Operator, "displacement", noted)
    return cells


def said_of(planned):
    console = Console(width=100, record=True, file=io.StringIO())
    console.print(plan_tables(planned))
    return " ".join(console.export_text().split())


@pytest.mark.parametrize(
    "name",
    [name if name in ("window", "jump") else pytest.param(name, marks=pytest.mark.thorough) for name in GROWING],
)
def test_plan__foresees_the_grid_in_the_end_and_the_work_till_then(study, convolved, name):
    case = study(HEAD + GROWING[name])
    planned = rv.plan([case]).isel(case=0)
    height = case.height()
    profile = Profile(height, follow=True, mirror=True, kernel=case.body().kernel)
    found = estimate.march_of(case, height)
    assert max(step.level for step in found.course) == pytest.approx(found.pressed.approach)
    assert np.max([step.width for step in found.course], axis=0) == pytest.approx(found.pressed.width)
    foreseen = solved_on(stages_of(profile, grows=True), found)
    convolved.clear()
    ds = rv.run(case, progress=False)
    final = (ds.sizes["x"], ds.sizes["y"])
    assert (int(planned.final_cells_x), int(planned.final_cells_y)) == final
    assert final[0] > 1.5 * height.sizes["x"]
    grid = f"{height.shape[0]} x {height.shape[1]} cells, growing with the contact to about {final[0]} x {final[1]}"
    said = said_of(planned.expand_dims("case"))
    assert grid in said
    assert "Warning" not in said, "no theory of roughness tells of a ball"
    assert float(planned.contact_fraction) == pytest.approx(float(ds.contact_fraction.max()), rel=0.04)
    assert 0.6 < float(planned.convolutions) / int(ds.convolutions.sum()) < 1.8
    assert 0.6 < foreseen.mean(float) / np.mean(convolved) < 1.6
    size = pathlib.Path(ds.encoding["source"]).stat().st_size
    assert 0.4 < size / float(planned.disk) < 2


@pytest.mark.parametrize(("shape", "follow"), [((130, 121), True), ((20, 21), False), ((20, 22), False)])
def test_stages__are_the_windows_and_grids_that_a_profile_comes_through(monkeypatch, shape, follow):
    monkeypatch.setattr(profile_module, "MOST_CELLS", 300**2)
    monkeypatch.setattr("roughvisc.study.cost.estimate.MOST_CELLS", 300**2)
    height = rv.sphere(1e-2, (1e-3 * shape[0], 1e-3 * shape[1]), shape)
    profile = Profile(height, follow=follow, mirror=True)
    program = rv.Program().load(1e-3, over=1.0)
    scene, _ = build_scene(profile, rv.Body(rv.elastic(1e6)), program, Settings(boundary="free"))
    found = [(profile.height.shape, np.prod(profile.window.shape), profile.window.outside)]
    while (larger := profile.enlarge(scene)) is not None:
        scene = larger[0]
        found.append((profile.height.shape, np.prod(profile.window.shape), profile.window.outside))
    stages = stages_of(Profile(height, follow=follow, mirror=True), grows=True)
    assert [stage.shape for stage in stages] == [shape for shape, _, _ in found]
    assert [stage.outside for stage in stages] == [outside for _, _, outside in found]
    assert [stage.solved for stage in stages] == pytest.approx([solved for _, solved, _ in found], rel=0.05)


def test_stage_at__is_the_first_that_holds_the_contact():
    stages = (
        Stage((9, 9), 4, outside=1.0),
        Stage((9, 9), 81, width=(8.0, 8.0)),
        Stage((15, 15), 225, width=(14.0, 14.0)),
    )
    for level, width, number in [(0.9, 99.0, 0), (1.0, 7.9, 1), (1.0, 8.0, 2), (9.0, 99.0, 2)]:
        assert stage_at(stages, level, (1.0, width)) == number
        assert stage_at(stages, level, (width, 1.0)) == number


def test_solved_on__shares_the_convolutions_among_the_stages_and_does_not_shrink_again():
    stages = (Stage((10, 10), 100, width=(1.0, 1.0)), Stage((20, 20), 400, width=(2.0, 2.0)), Stage((40, 40), 1600))
    course = tuple(Passed(0.1, (width, width), work) for width, work in [(0.5, 10), (1.5, 30), (0.5, 40)])
    solved = solved_on(stages, CostEstimate(3, 3, 80, 0.0, 0.1, True, level=0.1, course=course))
    assert (solved.shares, solved.cells, solved.part, solved.growths) == ((0.125, 0.875), 400, 1.0, 1)
    assert solved.mean(float) == 0.125 * 100 + 0.875 * 400


def test_memory__that_follows_a_contact_and_moves_to_larger_grids():
    """Seven fields and a half, six for padding: an exponential is held twice, and a state waits."""
    settings, cells = Settings(boundary="free", fields=("pressure",)), 10**6

    def fields(acts_on, grows=False):
        memory = choose_memory(rv.zener(1e6, 1e6, 1e5), 0.5, 1e-2, acts_on=acts_on).memory
        return march_bytes(settings, cells, memory, grows=grows) / (8 * cells)

    assert fields("pressure") - fields("displacement") == pytest.approx(13 + 5.2)
    assert fields("pressure", grows=True) - fields("pressure") == pytest.approx(12)


def test_contact_at_the_border__is_foreseen_where_it_ends_the_run(study):
    text = BALL[: BALL.index("[surface]")] + (
        '[surface]\ngenerate = "self_affine"\nsize = "1 mm"\nshape = [40, 36]\nhurst = 0.8\nrms_slope = 0.1\nseed = 1\n'
    )
    rough = study(text + BALL[BALL.index("[material]") :])
    accepted = vary(rough, {"solve.edge": "accept"})
    costs = rv.plan([rough, accepted])
    assert list(costs.border_warning.values != "") == [True, False]
    assert "Warning: Contact is expected to reach the border of the free-space domain of 40 x 36 cells" in said_of(
        costs
    )
    with pytest.raises(EdgeContactError):
        rv.run(rough, progress=False)


def test_grid_that_would_grow_too_large__is_foreseen(study, monkeypatch):
    for module in (profile_module, estimate):
        monkeypatch.setattr(module, "MOST_CELLS", 40**2)
    monkeypatch.setattr("roughvisc.study.cost.estimate.MOST_CELLS", 40**2)
    case = study(HEAD + GROWING["mirrored"])
    costs = rv.plan([case])
    assert (int(costs.final_cells_x[0]), int(costs.final_cells_y[0])) == (36, 36)
    assert "Contact is expected to reach the border" in costs.border_warning.item()
    with pytest.raises(EdgeContactError):
        rv.run(case, progress=False)
