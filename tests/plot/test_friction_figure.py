"""Figures of steady sliding: the values drawn, in the order of the speed."""

import numpy as np
import pytest
import xarray as xr

import roughvisc as rv
from roughvisc.labels import label
from roughvisc.plot.save import save_sweep_figures

SPEEDS = np.array([2e-3, 2e-5, 2e-4])


def curve():
    """Three speeds, not in order."""
    values = {
        "friction_coefficient": [0.3, 0.01, 0.2],
        "contact_fraction": [0.02, 0.2, 0.1],
        "persson_friction_coefficient": [0.5, 0.02, 0.3],
        "persson_contact_fraction": [0.01, 0.18, 0.09],
        "status": [0, 0, 0],
    }
    return label(xr.Dataset({n: ("speed", v) for n, v in values.items()}, coords={"speed": SPEEDS}))


def test_friction__draws_both_in_the_order_of_the_speed():
    above, below = rv.plot.friction(curve()).axes
    for ax, name, expected in (
        (above, "Friction coefficient", [0.01, 0.2, 0.3]),
        (below, "Contact fraction", [0.2, 0.1, 0.02]),
    ):
        speed, drawn = ax.lines[0].get_data()
        np.testing.assert_allclose(speed, [0.02, 0.2, 2.0])
        assert drawn.tolist() == expected
        assert ax.get_ylabel() == name
        assert ax.get_yscale() == "linear"
        assert ax.get_ylim()[0] <= 0 < max(expected) < ax.get_ylim()[1]
    assert below.get_xlabel() == "Speed [mm/s]"
    assert below.get_xscale() == "log"


def test_friction__draws_the_theory():
    figure = rv.plot.friction(curve())
    dashed = [line for ax in figure.axes for line in ax.lines if line.get_label() == "Persson"]
    assert [line.get_ydata().tolist() for line in dashed] == [[0.02, 0.3, 0.5], [0.18, 0.09, 0.01]]
    assert figure.axes[0].get_ylim()[1] > 0.5


@pytest.mark.parametrize("other", [xr.Dataset(), 3, curve().rename(speed="time")])
def test_friction__refuses_other_results(other):
    with pytest.raises(rv.InputError):
        rv.plot.friction(other)


@pytest.mark.parametrize("axis", ["speed", "time"])
def test_history__draws_the_stated_error_and_that_of_the_grid_as_a_band(axis):
    """The error of the grid is relative to the same speed, or to the largest row over time."""
    errors = {"grid_error_friction": [0.1, 0.5, np.nan], "friction_coefficient_error": [0.01, 0.02, 0.01]}
    ds = curve().assign({name: ("speed", values) for name, values in errors.items()}).rename(speed=axis)
    (ax,) = rv.plot.history(label(ds), "friction_coefficient").axes
    (band,) = ax.collections
    points = np.concatenate([path.vertices for path in band.get_paths()])
    values = ds["friction_coefficient"].values
    scale = values if axis == "speed" else values.max()
    error = scale * np.array(errors["grid_error_friction"]) + errors["friction_coefficient_error"]
    ends = np.concatenate([values - error, values + error])
    np.testing.assert_allclose(np.unique(points[:, 1].round(9)), np.unique(ends[np.isfinite(ends)].round(9)))


def sliding(direction="x"):
    """Pressures of three speeds, not in order, on a surface twice as long as wide."""
    fields = np.zeros((3, 8, 4))
    for row, cells in enumerate((2, 6, 4)):
        fields[row, 1 : 1 + cells, 1:3] = 1e5 * (1 + row)
    axes = {"x": (np.arange(8) + 0.5) * 1e-4, "y": (np.arange(4) + 0.5) * 1e-4}
    found = curve().assign(friction_coefficient=("speed", [0.1, 0.01, 0.2]))
    found = found.assign(pressure=(("speed", "x", "y"), fields), height=(("x", "y"), np.zeros((8, 4))))
    found = label(found.assign_coords(axes))
    return found.assign_attrs(direction=direction)


