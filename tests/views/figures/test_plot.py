"""Figures by their artists: what is drawn, in which units, and that no label covers another."""

import inspect
import itertools
import re
import sys

import matplotlib
import numpy as np
import pytest
import sample_results as made
import xarray as xr
from matplotlib.animation import FuncAnimation
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from PIL import Image
from support import labels, lines, text_boxes, told

import roughvisc as rv
from roughvisc import observables, plot
from roughvisc.errors import InputError
from roughvisc.topography.parameters import levelled_parameters
from roughvisc.views.figures import animate as animation
from roughvisc.views.figures import rows, sections, style

SAMPLES = {
    "creep": made.hertz_creep,
    "rough": made.rough_creep,
    "cycle": lambda: made.hertz_cycle(500, (17, 12), 10),
    "one frame": made.one_frame,
    "open": made.open_contact,
    "24 decades": lambda: made.hertz_creep((15, 12), times=np.r_[0, np.geomspace(1e-12, 1e12, 25)]),
    "two frames": lambda: made.rough_creep(frames=2),
    "strip": lambda: made.rough_creep((150, 21)).assign_coords(y=(np.arange(21) + 0.5) * 8e-6),
    "thin strip": lambda: made.rough_creep((800, 8)).assign_coords(y=(np.arange(8) + 0.5) * 2.5e-6),
    "thin pillar": lambda: made.rough_creep((8, 800)).assign_coords(x=(np.arange(8) + 0.5) * 2.5e-6),
    "pillar": lambda: made.rough_creep((21, 150)).assign_coords(x=(np.arange(21) + 0.5) * 8e-6),
}


def first_picture(dataset):
    """The figure of an animation, as its first picture."""
    return animation._moving(dataset, None, 3)[0]


def without_absent(dataset):
    """A result whose absent cells are closed: what a fluid does there is not known, and leakage is refused."""
    return dataset.assign(gap=dataset["gap"].fillna(0.0))


#: those of a history; of curves of friction: test_friction_figure.py, and of slides: test_friction_distance.py
APART = {"speed", "sliding_distance"}
OVER_TIME = [name for name, (_, needed, _) in plot.FIGURES.items() if not APART & {*needed}]
FIGURES = {name: getattr(plot, plot.FIGURES[name][0]) for name in OVER_TIME}
FIGURES["leakage"] = lambda dataset: plot.leakage(without_absent(dataset))
FIGURES["conductance"] = lambda dataset: plot.conductance(dataset.merge(observables.conductance(dataset, (5.0, 0))))
FIGURES["film of the flow"] = lambda dataset: animation._moving(without_absent(dataset), "flux", 2)[0]
FIGURES |= {"area_against_load": plot.area_against_load, "animate": first_picture}


#: figures whose layout depends on the proportions of the map
OF_THE_PLANE = ("maps", "section", "surface", "animate", "leakage", "film of the flow")
#: samples that are told apart by figures that solve for a flow
FLOWS = {"leakage": ("rough", "one frame", "24 decades", "thin strip", "thin pillar"), "film of the flow": ("rough",)}
FLOWS["conductance"] = ("rough", "one frame", "24 decades")
DRAWN = [(name, sample) for name in FIGURES for sample in SAMPLES]
DRAWN = [(name, sample) for name, sample in DRAWN if name in OF_THE_PLANE or not sample.endswith(("strip", "pillar"))]
DRAWN = [(name, sample) for name, sample in DRAWN if sample in FLOWS.get(name, SAMPLES)]


def _members():
    """A history and a strip of every figure, and of those of the plane all samples, in the default suite."""
    for name, sample in DRAWN:
        quick = sample in ("rough", "thin strip") or name in ("section", "maps")
        yield (name, sample) if quick else pytest.param(name, sample, marks=pytest.mark.thorough)


@pytest.mark.parametrize(("name", "sample"), list(_members()))
def test_every_figure__has_labels_with_units_that_do_not_overlap(name, sample):
    figure = FIGURES[name](SAMPLES[sample]())
    assert isinstance(figure, Figure)
    boxes = text_boxes(figure)
    for (one, a), (other, b) in itertools.combinations(boxes, 2):
        assert not a.overlaps(b), f"{one!r} covers {other!r}"
    page = figure.bbox.padded(2)
    for text, box in boxes:
        inside = page.x0 <= box.x0 and box.x1 <= page.x1 and page.y0 <= box.y0 and box.y1 <= page.y1
        assert inside, f"{text!r} runs off the figure"
    for label in labels(figure):
        bare = label in ("Relative error", "Per kept time", "Contact clusters", "Clusters at least as large")
        bare |= label == "Flux over its largest"
        assert bare or "]" in label, label


def test_figures__leave_no_global_state():
    before = dict(matplotlib.rcParams)
    plot.history(made.hertz_creep())
    plot.maps(made.one_frame())
    assert dict(matplotlib.rcParams) == before
    if "matplotlib.pyplot" in sys.modules:
        assert sys.modules["matplotlib.pyplot"].get_fignums() == []


@pytest.mark.parametrize("draw", [plot.history, plot.maps, plot.section, plot.hysteresis, plot.distributions])
def test_figures__refuse_many_cases_and_other_things(draw):
    with pytest.raises(InputError, match=r"ds\.isel\(case=0\)"):
        draw(xr.concat([made.one_frame()] * 2, dim="case"))
    with pytest.raises(InputError, match="found list"):
        draw([1.0])
    with pytest.raises(InputError, match="no time at all"):
        draw(made.one_frame().isel(time=slice(0)))


