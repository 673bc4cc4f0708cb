"""The figure of steady sliding."""

import numpy as np
import pytest
import xarray as xr
from support import labels, lines, text_boxes

import roughvisc as rv
from roughvisc.labels import annotate
from roughvisc.variables import NOT_CONVERGED
from roughvisc.views.figures import animate

SPEEDS = np.array([2e-3, 2e-5, 2e-4])


def curve():
    """Three speeds, not in order, of which the last in order did not converge."""
    values = {
        "friction_coefficient": [0.3, 0.01, 0.2],
        "contact_fraction": [0.02, 0.2, 0.1],
        "persson_friction_coefficient": [0.5, 0.02, 0.3],
        "persson_contact_fraction": [0.01, 0.18, 0.09],
        "status": [NOT_CONVERGED, 0, 0],
    }
    return annotate(xr.Dataset({n: ("speed", v) for n, v in values.items()}, coords={"speed": SPEEDS}))


def test_friction__draws_both_in_the_order_of_the_speed():
    left, right = rv.plot.friction(curve()).axes
    for ax, label, expected in (
        (left, "Friction coefficient", [0.01, 0.2, 0.3]),
        (right, "Contact fraction", [0.2, 0.1, 0.02]),
    ):
        speed, drawn = lines(ax)[label].get_data()
        np.testing.assert_allclose(speed, [0.02, 0.2, 2.0])
        assert drawn.tolist() == expected
        assert ax.get_ylabel() == label
        assert ax.get_ylim()[0] == 0
        assert ax.get_ylim()[1] > max(expected)
    assert left.get_xlabel() == "Speed [mm/s]"
    assert left.get_xscale() == "log"


def test_friction__open_circles_where_not_converged():
    for ax in rv.plot.friction(curve()).axes:
        full, hollow = (line for line in ax.lines if line.get_marker() == "o")
        np.testing.assert_allclose(full.get_xdata(), [0.02, 0.2])
        np.testing.assert_allclose(hollow.get_xdata(), [2.0])
        assert hollow.get_markerfacecolor() == "w"


@pytest.mark.parametrize("persson", [False, True])
def test_friction__has_a_legend_of_the_theory_and_no_label_covers_another(persson):
    figure = rv.plot.friction(curve(), persson=persson)
    assert len(labels(figure)) == 3
    boxes = text_boxes(figure)
    for i, (one, box) in enumerate(boxes):
        assert box.x0 >= 0
        assert box.x1 <= figure.bbox.width, one
        assert not any(box.overlaps(other) for _, other in boxes[i + 1 :]), one
    assert len(figure.legends) == persson
    dotted = [line for ax in figure.axes for line in ax.lines if line.get_linestyle() == ":" and len(line.get_xdata())]
    if persson:
        assert "as in full contact" in figure.legends[0].get_texts()[1].get_text()
        assert [line.get_ydata().tolist() for line in dotted] == [[0.02, 0.3, 0.5], [0.18, 0.09, 0.01]]
        assert figure.axes[0].get_ylim()[1] > 0.5
    else:
        assert dotted == []


def test_friction__of_a_body_without_it_and_of_one_speed():
    one = curve().isel(speed=[1]).assign(friction_coefficient=("speed", [0.0]))
    assert rv.plot.friction(one).axes[0].get_ylim() == (0, 1)


@pytest.mark.parametrize(
    ("other", "message"),
    [
        (xr.Dataset(), "'friction_coefficient' over the speed"),
        (3, "'friction_coefficient' over the speed"),
        (curve().drop_vars("contact_fraction"), "'contact_fraction' over the speed"),
        (curve().rename(speed="time"), "'friction_coefficient' over the speed"),
    ],
)
def test_friction__refuses_what_is_no_friction_result(other, message):
    with pytest.raises(rv.InputError, match=f"expected a result of rv.friction, with {message}"):
        rv.plot.friction(other)


def test_friction__refuses_the_theory_where_it_is_not_in_the_result():
    with pytest.raises(rv.InputError, match="'persson_contact_fraction' over the speed"):
        rv.plot.friction(curve().drop_vars("persson_contact_fraction"), persson=True)