def test_maps_of_friction__are_in_the_order_of_the_speed():
    panels = [ax for ax in rv.plot.maps(sliding()).axes if ax.images]
    drawn = [np.ma.getdata(ax.images[0].get_array()) for ax in panels]
    assert [int((one > 0).sum()) for one in drawn] == [12, 8, 4]
    assert drawn[0].shape == (4, 8), "x to the right"


def test_maps_of_friction__at_speeds_that_are_asked_for():
    figure = rv.plot.maps(sliding(), ["1.5 mm/s", 3e-5])
    drawn = [np.ma.getdata(ax.images[0].get_array()) for ax in figure.axes if ax.images]
    assert [int((one > 0).sum()) for one in drawn] == [4, 12]
    for speeds in ([], [1.0] * 9):
        with pytest.raises(rv.InputError, match="1 to 8"):
            rv.plot.maps(sliding(), speeds)
    with pytest.raises(rv.InputError, match="holds no 'pressure'"):
        rv.plot.maps(sliding().drop_vars("pressure"))


def several(shift=(1.0, 100.0)):
    """Two cases of one curve at two temperatures."""
    cases = [curve().assign_coords(speed=SPEEDS / factor) for factor in shift]
    stacked = {name: (("case", "speed"), np.array([one[name].values for one in cases])) for name in cases[0].data_vars}
    found = xr.Dataset(stacked, coords={"speed": SPEEDS}).assign(
        reduced_speed=(("case", "speed"), np.outer(shift, SPEEDS)),
        contact_area=2.0 * xr.DataArray(stacked["contact_fraction"][1], dims=("case", "speed")),
    )
    found = label(found)
    kelvin = {"long_name": "material.temperature", "units": "K"}
    return found.assign_coords(material_temperature=("case", np.array([293.0, 313.0]), kelvin))


def test_sweep__of_friction_has_a_line_for_each_case_also_against_the_reduced_speed():
    figure = rv.plot.sweep(several())
    (friction,) = figure.axes
    assert [line.get_ydata().tolist() for line in friction.lines] == [[0.01, 0.2, 0.3]] * 2
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["293", "313"]
    assert (friction.get_xlabel(), friction.get_ylabel()) == ("Speed [mm/s]", "Friction coefficient")
    assert friction.get_xscale() == "log"
    (friction,) = rv.plot.sweep(several(), along="reduced_speed").axes
    at = [line.get_xdata() for line in friction.lines]
    np.testing.assert_allclose(at[1], 100 * at[0])


def test_sweep_figures__of_friction_have_a_master_curve_where_materials_are_shifted(tmp_path, coarse_pictures):
    curves = ["sweep-friction_coefficient-speed.png", "sweep-contact_fraction-speed.png"]

    def drawn(results):
        return [path.name for path in save_sweep_figures(results, tmp_path)]

    assert drawn(several()) == [*curves, "sweep-master.png"]
    assert drawn(several((1.0, 1.0))) == curves


#: Loading, a stroke, a stop and a stroke back, in micrometres.
DISTANCE = [0, 0, 10, 20, 30, 30, 30, 40, 50]
FRICTION = [np.nan, 0.0, 0.2, 0.3, 0.3, 0.1, 0.05, -0.02, 0.28]


def test_history__over_the_distance():
    series = {"friction_coefficient": np.array(FRICTION), "sliding_distance": 1e-6 * np.array(DISTANCE)}
    series |= {"force": np.ones(9), "approach": np.ones(9)}
    coords = {"time": np.arange(9.0)}
    slid = label(xr.Dataset({name: ("time", values) for name, values in series.items()}, coords))
    (ax,) = rv.plot.history(slid, over="sliding_distance").axes
    np.testing.assert_allclose(ax.lines[0].get_xdata(), DISTANCE)
    np.testing.assert_allclose(ax.lines[0].get_ydata(), FRICTION)
    assert ax.get_xlabel() == "Sliding distance [µm]"
    with pytest.raises(rv.InputError, match="sliding_distance"):
        rv.plot.history(slid.drop_vars("sliding_distance"), over="sliding_distance")