# ------------------------------------------------------------------------------------------------- units, times


def test_time_axis__chosen_by_the_data():
    assert not rows.RowAxis.of(np.linspace(0, 5, 500)).logarithmic
    assert rows.RowAxis.of(np.geomspace(1e-3, 1e3, 30)).logarithmic
    assert rows.RowAxis.of(np.r_[0, np.geomspace(1e-3, 1e3, 30)]).logarithmic
    assert not rows.RowAxis.of([0.0]).logarithmic
    assert rows.RowAxis.of(np.linspace(0, 0.05, 9)).unit.symbol == "ms"


def test_spread_frames__first_and_last_and_even():
    times = np.r_[0, np.geomspace(1e-3, 1e3, 499)]
    frames = rows.spread_frames(times, 4)
    assert frames[[0, -1]].tolist() == [0, 499]
    assert len(frames) == 4
    assert np.all(np.abs(np.diff(frames) - 500 / 3) < 20)
    assert rows.spread_frames(np.linspace(0, 1, 501), 3).tolist() == [0, 250, 500]
    assert rows.spread_frames([3.0], 4).tolist() == [0]
    assert rows.spread_frames([1.0, 2.0], 1).tolist() == [1]


def test_telling_frames__show_contact_and_its_largest_extent():
    time = np.linspace(0.0, 1.0, 21)
    area = np.where((time > 0.1) & (time < 0.8), 1.0, 0.0)
    area[13] = 2.0
    area[-1] = 1e-4
    ds = xr.Dataset({"contact_area": ("time", area)}, {"time": time})
    frames = rows.telling_frames(ds, 4)
    assert frames == [3, 7, 13, 15]
    assert rows.fullest_frame(ds) == 13
    assert rows.telling_frames(0 * ds, 3) == [0, 10, 20]
    assert rows.telling_frames(ds.drop_vars("contact_area"), 3) == [0, 10, 20]
    assert rows.fullest_frame(ds.drop_vars("contact_area")) == rows.fullest_frame(0 * ds) == 20


def test_frame_at__nearest_time_or_counted_from_the_end():
    times = [0.0, 1.0, 10.0]
    assert [rows.frame_at(times, t) for t in (0, 0.6, 5.4, 5.6, 99, -1, -3)] == [0, 1, 1, 2, 2, 2, 0]
    for wrong in (-4, -0.5, np.nan):
        with pytest.raises(InputError, match="expected a"):
            rows.frame_at(times, wrong)


# ---------------------------------------------------------------------------------------------------- histories


def test_history__data_and_units():
    ds = made.hertz_creep()
    force, approach, area, gap, work = plot.history(ds).axes
    assert [ax.get_ylabel().replace("\n", " ") for ax in (force, approach, area, gap, work)] == [
        "Force [mN]",
        "Approach [µm]",
        "Contact area [mm²]",
        "Mean gap [µm]",
        "Work [µJ]",
    ]
    np.testing.assert_allclose(gap.lines[0].get_ydata(), 1e6 * ds["mean_gap"])
    np.testing.assert_allclose(work.lines[0].get_ydata(), 1e6 * ds["work"])
    for name in ("stored", "dissipated"):
        np.testing.assert_allclose(lines(work)[name].get_ydata(), 1e6 * ds[f"{name}_energy"])
    assert work.get_xlabel() == "Time [s]"
    assert work.get_xscale() == "symlog"
    np.testing.assert_allclose(approach.lines[0].get_ydata(), 1e6 * ds["approach"])
    np.testing.assert_allclose(lines(area)["corrected"].get_ydata(), 1e6 * ds["contact_area"])


def test_diagnostics__data_and_units():
    ds = made.hertz_creep()
    cost, accuracy = plot.diagnostics(ds).axes
    for name in ("convolutions", "iterations"):
        np.testing.assert_allclose(lines(cost)[name].get_ydata(), ds[name])
    assert accuracy.get_xlabel() == "Time [s]"
    assert accuracy.get_xscale() == "symlog"
    assert list(lines(accuracy)) == ["stated", "time steps", "contact solver (estimate)", "tolerance"]
    np.testing.assert_allclose(lines(accuracy)["stated"].get_ydata(), ds["stated_error"])
    np.testing.assert_allclose(lines(accuracy)["contact solver (estimate)"].get_ydata(), ds["residual"])
    np.testing.assert_allclose(lines(accuracy)["time steps"].get_ydata(), ds["time_error"])
    np.testing.assert_allclose(lines(accuracy)["tolerance"].get_ydata(), 1e-3)
    with pytest.raises(InputError, match="neither iterations nor errors"):
        plot.diagnostics(ds[["force", "approach"]])


def test_diagnostics__length_of_every_accepted_step():
    ds = rv.simulate(
        rv.sphere(1e-2, 1e-3, 12), rv.zener(3e6, 1e6, 1e5), rv.Program().load(5e-3, over=0.1), progress=False, times=3
    )
    _, steps, _ = plot.diagnostics(ds).axes
    taken = ds.roughvisc.steps["time"].values
    assert steps.get_ylabel() == "Step length [ms]"
    np.testing.assert_allclose(steps.lines[0].get_ydata(), 1e3 * np.diff(taken))
    np.testing.assert_allclose(steps.lines[0].get_xdata(), 1e3 * taken[1:])