def test_friction__draws_the_grids_error_and_what_the_last_octave_adds_where_these_are_told():
    told = {
        "grid_error_friction": [0.1, 0.5, np.nan],
        "grid_error_area": [0.1, 0.1, 0.1],
        "last_octave_friction": [0.25, 0.5, 0.1],
        "last_octave_area": [-0.01, -0.02, 0.0],
    }
    figure = rv.plot.friction(annotate(curve().assign({name: ("speed", one) for name, one in told.items()})))
    left, right = figure.axes
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "computed",
        "error of the grid",
        "without the shortest octave of waves",
    ]
    (band,) = left.collections
    points = np.concatenate([path.vertices for path in band.get_paths()])
    assert points[:, 1].max() == pytest.approx(0.3 * 1.1)
    assert (points[:, 1] >= 0).all()
    (dashed,) = [line for line in left.lines if line.get_linestyle() == "--"]
    np.testing.assert_allclose(dashed.get_ydata(), [0.005, 0.18, 0.225])
    assert not [line for line in right.lines if line.get_linestyle() == "--"], "two per cent are not worth a line"
    boxes = text_boxes(figure)
    assert not any(box.overlaps(other) for i, (_, box) in enumerate(boxes) for _, other in boxes[i + 1 :])


def sliding(direction="x"):
    """Pressures of three speeds, not in order, on a surface twice as long as wide."""
    fields = np.zeros((3, 8, 4))
    for row, cells in enumerate((2, 6, 4)):
        fields[row, 1 : 1 + cells, 1:3] = 1e5 * (1 + row)
    axes = {"x": (np.arange(8) + 0.5) * 1e-4, "y": (np.arange(4) + 0.5) * 1e-4}
    found = curve().assign(friction_coefficient=("speed", [0.1, 0.01, 0.2]))
    found = found.assign(pressure=(("speed", "x", "y"), fields), height=(("x", "y"), np.zeros((8, 4))))
    found = annotate(found.assign_coords(axes))
    return found.assign_attrs(direction=direction)


@pytest.mark.parametrize(("direction", "arrow"), [("x", "→"), ("-x", "←"), ("y", "↑"), ("-y", "↓")])
def test_maps_of_friction__are_of_low_peak_and_high_speed_with_the_motion(direction, arrow):
    figure = rv.plot.maps(sliding(direction))
    panels = [ax for ax in figure.axes if ax.images]
    assert [ax.get_title(loc="left").partition("  ")[2] for ax in panels] == [
        f"{arrow} V = 0.02 mm/s\nµ = 0.01",
        f"{arrow} V = 0.2 mm/s\nµ = 0.2",
        f"{arrow} V = 2 mm/s\nµ = 0.1",
    ]
    drawn = [np.ma.getdata(ax.images[0].get_array()) for ax in panels]
    assert [int((one > 0).sum()) for one in drawn] == [12, 8, 4], "in the order of the speed"
    assert panels[0].images[0].get_array().shape == (4, 8), "x to the right"


def test_maps_of_friction__at_speeds_that_are_asked_for():
    figure = rv.plot.maps(sliding(), ["1.5 mm/s", 3e-5])
    titles = [ax.get_title(loc="left").split("\n")[0] for ax in figure.axes if ax.images]
    assert [title.partition("  ")[2] for title in titles] == ["→ V = 2 mm/s", "→ V = 0.02 mm/s"]
    small = sliding()
    small["friction_coefficient"][:] = [0.3, 3.2e-5, 0.2]
    assert r"µ = 3.2$\times 10^{-5}$" in rv.plot.maps(small, 2e-5).axes[0].get_title(loc="left")
    for speeds in ([], [1.0] * 25):
        with pytest.raises(rv.InputError, match="choose 1 to 24"):
            rv.plot.maps(sliding(), speeds)
    with pytest.raises(rv.InputError, match="holds no 'pressure'"):
        rv.plot.maps(sliding().drop_vars("pressure"))
    with pytest.raises(AttributeError, match=r"write rv\.plot\.maps\(ds\)"):
        _ = rv.plot.friction_maps


def several(shift=(1.0, 100.0)):
    """Two cases of one curve at two temperatures."""
    cases = [curve().assign_coords(speed=SPEEDS / factor) for factor in shift]
    stacked = {name: (("case", "speed"), np.array([one[name].values for one in cases])) for name in cases[0].data_vars}
    found = xr.Dataset(stacked, coords={"speed": SPEEDS}).assign(
        reduced_speed=(("case", "speed"), np.outer(shift, SPEEDS)),
        contact_area=2.0 * xr.DataArray(stacked["contact_fraction"][1], dims=("case", "speed")),
    )
    found = annotate(found)
    kelvin = {"long_name": "material.temperature", "units": "K"}
    return found.assign_coords(material_temperature=("case", np.array([293.0, 313.0]), kelvin))


