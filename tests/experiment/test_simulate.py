"""The labelled result: what is in it, what is refused, and the part of a free surface that is solved on."""

import dataclasses

import numpy as np
import pytest
from support import at_rows

import roughvisc as rv
from roughvisc.experiment import profile as domain
from roughvisc.experiment.kept_times import kept_times
from roughvisc.solve import Recorder
from roughvisc.variables import FIELDS, STATUS_MEANINGS, VARIABLES

BALL = rv.sphere(1e-3, size=3e-4, shape=(31, 34))
PRESS = rv.Program().load(2e-3, over=0).hold(1.0)
ZENER = rv.zener(1e6, 1e6, 1e6)


def simulate(height=BALL, material=ZENER, program=PRESS, **settings):
    return rv.simulate(height, material, program, **{"progress": False, "times": 3, "tolerance": 1e-2, **settings})


def test_result__holds_declared_variables_with_units():
    ds = simulate(fields=FIELDS)
    assert dict(ds.sizes) == {"time": 3, "x": 31, "y": 34}
    assert set(ds.variables) <= set(VARIABLES)
    steps = ds.roughvisc.steps
    assert steps.sizes["step"] > 3
    for name, variable in [*ds.variables.items(), *steps.variables.items()]:
        assert variable.attrs.get("units", "") == VARIABLES[name].units
        assert "long_name" in variable.attrs
        assert "axis" not in variable.attrs
    assert ds.attrs["Conventions"] == "CF-1.11"
    assert steps.status.attrs["flag_meanings"].split()[int(at_rows(ds).status[0])] == "converged"
    np.testing.assert_allclose(ds["time"], [0.0, 1e-3**0.5, 1.0])


@pytest.mark.thorough
def test_analytic_profile__grows_and_ends_as_on_a_large_grid():
    """Growth changes nothing but cost; what was kept before it is reported on the final grid."""
    program = rv.Program().load(0.1, over=0.2).hold(1.0)
    small = rv.sphere(1e-3, size=(62e-6, 58e-6), shape=(31, 29))
    large = rv.sphere(1e-3, size=(702e-6, 698e-6), shape=(351, 349))
    settings = {"tolerance": 1e-2, "times": 3, "fields": FIELDS}
    grown, exact = (simulate(h, rv.maxwell(1e6, 1e6), program, **settings) for h in (small, large))
    assert grown.sizes["x"] > 100
    assert grown.approach.values == pytest.approx(exact.approach.values, rel=3e-3)
    x, y = ((exact.sizes[axis] - grown.sizes[axis]) // 2 for axis in ("x", "y"))
    inside = exact.isel(x=slice(x, x + grown.sizes["x"]), y=slice(y, y + grown.sizes["y"]))
    for name in ("height", "pressure", "displacement"):  # a cell at the edge may have just entered in one of them
        off = np.abs(grown[name].values - inside[name].values).sum((-2, -1))
        assert (off <= 1e-3 * abs(exact[name]).sum(("x", "y")).values).all()
    assert "grown from" in grown.attrs["history"]


def test_zero_load__is_open():
    ds = simulate(program=rv.Program().load(2e-3, over=0).hold(0.5).load(0, over=0).hold(0.5), times=[0.25, 0.75])
    assert [STATUS_MEANINGS[i] for i in at_rows(ds).status.values] == ["converged", "open"]
    assert np.isfinite(ds.approach.values).all()
    assert np.isfinite(ds.gap.values).all()


@pytest.mark.parametrize(
    ("times", "expected"),
    [
        (None, None),
        (1, (2.0,)),
        (3, (0.0, 0.5, 2.0)),
        (2, (0.0, 2.0)),
        ([0.5 + 1e-15, 0.7, 0.7 + 1e-16, 0.7 + 1e-9, np.nextafter(2.0, 0.0), 2.0], (0.5, 0.7, 0.7 + 1e-9, 2.0)),
    ],
)
def test_kept_times__are_counted_listed_or_snapped(times, expected):
    assert kept_times(rv.Program().load(1.0, over=0.5).hold(1.5), times) == expected


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"height": BALL.where(BALL.max() > BALL)}, "height is missing at 2 of 1054"),
        ({"height": BALL / (BALL.max() > BALL)}, "height holds infinite"),
        ({"height": BALL * np.nan}, "height is missing everywhere"),
        ({"height": BALL.values}, "height: found ndarray"),
        ({"height": BALL.assign_attrs(units="K")}, "height: .* K'"),
        ({"program": rv.Program()}, "program"),
        ({"times": [2.0]}, "times holds 2 s"),
        ({"boundary": "periodic", "program": rv.Program().approach(1e-3, over=1)}, "program.0: found 0.001"),
        (
            {"boundary": "periodic", "program": rv.Program.cycle(2e-6, 1e-5, 1.0, 1, control="approach")},
            "program.1: found 1.2e-05",
        ),
    ],
)
def test_bad_input__is_named(wrong, named):
    with pytest.raises(rv.InputError, match=named):
        simulate(**{"boundary": "free", **wrong})


def test_progress__is_reported_to_a_function():
    seen = []
    simulate(progress=lambda now, end: seen.append((now, end)))
    assert seen[-1] == (1.0, 1.0)
    assert seen == sorted(seen)