def test_history__fraction_on_the_right_agrees():
    ds = made.hertz_creep()
    figure = plot.history(ds)
    figure.draw_without_rendering()
    area = figure.axes[2]
    right = area.child_axes[0]
    ratio = right.get_ylim()[1] / area.get_ylim()[1]
    np.testing.assert_allclose(ratio * 1e6 * ds["contact_area"], 100 * ds["contact_fraction"], rtol=1e-9)


def test_history__steps_that_did_not_converge_are_crossed_out():
    ds = made.rough_creep()
    figure = plot.history(ds)
    (crossed,) = [line for line in figure.axes[0].lines if line.get_marker() == "x"]
    np.testing.assert_allclose(crossed.get_xdata(), ds["time"][3])
    assert "not converged" in told(figure)
    assert "not converged" not in told(plot.history(made.hertz_creep()))


@pytest.mark.parametrize(("count", "marker"), [(30, "o"), (60, "|")])
def test_history__kept_times_are_marked_and_explained(count, marker):
    figure = plot.history(made.hertz_creep((9, 8), count))
    assert "kept times" in told(figure)
    for ax in figure.axes:
        (marks,) = [line for line in ax.lines if line.get_marker() == marker]
        assert len(marks.get_xdata()) == count


def test_history__of_what_is_there():
    ds = made.hertz_creep()[["force", "approach", "height"]].assign(time_error=("time", np.full(30, np.nan)))
    ds.attrs = {}
    figure = plot.history(ds)
    assert [ax.get_ylabel() for ax in figure.axes] == ["Force [mN]", "Approach [µm]"]
    lowest = [ax.get_ylabel() for ax in plot.history(made.hertz_creep().drop_vars("force")).axes if ax.get_xlabel()]
    assert lowest == ["Mean gap [µm]", "Work [µJ]"], "the lowest panel of each column"
    with pytest.raises(InputError, match="nothing to draw"):
        plot.history(ds[["height", "time_error"]])


def test_hysteresis__loop_and_work():
    ds = made.hertz_cycle(200)
    (ax,) = plot.hysteresis(ds).axes
    np.testing.assert_allclose(ax.lines[0].get_xdata(), 1e6 * ds["approach"])
    np.testing.assert_allclose(ax.lines[0].get_ydata(), ds["force"])
    assert f"{1e6 * float(ds.work[-1]):.3g} µJ" in ax.lines[2].get_label()
    (ax,) = plot.hysteresis(ds.assign(work=2 * ds.work)).axes
    assert f"{2e6 * float(ds.work[-1]):.3g} µJ" in ax.lines[2].get_label(), "what the result says, nothing of its own"
    assert len(ax.texts) == 5  # arrows


def test_area_against_load__one_line_a_case_and_the_low_load_line():
    ds = made.rough_creep(absent=False)
    ds["force"] = ("time", np.geomspace(0.01, 10, 12))
    figure = plot.area_against_load({"soft": ds, "hard": 2 * ds}, contact_modulus={"glassy": 4e6})
    (ax,) = figure.axes
    assert {"soft", "hard", "low loads, glassy"} <= set(lines(ax))
    assert ax.get_xscale() == ax.get_yscale() == "log"
    np.testing.assert_allclose(lines(ax)["hard"].get_ydata(), 2e6 * ds["contact_area"])
    x, y = lines(ax)["low loads, glassy"].get_data()
    assert ds.attrs["boundary"] == "periodic", "slopes across the border count"
    steps = {name: float(ds[name][1] - ds[name][0]) for name in "xy"}
    slopes = [(ds["height"].roll({name: -1}) - ds["height"]) / step for name, step in steps.items()]
    slope = float(np.sqrt((slopes[0] ** 2 + slopes[1] ** 2).mean()))
    np.testing.assert_allclose(1e-6 * y, np.sqrt(2 * np.pi) * x / (4e6 * slope))


def test_conductance__is_drawn_with_its_error_and_estimates():
    ds = made.rough_creep()
    whole = ds.merge(observables.conductance(ds, ("5 K m/W", 0)))
    (ax,) = plot.conductance(whole).axes
    drawn = lines(ax)
    assert set(drawn) == {"computed, with its error", "Holm", "Greenwood"}
    scale = drawn["Holm"].get_ydata()[-1] / float(whole["thermal_conductance_holm"][-1])
    np.testing.assert_allclose(
        drawn["computed, with its error"].get_ydata(), scale * whole["thermal_conductance"], rtol=1e-9
    )
    assert len(plot.conductance(whole.merge(observables.conductance(ds, ("1 ohm m", 0)))).axes) == 2
    full = whole.copy(deep=True)
    full["thermal_conductance"][-1] = np.inf
    assert np.isnan(lines(plot.conductance(full).axes[0])["computed, with its error"].get_ydata()[-1])
    with pytest.raises(InputError, match="holds no conductance"):
        plot.conductance(ds)


