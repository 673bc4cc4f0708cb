"""Figures by their artists: what is drawn, and in which units."""

import itertools

import matplotlib
import numpy as np
import pytest
import sample_results as made
import xarray as xr
from matplotlib.animation import FFMpegWriter
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgba
from PIL import Image
from support import lines, refused

import roughvisc as rv
from roughvisc import observables, plot
from roughvisc.errors import InputError
from roughvisc.plot import fields, style
from roughvisc.plot.save import FIGURES, save_figures
from roughvisc.topography.filters import off_plane


def images(figure):
    return [image for ax in figure.axes for image in ax.images]


def boxes(figure):
    """Return name -> extent of each panel with its labels, the legend, and each text. [pixel]"""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    found = {f"panel {number}": ax.get_tightbbox(renderer) for number, ax in enumerate(figure.axes)}
    artists = [*figure.legends, *figure.texts]
    return found | {f"text {number}": one.get_window_extent(renderer) for number, one in enumerate(artists)}


DRAWN = {
    "history": plot.history,
    "loop": lambda ds: plot.history(ds, "force", over="approach"),
    "maps": lambda ds: plot.maps(ds, fields=["pressure", "gap"]),
    "six times": lambda ds: plot.maps(ds, times=[0, 1, 1, 2, 3, -1]),
    "strip": lambda ds: plot.maps(ds.assign_coords(y=ds.y / 12)),
    "section": plot.section,
    "surface": plot.surface,
    "strip of a surface": lambda ds: plot.surface(ds.assign_coords(y=ds.y / 12)),
    "tall surface": lambda ds: plot.surface(ds.assign_coords(x=ds.x / 12)),
    "area against load": lambda ds: plot.area_against_load({"a": ds, "b": ds}, contact_modulus={"soft": 1e6}),
}


@pytest.mark.parametrize("draw", DRAWN)
@pytest.mark.parametrize("make", [made.rough_creep, made.open_contact])
def test_every_figure__has_nothing_cut_off_or_overlapping_and_leaves_no_global_state(draw, make):
    before = dict(matplotlib.rcParams)
    figure = DRAWN[draw](make())
    found = boxes(figure)
    assert dict(matplotlib.rcParams) == before
    assert all(ax.lines or ax.images or ax.collections or ax.patches or not ax.axison for ax in figure.axes)
    width, height = figure.get_size_inches() * figure.dpi
    for name, box in found.items():
        assert min(box.x0, box.y0, width - box.x1, height - box.y1) >= 0, name
    for (name, box), (other, its) in itertools.combinations(found.items(), 2):
        overlap = min(box.x1, its.x1) - max(box.x0, its.x0), min(box.y1, its.y1) - max(box.y0, its.y0)
        assert min(overlap) < 2, (name, other)


@pytest.mark.parametrize("draw", [plot.maps, plot.section])
def test_figures__refuse_many_cases_and_other_things(draw):
    with pytest.raises(InputError, match=r"ds\.isel\(case=0\)"):
        draw(xr.concat([made.one_frame()] * 2, dim="case"))
    with pytest.raises(InputError, match="list"):
        draw([1.0])
    with pytest.raises(InputError, match="no time"):
        draw(made.one_frame().isel(time=slice(0)))


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
    np.testing.assert_allclose(approach.lines[0].get_ydata(), 1e6 * ds["approach"])
    np.testing.assert_allclose(area.lines[0].get_ydata(), 1e6 * ds["contact_area"])


def test_history__draws_a_leak_rate_of_zero():
    ds = made.hertz_creep((21, 16), 4).assign(leak_rate=("time", [1e-9, 1e-12, 1e-15, 0.0]))
    (ax,) = plot.history(ds, "leak_rate").axes
    assert ax.get_yscale() == "symlog"
    assert ax.lines[0].get_ydata()[-1] == 0
    assert ax.get_ylim()[0] <= 0


def test_area_against_load__one_line_per_case_and_the_low_load_line():
    ds = made.rough_creep(absent=False)
    ds["force"] = ("time", np.geomspace(0.01, 10, 12))
    (ax,) = plot.area_against_load({"soft": ds, "hard": 2 * ds}, contact_modulus={"glassy": 4e6}).axes
    assert {"soft", "hard", "low loads, glassy"} <= set(lines(ax))
    assert ax.get_xscale() == ax.get_yscale() == "log"
    np.testing.assert_allclose(lines(ax)["hard"].get_ydata(), 2e6 * ds["contact_area"])
    x, y = lines(ax)["low loads, glassy"].get_data()
    slope = float(rv.parameters(ds["height"], periodic=True)["Sdq"])
    np.testing.assert_allclose(1e-6 * y, np.sqrt(2 * np.pi) * x / (4e6 * slope))


