"""The figure of friction against distance, and frames that tell the distance."""

import numpy as np
import pytest
import xarray as xr
from support import labels

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.labels import annotate
from roughvisc.views import plot
from roughvisc.views.sweep_figures.files import sweep_figures

#: A stroke, a stop and a stroke back, in micrometres; what is pressed on before does not show.
DISTANCE = [0, 0, 10, 20, 30, 30, 30, 40, 50]
FRICTION = [np.nan, 0.0, 0.2, 0.3, 0.3, 0.1, 0.05, -0.02, 0.28]


@pytest.fixture
def slid():
    count, grid = len(DISTANCE), (4, 3)
    series = {
        "force": np.append(0.0, np.ones(count - 1)),
        "approach": np.linspace(0, 1e-6, count),
        "friction_coefficient": np.array(FRICTION),
        "sliding_distance": 1e-6 * np.array(DISTANCE),
        "contact_area": 1e-9 * np.append(0.0, np.arange(8.0, 0, -1)),
        "status": np.zeros(count, dtype=int),
    }
    fields = {"pressure": (("time", "x", "y"), np.ones((count, *grid)))}
    coords = {"time": np.arange(float(count)), "x": 1e-6 * np.arange(4), "y": 1e-6 * np.arange(3)}
    return annotate(xr.Dataset({name: ("time", values) for name, values in series.items()} | fields, coords))


def test_figure__draws_strokes_as_lines_and_stops_as_dots(slid):
    top, low = rv.plot.friction_against_distance(slid).axes
    drawn = [line.get_xydata().tolist() for line in top.lines if len(line.get_xdata()) and line.get_color() != "0.3"]
    drawn = [points for points in drawn if points]
    assert drawn[0] == [[0, 0.0], [10, 0.2], [20, 0.3], [30, 0.3]]
    assert drawn[1] == [[30, 0.3], [30, 0.1], [30, 0.05]]
    assert drawn[2] == [[30, 0.05], [40, -0.02], [50, 0.28]]
    assert [text.get_text() for text in top.get_legend().get_texts()] == ["sliding", "at a stop"]
    assert top.get_ylabel() == "Friction coefficient"
    assert low.get_xlabel() == "Sliding distance [µm]"
    assert top.get_ylim()[0] < -0.02


def test_figure__crosses_out_what_did_not_converge(slid):
    slid["status"][3] = 1
    for ax in rv.plot.friction_against_distance(slid).axes:
        (crossed,) = [line for line in ax.lines if line.get_marker() == "x"]
        assert crossed.get_xdata().tolist() == [20]


def test_figure__is_one_of_a_result_that_slides(slid):
    assert "slide" in [name for name, _ in plot.figures_of(slid)]
    with pytest.raises(InputError, match="sliding_distance"):
        rv.plot.friction_against_distance(slid.drop_vars("sliding_distance"))


def test_frames__tell_the_distance(slid):
    film = rv.plot.animation(slid, frames=4)
    film._func(4)
    assert "30 µm slid" in film._fig.axes[0].get_title(loc="left")
    assert "Friction coefficient" in labels(film._fig)
    film._draw_was_started = True


def test_sweep__of_slides_is_drawn_over_time_and_not_over_speed(slid):
    other = slid.assign(contact_area=2 * slid["contact_area"])
    results = xr.concat([slid, other], xr.DataArray([1.0, 2.0], dims="case", name="load"))
    names = [name for name, _, _ in sweep_figures(results)]
    assert "histories" in names
    assert "friction" not in names