def test_area_against_load__cases_in_many_shapes():
    one = made.hertz_cycle(30)
    stacked = xr.concat([one, one], dim=xr.Variable("case", ["a", "b"]))
    assert {"a", "b"} <= set(lines(plot.area_against_load(stacked).axes[0]))
    assert {"Sphere in cycles", "Sphere in cycles (2)"} <= set(lines(plot.area_against_load([one, one]).axes[0]))
    hundred = plot.area_against_load([one] * 100)
    assert len(hundred.axes[0].lines) == 100
    assert not hundred.legends
    with pytest.raises(InputError, match="no result given"):
        plot.area_against_load([])
    with pytest.raises(InputError, match="found int"):
        plot.area_against_load(3)


# ------------------------------------------------------------------------------------------------------- fields


def images(figure):
    return [image for ax in figure.axes for image in ax.images]


def test_maps__data_scale_and_absent_cells():
    ds = made.rough_creep()
    figure = plot.maps(ds, times=[0.0, 1.0, -1])
    shown = images(figure)
    assert [image.get_gid() for image in shown] == ["pressure"] * 3 + ["gap"] * 3
    frames = [0, 4, 11]
    for image, frame in zip(shown[:3], frames, strict=True):
        expected = 1e-6 * ds["pressure"].isel(time=frame).where(ds["height"].notnull()).T
        np.testing.assert_allclose(image.get_array().filled(np.nan), expected)
    for image, frame in zip(shown[3:], frames, strict=True):
        np.testing.assert_allclose(image.get_array().filled(np.nan), 1e6 * ds["gap"].isel(time=frame).T)
        assert 0 < image.get_clim()[0] < 1e-9, "so that contact lies below the scale"
        gaps = 1e6 * ds["gap"].isel(time=frames).values
        beyond = np.mean(gaps[gaps > 0] > image.get_clim()[1])
        assert beyond <= 2.1e-3, "but for two of a thousand values, the scale holds all"
    absent = ds["height"].isnull().values.T
    for image in shown:
        assert np.array_equal(np.ma.getmaskarray(image.get_array()), absent)
        assert tuple(image.get_cmap().get_bad()) == to_rgba(style.ABSENT)
        assert image.axes.get_aspect() == 1.0
        np.testing.assert_allclose(image.get_extent(), [0, 1.2, 0, 0.9])
    assert len({image.get_clim() for image in shown[:3]}) == 1
    titles = [ax.get_title(loc="left").partition("  ")[2] for ax in figure.axes[:3]]
    assert titles == ["t = 0.01 s", "t = 1.52 s", "t = 10000 s"], "all in one unit"
    assert "Pressure [MPa]" in labels(figure)
    assert "Gap [µm]" in labels(figure)


def test_maps__outline_encloses_the_contact():
    ds = made.hertz_creep()
    (ax,) = (ax for ax in plot.maps(ds, times=-1, fields="pressure").axes if ax.images)
    (outline,) = (artist for artist in ax.collections if artist.get_gid() == "contact outline")
    points = np.concatenate([path.vertices for path in outline.get_paths()])
    distance = np.hypot(points[:, 0] - 1.0, points[:, 1] - 0.75)
    radius = np.sqrt(float(ds["approach"][-1]) * 10e-3) * 1e3
    assert np.all(np.abs(distance - radius) < 0.06)


@pytest.mark.parametrize("touching", [0.0, 1.0])
def test_maps__no_outline_around_nothing_or_everything(touching):
    ds = made.one_frame()
    ds["pressure"][:] = touching
    assert not any(ax.collections for ax in plot.maps(ds).axes if ax.images)


def test_maps__load_only_the_frames_drawn():
    seen = []

    def watch(block, block_info=None):
        seen.append(block_info[0]["chunk-location"][0])
        return block

    ds = made.hertz_creep().chunk(time=1)
    gap = ds["gap"].data.map_blocks(watch, dtype=float, meta=np.empty((0, 0, 0)))
    with_watch = ds.assign(gap=(("time", "x", "y"), gap))
    plot.maps(with_watch, times=[-1], fields=["gap"])
    assert set(seen) <= {29}


def test_maps__choices():
    ds = made.hertz_creep()
    assert len(images(plot.maps(ds))) == 8
    assert len(images(plot.maps(ds, times=ds["time"].values[:6], fields="gap"))) == 6
    assert len(images(plot.maps(ds.drop_vars("pressure")))) == 4
    assert images(plot.maps(ds, times=5.0, fields=["displacement"]))[0].get_gid() == "displacement"
    with pytest.raises(InputError, match="30 times to map"):
        plot.maps(ds, times=ds["time"].values)
    with pytest.raises(InputError, match="field 'stress' is unknown"):
        plot.maps(ds, fields=["stress"])
    with pytest.raises(InputError, match="holds no 'pressure'"):
        plot.maps(ds.drop_vars(["pressure", "gap", "displacement"]))


@pytest.mark.parametrize("axis", ["x", "y"])
def test_section__surfaces_touch_where_pressure_is(axis):
    ds = made.hertz_creep()
    figure = plot.section(ds, axis=axis)
    top, bottom = figure.axes
    profile, surface, contact = bottom.lines[:3]
    index = {"x": {"y": 21}, "y": {"x": 30}}[axis]
    last = ds.isel(time=-1, **index)
    np.testing.assert_allclose(profile.get_ydata(), 1e6 * last["height"])
    np.testing.assert_allclose(surface.get_ydata(), 1e6 * (last["height"] + last["gap"]), atol=1e-9)
    assert np.array_equal(np.isfinite(contact.get_ydata()), last["pressure"] > 0)
    np.testing.assert_allclose(top.patches[0].get_data().values, 1e-3 * last["pressure"])
    assert (top.get_ylabel(), bottom.get_ylabel()) == ("Pressure [kPa]", "Height [µm]")
    assert bottom.get_xlabel() == f"{axis} [mm]"
    level = lines(bottom)["undeformed"].get_ydata()[0]
    assert level == pytest.approx(1e6 * float(ds["height"].max() - ds["approach"][-1]))