def test_friction_of_cases__has_a_line_a_case_and_a_legend():
    figure = rv.plot.friction_of_cases(several())
    friction, area = figure.axes
    full = [line for line in friction.lines if line.get_linestyle() == "-"]
    assert [line.get_ydata().tolist() for line in full] == [[0.01, 0.2, 0.3]] * 2
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["293 K", "313 K", "not converged"]
    assert (friction.get_xlabel(), friction.get_ylabel()) == ("Speed [µm/s]", "Friction coefficient")
    assert (friction.get_xscale(), friction.get_ylim()[0], area.get_ylim()[0]) == ("log", 0, 0)
    boxes = text_boxes(figure)
    assert not any(box.overlaps(other) for i, (_, box) in enumerate(boxes) for _, other in boxes[i + 1 :])


def test_friction_of_cases__against_the_reduced_speed():
    friction, _ = rv.plot.friction_of_cases(several(), reduced=True).axes
    at = [line.get_xdata() for line in friction.lines if line.get_linestyle() == "-"]
    np.testing.assert_allclose(at[1], 100 * at[0])
    assert "a_T V" in friction.get_xlabel()
    with pytest.raises(rv.InputError, match="with 'reduced_speed' over the speed in every case"):
        rv.plot.friction_of_cases(several().drop_vars("reduced_speed"), reduced=True)


def test_sweep_figures__of_friction_have_a_master_curve_where_materials_are_shifted(tmp_path, coarse_pictures):
    def drawn(results):
        return [path.name for path in rv.plot.save_sweep_figures(results, tmp_path)]

    assert drawn(several()) == ["sweep-friction.png", "sweep-master.png"]
    assert drawn(several((1.0, 1.0))) == ["sweep-friction.png"]


def test_figures_over_time__refuse_a_curve_in_plain_words():
    for draw in (rv.plot.hysteresis, rv.plot.friction_against_distance):
        with pytest.raises(rv.InputError, match="lies over speed: expected a history over time"):
            draw(sliding())


def test_film__of_a_curve_of_friction_goes_from_low_to_high_speed():
    figure, draw, frames = animate._moving(sliding(), None, 3)
    shown, cells = [], []
    for frame in frames:
        draw(frame)
        shown.append(figure.axes[0].get_title(loc="left").rpartition("  ")[2])
        cells.append(int((np.ma.getdata(figure.axes[0].images[0].get_array()) > 0).sum()))
    assert shown == ["V = 0.02 mm/s", "V = 0.2 mm/s", "V = 2 mm/s"]
    assert cells == [12, 8, 4], "though the rows are not in this order"
    assert "Friction coefficient" in labels(figure)


def test_figures_of_rows__name_the_speeds():
    """In the order of the speeds, whatever that of the rows."""
    wave = rv.wavy(1e-6, 1e-3, (1e-3, 1e-4), (24, 3), waves=1)
    rubber = rv.zener(shear_modulus=3e6, kelvin_modulus=1e6, kelvin_viscosity=1e3)
    ds = rv.friction(wave, rubber, pressure=5e4, speeds=[0.1, 1e-3], fields=["pressure", "gap"], progress=False)
    over_speed = rv.plot.history(ds)
    assert [ax.get_xlabel() for ax in over_speed.axes if ax.get_xlabel()][-1] == "Speed [mm/s]"
    (fraction,) = (ax for ax in over_speed.axes if ax.get_ylabel().startswith("Contact area"))
    line = fraction.get_lines()[0]
    assert line.get_xdata().tolist() == [1.0, 100.0]
    assert (np.diff(line.get_ydata()) < 0).all() == (np.diff(ds.sortby("speed").contact_area) < 0).all()
    assert rv.plot.section(ds, time=0.1).axes[0].get_title(loc="right").startswith("V = 100 mm/s")
    assert rv.plot.maps(ds, times=[1e-3]).axes[0].get_title(loc="left").partition("  ")[2].startswith("→ V = 1 mm/s")