# ----------------------------------------------------------------------------------------------------------------
# the part of a free surface that can touch


def two_hills(shape=(151, 133)):
    """Rough hills of unequal height on a slope: the lower one is touched late, far from the first contact."""
    rough = rv.self_affine((3e-4, 2.6e-4), shape, hurst=0.8, rms_height=1.5e-8, rolloff=1e-4, shortcut=1e-5, seed=5)
    x, y = rough.x.values[:, None], rough.y.values
    first = 4e-7 - ((x - 1.1e-4) ** 2 + (y - 1.2e-4) ** 2) / 2e-3
    second = 1.5e-7 - ((x - 2.2e-4) ** 2 + (y - 1.6e-4) ** 2) / 2e-3
    return rough.copy(data=rough.values + np.maximum(first, second)).drop_attrs()


def same_results(followed, whole):
    """Two runs at a tolerance of 3e-3 agree, on a part of the surface and on the whole."""
    assert followed.sizes == whole.sizes
    force, depth = float(whole.force.max()), float(whole.approach.max())
    cell = float(whole.x[1] - whole.x[0]) * float(whole.y[1] - whole.y[0])
    assert np.abs(followed.approach - whole.approach).max() < 3e-3 * depth
    assert (np.abs(followed.pressure - whole.pressure).sum(("x", "y")) * cell).max() < 2 * 3e-3 * force
    for field in ("gap", "displacement"):
        assert np.abs(followed[field] - whole[field]).max() < 1e-2 * depth
    assert followed.mean_gap.values == pytest.approx(followed.gap.mean(("x", "y")).values, rel=1e-3)


FOLLOWED = {
    "loading and unloading": (
        ZENER,
        rv.Program().load(2e-3, over=0.5).hold(0.5).load(0, over=0.3).load(1e-3, over=0.2),
    ),
    "stress relaxation": (ZENER, rv.Program().approach(7e-7, over=0.2).hold(0.5).approach(1e-7, over=0.2)),
}


@pytest.mark.parametrize(
    "name", ["stress relaxation", pytest.param("loading and unloading", marks=pytest.mark.thorough)]
)
@pytest.mark.parametrize("margin", [None, 0.4], ids=["", "outgrown"])
def test_part_of_the_surface__changes_nothing_but_cost(name, margin, solved_on, monkeypatch):
    """With too small a margin the contact outgrows its part, and the run begins anew."""
    material, program = FOLLOWED[name]
    settings = {"boundary": "free", "tolerance": 3e-3, "times": 6, "fields": FIELDS}
    restarts, restart = [], Recorder.restart
    monkeypatch.setattr(Recorder, "restart", lambda self: restarts.append(self) or restart(self))
    if margin:
        monkeypatch.setattr(domain, "MARGIN", margin)
    followed = simulate(two_hills(), material, program, **settings)
    if name == "stress relaxation":
        assert restarts if margin else (95, 61) in solved_on, "it was solved on a part"
    monkeypatch.setattr(domain, "WORTH_CROPPING", 10**9)
    whole = simulate(two_hills(), material, program, **settings)
    assert solved_on[-1] == (151, 133)
    same_results(followed, whole)
    right = followed.x > 1.7e-4
    assert (followed.pressure.where(right).max() > 0) == (whole.pressure.where(right).max() > 0)
    assert (np.abs(followed.contact_area - whole.contact_area) <= 0.02 * whole.contact_area.max()).all()


@pytest.mark.parametrize("indenter", ["sphere", "cone"])
@pytest.mark.parametrize("lost", [0, 6], ids=["", "outgrown"])
def test_part_under_an_indenter__changes_nothing_but_cost(indenter, lost, solved_on, monkeypatch):
    """The part follows the estimated contact. If the estimate is too small by some cells, the run begins anew."""
    size, shape = (3e-4, 2.7e-4), (91, 83)
    height = rv.sphere(1e-3, size=size, shape=shape) if indenter == "sphere" else rv.cone(0.1, size=size, shape=shape)
    program = rv.Program().load(1e-3, over=0.3).hold(0.5).load(0, over=0.3).load(6e-4, over=0.2)
    settings = {"boundary": "free", "tolerance": 3e-3, "times": 6, "fields": FIELDS}
    estimated, lost_cells = domain.estimated, np.array([[lost], [-lost]])

    def too_small(*given):
        found = estimated(*given)
        return dataclasses.replace(found, cells=found.cells + lost_cells)

    monkeypatch.setattr(domain, "estimated", too_small)
    followed = simulate(height, ZENER, program, **settings)
    widths = {where[0] for where in solved_on} - {91, 46}  # without estimates and the coarser grid
    assert min(widths) < 72
    assert (len(widths) > 1) == (lost > 0)
    monkeypatch.setattr(domain, "WORTH_CROPPING", 10**9)
    whole = simulate(height, ZENER, program, **settings)
    same_results(followed, whole)


def test_contact_at_the_border_of_a_scan__is_refused():
    with pytest.raises(rv.EdgeContactError, match="151 x 133"):
        simulate(two_hills(), ZENER, rv.Program().load(3.0, over=0.5), boundary="free")