def test_section__draws_the_undeformed_surface_below_an_apex_between_the_cells():
    ds = made.hertz_creep()
    ds["height"].attrs["highest"] = float(ds["height"].max()) + 2e-8
    level = lines(plot.section(ds).axes[1])["undeformed"].get_ydata()[0]
    assert level == pytest.approx(1e6 * float(ds["height"].max() + 2e-8 - ds["approach"][-1]))


def test_section__states_its_exaggeration():
    figure = plot.section(made.hertz_creep())
    bottom = figure.axes[1]
    (note,) = (text for text in bottom.texts if text.get_gid() == "exaggeration")
    box, view = bottom.get_window_extent(), bottom.viewLim
    ratio = box.height / (view.height * 1e-6) / (box.width / (view.width * 1e-3))
    assert float(note.get_text().split("×")[1]) == pytest.approx(ratio, rel=0.05)


def test_section__gap_and_displacement_give_the_same_surface():
    ds = made.hertz_creep()
    by_gap = sections.deformed_surface(ds.drop_vars("displacement"), 5)
    for other in (ds, ds.drop_vars("gap")):
        np.testing.assert_allclose(sections.deformed_surface(other, 5), by_gap, atol=1e-10)


def test_section__goes_where_it_is_told():
    ds = made.rough_creep()
    figure = plot.section(ds, time=1.0, axis="y", at=0.31e-3)
    assert figure.axes[0].get_title(loc="right") == "t = 1.52 s,  x = 0.306 mm"
    np.testing.assert_allclose(figure.axes[1].lines[0].get_ydata(), 1e6 * ds["height"].isel(x=24))
    with pytest.raises(InputError, match="axis is 'z'"):
        plot.section(ds, axis="z")
    with pytest.raises(InputError, match="no 'gap'"):
        plot.section(ds.drop_vars("gap"))


def test_section__of_a_flat_face_in_full_contact_has_the_scale_of_the_approach():
    ds = made.one_frame()
    ds["height"][:] = ds["gap"][:] = 0.0
    ds["pressure"][:] = 1.0
    ds = ds.drop_vars("displacement")
    bottom = plot.section(ds).axes[1]
    assert bottom.get_ylabel() == "Height [µm]"
    assert lines(bottom)["undeformed"].get_ydata()[0] == pytest.approx(-1e6 * float(ds["approach"][0]))
    bar = plot.maps(ds, fields="gap").axes[-1]
    assert bar.get_yticks() == pytest.approx([0.0], abs=1e-9)


def test_section__without_pressure_says_so():
    top, _ = plot.section(made.hertz_creep().drop_vars("pressure")).axes
    assert [text.get_text() for text in top.texts] == ["pressure was not kept"]


# ----------------------------------------------------------------------------------- distributions and surfaces


def test_distributions__every_curve_encloses_one():
    figure = plot.distributions(made.rough_creep(), bins=30)
    assert [ax.get_xlabel() for ax in figure.axes] == ["Pressure [MPa]", "Gap [µm]"]
    assert [ax.get_ylabel() for ax in figure.axes] == ["Density [1/MPa]", "Density [1/µm]"]
    for ax in figure.axes:
        assert len(ax.patches) == 5
        for curve in ax.patches:
            values, limits, _ = curve.get_data()
            assert np.sum(values * np.diff(limits)) == pytest.approx(1.0)


def test_contact_clusters__areas_add_up_to_the_counted_area():
    ds = made.rough_creep()
    count, area, sizes = plot.contact_clusters(ds, times=[-1]).axes
    number, mean = count.lines[0].get_ydata(), lines(area)["mean"].get_ydata()
    np.testing.assert_allclose(number * mean, 1e6 * ds["contact_area_counted"], rtol=1e-9)
    steps = sizes.lines[0]
    assert steps.get_ydata()[-1] == number[-1]
    assert np.sum(steps.get_xdata()) == pytest.approx(1e6 * float(ds["contact_area_counted"][-1]))


def test_surface__panels_and_missing_points():
    h = made.rough_creep()["height"]
    figure = plot.surface(h)
    on_map, profile, heights, spectrum = figure.axes[:4]
    np.testing.assert_allclose(on_map.images[0].get_array().filled(np.nan), 1e6 * h.T)
    assert figure.get_supxlabel() == f"{100 * float(h.isnull().mean()):.2g} % of the points are missing (grey)."
    np.testing.assert_allclose(profile.lines[0].get_ydata(), 1e6 * h.isel(y=37))
    assert f"normal, Sq = {1e6 * float(rv.parameters(rv.level(h))['Sq']):.3g} µm" in lines(heights)
    assert spectrum.get_xscale() == spectrum.get_yscale() == "log"
    assert spectrum.get_ylabel() == "Power spectral density\n[µm⁴]"