def test_area_against_load__of_one_result():
    assert set(lines(plot.area_against_load(made.hertz_creep((21, 16))).axes[0])) == {"computed"}
    for wrong in ([], 3):
        with refused("results"):
            plot.area_against_load(wrong)


# ------------------------------------------------------------------------------------------------------- fields


def test_maps__data_scale_and_absent_cells():
    ds = made.rough_creep()
    figure = plot.maps(ds, times=[0.0, 1.0, -1])
    shown = images(figure)
    assert len(shown) == 6
    frames = [0, 4, 11]
    for image, frame in zip(shown[:3], frames, strict=True):
        expected = 1e-6 * ds["pressure"].isel(time=frame).where(ds["height"].notnull()).T
        np.testing.assert_allclose(image.get_array().filled(np.nan), expected)
    for image, frame in zip(shown[3:], frames, strict=True):
        np.testing.assert_allclose(image.get_array().filled(np.nan), 1e6 * ds["gap"].isel(time=frame).T)
        gaps = 1e6 * ds["gap"].isel(time=frames).values
        assert np.mean(gaps[gaps > 0] > image.get_clim()[1]) <= 2.1e-3, "two of a thousand may lie beyond the scale"
        touching = (ds["gap"].isel(time=frame) <= 0).values.T
        colours = image.to_rgba(image.get_array())
        assert np.all(colours[touching] == to_rgba(style.CONTACT))
        assert not np.any(np.all(colours[~touching] == to_rgba(style.CONTACT), axis=-1))
    for image in shown:
        assert np.array_equal(np.ma.getmaskarray(image.get_array()), ds["height"].isnull().values.T)
        np.testing.assert_allclose(image.get_extent(), [0, 1.2, 0, 0.9])
    assert len({image.get_clim() for image in shown[:3]}) == 1
    panels = [image.axes for image in shown]
    assert [ax.get_title(loc="right") for ax in panels] == list("abcdef")
    assert all(ax.collections for ax in panels), "a line around the contact on both fields"


def test_maps__choose_times_by_change_and_leave_out_those_without_contact():
    ds = made.hertz_creep(times=[0.0, 0.01, 0.02, 0.5, 1.0, 2.0, 4.0])
    ds["pressure"][0] = ds["contact_area"][0] = 0.0
    ds["contact_area"][1:] = np.array([1.0, 1.01, 2.0, 2.99, 3.0, 4.0])
    titles = [ax.get_title(loc="left") for ax in plot.maps(ds, fields="pressure").axes[:-1]]
    assert titles == ["t = 10 ms", "t = 500 ms", "t = 2 s", "t = 4 s"]
    assert len(images(plot.maps(made.open_contact(), fields="gap"))) == 2


@pytest.mark.parametrize(("axis", "count"), [("time", 1), ("speed", 2)])
def test_maps__over_speed_have_a_scale_each(axis, count):
    ds = made.rough_creep((24, 20), 2, absent=False).rename(time=axis)[["pressure", "height", "force"]]
    ds[axis].attrs.clear()
    ds["pressure"][1] = 10 * ds["pressure"][0]
    ds["friction_coefficient"] = axis, [0.1, 0.2]
    assert len({image.get_clim() for image in images(plot.maps(ds, times=[0, -1]))}) == count


def test_maps__of_the_times_and_fields_requested():
    ds = made.hertz_creep()
    assert len(images(plot.maps(ds, times=ds["time"].values[:6], fields="gap"))) == 6
    assert len(images(plot.maps(ds.drop_vars("pressure")))) == 4
    (displaced,) = images(plot.maps(ds, times="5 s", fields=["displacement"]))
    np.testing.assert_allclose(displaced.get_array(), 1e6 * ds["displacement"].sel(time=5.0, method="nearest").T)
    for wrong in (ds["time"].values[:9].tolist(), [], [-31.0], [-0.5], [np.inf], 1, 1.0, True):
        with refused("times", wrong):
            plot.maps(ds, times=wrong)
    with refused("fields", "stress"):
        plot.maps(ds, fields=["stress"])
    with pytest.raises(InputError, match="'pressure'"):
        plot.maps(ds.drop_vars(["pressure", "gap", "displacement"]))


