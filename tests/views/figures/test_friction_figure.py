"""The figure of steady sliding."""

import numpy as np
import pytest
import xarray as xr
from support import labels, lines, text_boxes

import roughvisc as rv
from roughvisc.labels import annotate
from roughvisc.variables import NOT_CONVERGED

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