def test_surface__takes_a_result_and_refuses_what_is_no_surface():
    ds = made.hertz_creep()
    assert len(plot.surface(ds).axes) == len(plot.surface(ds["height"].T).axes) == 5
    flat = plot.surface(0 * ds["height"].isel(x=slice(5), y=slice(4)))
    assert [text.get_text() for ax in flat.axes for text in ax.texts] == ["flat: one height", "too small or too flat"]
    with pytest.raises(InputError, match="all missing"):
        plot.surface(np.nan * ds["height"])
    with pytest.raises(InputError, match="expected heights over"):
        plot.surface(ds["force"])
    with pytest.raises(InputError, match="expected one that holds"):
        plot.surface(ds[["force"]])


def test_surface__states_the_sq_and_the_spectrum_of_the_levelled_heights():
    """Those of the report and of the table of a scan, however the surface is tilted."""
    h = rv.self_affine((3e-4, 2e-4), (120, 90), hurst=0.8, rms_height=1e-6, rolloff=5e-5, seed=3)
    tilted = h + 0.1 * h.x - 0.05 * h.y
    heights, spectrum = plot.surface(tilted).axes[2:4]
    assert float(rv.parameters(tilted)["Sq"]) > 4e-6
    sq = float(levelled_parameters(tilted)["Sq"])
    assert f"normal, Sq = {1e6 * sq:.3g} µm" in lines(heights)
    assert heights.get_xlabel() == "Height, levelled [µm]"
    q, density = spectrum.lines[0].get_data()
    whole = rv.psd(rv.level(h), "hann").sel(wavevector=slice(np.pi * 120 / 3e-4))
    np.testing.assert_allclose(1e6 * q, whole.wavevector, rtol=1e-9)
    np.testing.assert_allclose(1e-24 * density, whole.psd, rtol=1e-6)


@pytest.mark.parametrize("share", [0.0, 0.004, 0.1])
def test_surface__draws_the_floor_of_the_points_that_were_measured(share):
    """White noise on waves of eight cells and more: C = variance * cell area at the end, however many are missing."""
    h = rv.self_affine((1.2e-4, 1.1e-4), (120, 110), hurst=0.8, rms_height=1e-6, rolloff=4e-5, shortcut=8e-6, seed=1)
    rng = np.random.default_rng(2)
    h = (h + 3e-9 * rng.standard_normal(h.shape)).where(rng.random(h.shape) >= share)
    spectrum = plot.surface(h).axes[3]
    q, density = spectrum.lines[0].get_data()
    floor = 1e-24 * np.mean(density[q > 0.6 * q[-1]])
    assert floor / (9e-18 * 1e-12) == pytest.approx(1, rel=0.15)
    assert spectrum.get_title("right") == ("gaps bridged" if share else "")


def test_surface__draws_no_spectrum_of_a_scan_that_is_mostly_missing():
    h = rv.self_affine((3e-5, 2e-5), (30, 20), hurst=0.8, rms_height=1e-6, seed=1)
    figure = plot.surface(h.where(np.random.default_rng(1).random(h.shape) < 0.4))
    assert [text.get_text() for text in figure.axes[3].texts] == ["too few measured points"]


def test_surface__of_noise_has_the_level_of_its_variance():
    shape, steps, deviation = (160, 121), (2e-6, 3e-6), 1e-7
    values = deviation * np.random.default_rng(1).standard_normal(shape)
    x, y = (step * (np.arange(n) + 0.5) for n, step in zip(shape, steps, strict=True))
    spectrum = plot.surface(xr.DataArray(values, {"x": x, "y": y})).axes[3]
    # white noise: C = variance * cell area, alike at every wavevector
    density = 1e-24 * spectrum.lines[0].get_ydata()
    np.testing.assert_allclose(np.mean(density) / (deviation**2 * steps[0] * steps[1]), 1.0, rtol=0.03)


def test_surface__of_points_that_determine_no_plane():
    h = made.rough_creep()["height"]
    h = h.where((h.x == h.x[3]) & (h.y < h.y[20]))
    assert float(levelled_parameters(h)["Sq"]) == pytest.approx(float(h.std()), rel=1e-12)
    assert f"normal, Sq = {1e6 * float(h.std()):.3g} µm" in lines(plot.surface(h).axes[2])


# --------------------------------------------------------------------------------------------- files, animation


@pytest.mark.thorough
def test_save_figures__writes_what_the_result_allows(tmp_path):
    ds = made.hertz_creep(shape=(21, 16))
    written = plot.save_figures(ds, tmp_path / "figures", "sphere", dpi=50)
    told = [name for name in OVER_TIME if name not in ("clusters", "hysteresis", "leakage", "conductance")]
    assert [path.name for path in written] == [f"sphere-{name}.png" for name in told], "one spot, and no way back"
    assert sorted(path.name for path in (tmp_path / "figures").iterdir()) == sorted(path.name for path in written)
    for path in written:
        with Image.open(path) as picture:
            assert picture.format == "PNG"
    few = plot.save_figures(ds[["force", "approach"]].isel(time=[3]), tmp_path, "few", suffix=".pdf")
    assert [path.name for path in few] == ["few-history.pdf"]
    with pytest.raises(InputError, match="allows no figure"):
        plot.save_figures(ds[["residual"]], tmp_path, "none")