def test_maps__of_many_cells_keep_the_extremes_of_every_block(monkeypatch):
    monkeypatch.setattr(fields, "MOST_CELLS", 16)
    ds = made.rough_creep((50, 37), 2, absent=False)
    ds["height"][:4, :4] = ds["height"][6, 7] = np.nan
    ds["pressure"] = ds["pressure"].where(ds["height"].notnull())
    kept = {"pressure": np.max, "gap": np.min, "displacement": np.mean}
    for image, (name, reduction) in zip(images(plot.maps(ds, -1, list(kept))), kept.items(), strict=True):
        drawn = image.get_array().filled(np.nan).T
        whole = ds[name].isel(time=-1).where(ds["height"].notnull()).values
        blocks = {(i, j): whole[4 * i : 4 * i + 4, 4 * j : 4 * j + 4] for i, j in np.ndindex(13, 10)}
        expected = np.array(
            [reduction(one[np.isfinite(one)]) if (i, j) != (0, 0) else np.nan for (i, j), one in blocks.items()]
        )
        np.testing.assert_allclose(drawn.ravel() / np.nanmax(drawn), expected / np.nanmax(expected), rtol=1e-12)
        sides = [4e3 * count * float(ds[axis][1] - ds[axis][0]) for axis, count in (("x", 13), ("y", 10))]
        np.testing.assert_allclose(image.get_extent(), [0, sides[0], 0, sides[1]], atol=1e-9)


def test_maps__of_the_flux_show_the_largest_one():
    gap = np.full((2, 6, 5), 1e-6)
    gap[:, :, 1] = 0.0
    gap[:, [0, 5], 0] = 0.0  # a lake is left between them
    gap[1, 3] = 0.0
    axes = {"time": [1.0, 2.0], "x": 1e-6 * np.arange(6), "y": 1e-6 * np.arange(5)}
    ds = xr.Dataset({"gap": (("time", "x", "y"), gap)}, axes)
    assert len(images(plot.maps(ds, fields="flux"))) == 2, "the second is closed"
    water = observables.leakage(ds, flow=True, viscosity=1e-2)
    drawn = images(plot.maps(ds.merge(water[["leak_rate"]]), times=[1.0], fields="flux"))[0].get_array()
    largest = float(np.hypot(water.flux_x, water.flux_y).max())
    assert any(drawn.max() == pytest.approx(unit * largest, rel=1e-9) for unit in (1e6, 1e12))


@pytest.mark.parametrize("axis", ["x", "y"])
def test_section__surfaces_touch_where_pressure_is(axis):
    ds = made.hertz_creep()
    across, middle = {"x": ("y", 21), "y": ("x", 30)}[axis]
    for index, at in ((middle, None), (middle - 2, float(ds[across][middle - 2]))):
        top, bottom = plot.section(ds, axis=axis, at=at).axes
        profile, surface, contact = bottom.lines[:3]
        last = ds.isel({"time": -1, across: index})
        np.testing.assert_allclose(profile.get_ydata(), 1e6 * last["height"])
        np.testing.assert_allclose(surface.get_ydata(), 1e6 * (last["height"] + last["gap"]), atol=1e-9)
        assert np.array_equal(np.isfinite(contact.get_ydata()), last["pressure"] > 0)
        np.testing.assert_allclose(top.patches[0].get_data().values, 1e-3 * last["pressure"])
        assert (top.get_ylabel(), bottom.get_ylabel()) == ("Pressure [kPa]", "Height [µm]")
        (x0, y0), (x1, y1) = bottom.transData.transform([(0, 0), (1, 1)])  # of a millimetre, of a micrometre
        enlarged = (y1 - y0) / (x1 - x0) / 1e-3
        assert bottom.get_title(loc="left") == f"heights enlarged {enlarged:.3g} times"


# ----------------------------------------------------------------------------------------------------- surfaces


def test_surface__states_the_sq_and_the_spectrum_of_the_levelled_heights():
    h = rv.self_affine((3e-4, 2e-4), (120, 90), hurst=0.8, rms_height=1e-6, rolloff=5e-5, seed=3)
    tilted = h + 0.1 * h.x - 0.05 * h.y
    heights, spectrum = plot.surface(tilted, cutoff="20 um").axes[2:4]
    assert spectrum.lines[1].get_xdata()[0] == pytest.approx(2 * np.pi / 20)
    sq = float(rv.parameters(off_plane(tilted))["Sq"])
    assert heights.get_title(loc="left") == f"Sq = {1e6 * sq:.3g} µm"
    assert sum(bar.get_height() * bar.get_width() for bar in heights.patches) == pytest.approx(1.0)
    q, density = spectrum.lines[0].get_data()
    whole = rv.psd(rv.level(h), "hann").sel(wavevector=slice(np.pi * 120 / 3e-4))
    np.testing.assert_allclose(1e6 * q, whole.wavevector, rtol=1e-9)
    np.testing.assert_allclose(1e-24 * density, whole.psd, rtol=1e-6)