def test_figures_of__clusters_and_loops_where_there_are_some():
    drawn = {name: [kind for kind, _ in plot.figures_of(SAMPLES[name](), leave="maps")] for name in ("rough", "cycle")}
    assert "clusters" in drawn["rough"]
    assert "hysteresis" not in drawn["rough"]
    assert "hysteresis" in drawn["cycle"]
    assert "clusters" not in drawn["cycle"]
    assert "maps" not in drawn["rough"] + drawn["cycle"]
    ball = made.hertz_creep((21, 16), 5)
    assert [text.get_text() for text in plot.contact_clusters(ball).axes[2].texts] == ["one cluster at most"]
    assert plot.hysteresis(ball).axes[0].get_title() == "The approach does not come back: no loop"
    assert plot.hysteresis(SAMPLES["cycle"]()).axes[0].get_title() == ""


def test_maps__contact_too_ragged_for_an_outline_has_a_colour_in_every_frame():
    smooth, ragged = made.rough_creep(), made.rough_creep()
    ragged["pressure"][-1] = ragged["pressure"][-1].where(ragged["x"] % 2.5e-5 < 1.25e-5, 0.0)
    for ds, outlined in ((smooth, True), (ragged, False)):
        figure = plot.maps(ds, times=[0.0, -1])
        assert "contact" in told(figure)
        pressures, gaps = images(figure)[:2], images(figure)[2:]
        assert [bool(image.axes.collections) for image in pressures] == [outlined] * 2
        for image, frame in zip(gaps, (0, -1), strict=True):
            touching = (ds["gap"].isel(time=frame) <= 0).values.T
            colours = image.to_rgba(image.get_array())
            assert np.all(colours[touching] == to_rgba(style.CONTACT))
            assert not np.any(np.all(colours[~touching] == to_rgba(style.CONTACT), axis=-1))


def test_animate__of_a_mirrored_surface_shows_what_was_measured():
    ds = made.of_mirror_images()
    assert first_picture(ds).axes[0].images[0].get_array().shape == (8, 11)


def test_area_against_load__says_what_the_lines_of_low_loads_assume():
    ds = made.rough_creep(absent=False)
    said = plot.area_against_load(ds, contact_modulus=1e6).get_supxlabel()
    assert all(word in said for word in ("Gaussian", "little contact", "elastic"))
    assert plot.area_against_load(ds, contact_modulus={}).get_supxlabel() == ""


@pytest.mark.parametrize(
    "make",
    [
        made.rough_creep,
        made.one_frame,
        pytest.param(made.hertz_creep, marks=pytest.mark.thorough),
        pytest.param(made.open_contact, marks=pytest.mark.thorough),
    ],
)
def test_animate__gif_has_a_picture_for_each_frame(make, tmp_path):
    ds = make()
    path = plot.animate(ds, tmp_path / "contact.gif", frames=3, dpi=40)
    assert list(tmp_path.iterdir()) == [path]
    with Image.open(path) as picture:
        assert getattr(picture, "n_frames", 1) == min(3, ds.sizes["time"])


def test_animate__map_section_and_history_move_together():
    ds = made.rough_creep()
    figure, draw, frames = animation._moving(ds, "gap", 4)
    on_map, section, force, approach, area = (ax for ax in figure.axes if ax.get_label() != "<colorbar>")
    told = [ax.get_ylabel().replace("\n", " ") for ax in (force, approach, area)]
    assert told == ["Force [N]", "Approach [µm]", "Contact area [mm²]"]
    assert frames == [0, 4, 7, 11]
    for frame in frames:
        draw(frame)
        np.testing.assert_allclose(on_map.images[0].get_array().filled(np.nan), 1e6 * ds["gap"].isel(time=frame).T)
        assert on_map.get_title(loc="left").endswith(
            f"  t = {float(ds['time'][frame]):.3g} s".replace("1e+04", "10000")
        )
        assert approach.lines[2].get_xdata() == pytest.approx(ds["time"].values[frame])
        assert len(approach.lines[1].get_xdata()) == frame + 1
        index = int(ds["pressure"][-1].sum("x").argmax("y"))
        surface = (ds["height"] + ds["gap"].isel(time=frame)).isel(y=index)
        np.testing.assert_allclose(section.lines[1].get_ydata(), 1e6 * surface)


def test_animate__without_histories_or_heights(tmp_path):
    bare = made.rough_creep()[["pressure"]]
    figure, _, frames = animation._moving(bare, None, 2)
    assert frames == [0, 11]
    assert len(figure.axes) == 2, "the map and its scale"


def test_animation__plays_in_a_notebook():
    film = plot.animation(made.rough_creep((22, 16)), frames=2, rate=4)
    assert isinstance(film, FuncAnimation)
    with matplotlib.rc_context({"savefig.dpi": 40}):
        page = film._repr_html_()
    assert page.count("data:image/png;base64") == 2
    assert re.search(r"new Animation\(frames, img_id, slider_id, 250(\.0)?,", page), "a quarter of a second each"
    with pytest.raises(InputError, match="positive"):
        plot.animation(made.one_frame(), rate=0)


def test_animate__refuses_what_it_cannot_write(tmp_path, monkeypatch):
    ds = made.one_frame()
    with pytest.raises(InputError, match=r"ends in \.gif"):
        plot.animate(ds, tmp_path / "contact.txt")
    monkeypatch.setattr(animation.FFMpegWriter, "isAvailable", classmethod(lambda cls: False))
    with pytest.raises(InputError, match="ffmpeg was not found"):
        plot.animate(ds, tmp_path / "contact.mp4")
    with pytest.raises(InputError, match="field is 'height'"):
        plot.animate(ds, tmp_path / "contact.gif", field="height")
    with pytest.raises(InputError, match="positive"):
        plot.animate(ds, tmp_path / "contact.gif", frames=0)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not animation.FFMpegWriter.isAvailable(), reason="ffmpeg is not installed")
def test_animate__mp4(tmp_path):
    path = plot.animate(made.hertz_creep(), tmp_path / "contact.mp4", frames=3, dpi=40)
    assert path.read_bytes()[4:8] == b"ftyp"


def test_stability_map__hatches_what_was_refused_and_frames_what_is_beyond():
    error = xr.DataArray([[1e-5, np.nan], [1e-2, np.inf]], dims=("time", "ratio"), name="error")
    found = error.assign_coords(time=[1e-3, 1e3], ratio=[1.0, 10.0]).to_dataset()
    figure = plot.stability_map(found, expected=1e-3)
    axes = figure.axes[0]
    assert len(axes.lines) == 2, "one error beyond what is expected, one that is no number"
    assert sum(bool(c.get_hatch()) for c in axes.collections) == 1
    assert [t.get_text() for t in figure.legends[0].get_texts()] == ["refused, with a reason", "beyond 0.001"]
    with pytest.raises(InputError, match="expected errors over two parameters"):
        plot.stability_map(found.isel(time=0))


def test_plot__shows_figures_only():
    assert dir(rv.plot) == sorted(rv.plot.__all__)
    for name in rv.plot.__all__:
        assert inspect.isfunction(getattr(rv.plot, name))
        assert getattr(rv.plot, name).__module__.startswith("roughvisc.views")


def test_surface__scale_is_not_moved_by_spikes_and_missing_points_are_grey():
    rng = np.random.default_rng(4)
    values = rng.normal(0, 1e-7, (41, 30))
    values[3, 4], values[5:7, 8] = 1e-4, np.nan
    figure = plot.surface(rv.level(rv.from_array(values, 1e-6)))
    (image,) = figure.axes[0].get_images()
    low, high = image.get_clim()
    assert -1500 < low < high < 1500  # nm: five deviations of a plane that the spike tilts; it is 100,000 away
    text = figure.get_supxlabel()
    assert "0.16 % of the points are missing (grey)" in text
    assert "0.081 % lie beyond the scale" in text
    assert to_rgba(style.ABSENT) == tuple(image.get_cmap().get_bad())
    shades = image.get_cmap()(np.linspace(0, 1, 256))
    assert np.abs(shades - image.get_cmap().get_bad())[:, :3].max(axis=1).min() > 0.15, "no height has that colour"
    (label,) = [ax.get_ylabel() for ax in figure.axes if "max" in ax.get_ylabel()]
    assert label.replace("\n", " ").startswith("Height, levelled [nm] max")
    assert re.search(r"\nmax (100000|1e\+05|\d{5,6}) nm$", label), "the spike is said"
    spread = [patch.get_xy()[:, 0] for patch in figure.axes[2].patches]
    assert all(abs(x).max() < 1500 for x in spread)


def test_maps_and_section__of_a_mirrored_surface_show_what_was_measured():
    whole = made.of_mirror_images()
    ds = whole.assign_attrs(history="read a.x3p")
    (first, *_) = plot.maps(whole).axes
    assert first.get_images()[0].get_array().shape == (8, 11)
    assert plot.maps(ds).axes[0].get_images()[0].get_array().shape == (16, 22)
    profiles = [plot.section(one).axes[1].lines[0].get_xdata() for one in (whole, ds)]
    assert [len(x) for x in profiles] == [11, 22]
    changed = made.rough_creep((22, 16)).assign_attrs(history=whole.attrs["history"] + "\ncropped")
    assert plot.maps(changed).axes[0].get_images()[0].get_array().shape == (16, 22), "no mirror images any more"


def test_leakage__lakes_contact_and_channels_are_told_apart():
    gap = np.full((2, 6, 5), 1e-6)
    gap[:, :, 1] = 0.0
    gap[:, [0, 5], 0] = 0.0  # a lake is left between them
    gap[1, 3] = 0.0
    axes = {"time": [1.0, 2.0], "x": 1e-6 * np.arange(6), "y": 1e-6 * np.arange(5)}
    figure = plot.leakage(xr.Dataset({"gap": (("time", "x", "y"), gap)}, axes))
    assert figure.axes[0].get_title(loc="right") == "closes between 1 and 2 s"
    (image,) = figure.axes[1].images
    colours = image.to_rgba(image.get_array())[..., :3].transpose(1, 0, 2)
    assert np.allclose(colours[2, 1], to_rgba(style.CONTACT)[:3]), "contact"
    assert np.allclose(colours[2, 0], to_rgba(style.NO_CONTACT)[:3]), "a lake"
    assert {"contact", "no flow", "mapped", "kept times"} <= {*told(figure)}
    assert colours[2, 3].min() < 0.5, "the channel"
    closed = plot.leakage(xr.Dataset({"gap": (("time", "x", "y"), gap)}, axes), time=-1)
    (image,) = closed.axes[1].images
    colours = image.to_rgba(image.get_array())[..., :3].transpose(1, 0, 2)
    assert np.allclose(colours[gap[1] > 0], to_rgba(style.NO_CONTACT)[:3])
    assert np.allclose(colours[gap[1] == 0], to_rgba(style.CONTACT)[:3])