# --------------------------------------------------------------------------------------------- files, animation


@pytest.mark.thorough
def test_save_figures__writes_what_the_result_allows(tmp_path, coarse_pictures):
    ds = made.hertz_creep(shape=(21, 16))
    written = save_figures(ds, tmp_path / "figures", "sphere")
    shown = [path.stem.removeprefix("sphere-") for path in written]
    assert {"history", "maps", "section", "surface"} <= set(shown) <= set(FIGURES)
    assert "friction" not in shown
    assert sorted((tmp_path / "figures").iterdir()) == sorted(written)
    few = save_figures(ds[["force", "approach"]].isel(time=[3]), tmp_path, "few")
    assert [path.name for path in few] == ["few-history.png"]
    with pytest.raises(InputError, match="allows no figure"):
        save_figures(ds[["approach_error"]], tmp_path, "none")


@pytest.mark.parametrize("make", [made.rough_creep, made.one_frame])
def test_animate__gif_has_a_picture_for_each_frame(make, tmp_path):
    ds = make()
    path = plot.animate(ds, tmp_path / "contact.gif")
    assert list(tmp_path.iterdir()) == [path]
    outline = np.array([int(style.OUTLINE[i : i + 2], 16) for i in (1, 3, 5)])
    with Image.open(path) as picture:
        assert getattr(picture, "n_frames", 1) == ds.sizes["time"]
        picture.seek(ds.sizes["time"] - 1)
        pixels = np.asarray(picture.convert("RGB"), float)
    inside = pixels[pixels.shape[0] // 4 : -pixels.shape[0] // 4, pixels.shape[1] // 4 : pixels.shape[1] // 2]
    assert (abs(inside - outline).max(axis=-1) < 60).any(), "a dark line around the contact"


def test_animate__refuses_what_it_cannot_write(tmp_path, monkeypatch):
    ds = made.one_frame()
    with pytest.raises(InputError, match=r"\.gif"):
        plot.animate(ds, tmp_path / "contact.txt")
    monkeypatch.setattr(FFMpegWriter, "isAvailable", classmethod(lambda cls: False))
    with pytest.raises(InputError, match="ffmpeg"):
        plot.animate(ds, tmp_path / "contact.mp4")
    with refused("field", "height"):
        plot.animate(ds, tmp_path / "contact.gif", field="height")
    assert list(tmp_path.iterdir()) == []


# ------------------------------------------------------------------------------------------------- master curves


def test_master_curve__has_the_shifted_rows_on_the_line_of_the_material():
    """A Maxwell element at three temperatures, in tension: every row lies on its moduli at the middle one."""
    temperatures, omega = np.repeat([280.0, 290.0, 300.0], 12), np.tile(np.geomspace(0.3, 30.0, 12), 3)
    x = omega * np.repeat([10.0, 1.0, 0.1], 12)
    storage, loss = 3e6 * (1 + x**2 / (1 + x**2)), 3e6 * x / (1 + x**2)
    keys = {"frequency_unit": "rad/s", "kind": "tensile", "temperatures": temperatures, "vertical": "none"}
    figure = plot.master_curve(rv.dynamic_table(omega, storage, loss, temperature="12 degC", **keys))
    curve, shifts, _ = figure.axes
    for points, line, exact in zip(curve.collections, curve.lines, (storage, loss), strict=True):
        at, moduli = np.ma.getdata(points.get_offsets()).T
        assert np.log10(at) == pytest.approx(np.log10(x), abs=0.02)
        assert moduli == pytest.approx(1e-3 * exact)  # kPa
        assert np.interp(np.log(at), np.log(line.get_xdata()), line.get_ydata()) == pytest.approx(moduli, rel=0.05)
    assert np.ma.getdata(shifts.collections[-1].get_offsets())[:, 1] == pytest.approx([1, 0, -1], abs=0.02)
    with refused("material"):
        plot.master_curve(rv.elastic(1e6))


def test_waves__add_up_to_the_friction_of_each_speed():
    spectrum = rv.psd_table(np.geomspace(1e4, 1e7, 40), np.geomspace(1e-16, 1e-26, 40), convention="psd")
    ds = rv.friction_theory(spectrum, rv.zener(1e6, 1e6, 1e3), speeds=[1e-3, 1e-2, 1e-1], pressure=1e5)
    (axes,) = plot.waves(ds).axes
    totals = [line.get_ydata().sum() for line in axes.lines]
    assert totals == pytest.approx(ds.friction_coefficient.values, rel=1e-6)
    with refused("dataset"):
        plot.waves(ds.drop_vars("friction_of_waves"))
