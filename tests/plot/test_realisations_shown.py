"""Realisations in figures of sweeps: one line a case, its band, and the scan itself; told apart in the legend."""

import numpy as np
import pytest
import scipy.stats
import xarray as xr
from matplotlib.collections import PolyCollection

from roughvisc import plot

LOADS = np.array([0.01, 0.02, 0.04])
TIMES = np.array([0.1, 1.0, 10.0])
FACTORS = np.array([3.0, 0.8, 0.9, 1.1, 1.25])
BANDED = {
    "sweep": lambda ds: plot.sweep(ds, times=-1),
    "several times": plot.sweep,
    "histories": plot.history,
}


def patches(first=0, **more):
    """A sweep of loads for the realisations from a number on; area and gap follow one factor each."""
    numbers = np.arange(first, first + 5)
    area = 1e-7 * LOADS[:, None, None] * FACTORS[:, None] * (1 + np.log10(TIMES / TIMES[0]))
    over = ("case", "realisation", "time")
    keys = [[f"{i}{j}" for j in range(5)] for i in range(3)]
    ds = xr.Dataset(
        {
            "contact_area": (over, area, {"units": "m^2", "long_name": "real contact area"}),
            "force": (over, np.broadcast_to(LOADS[:, None, None], area.shape), {"units": "N"}),
            "status": (over, np.zeros(area.shape, "int8"), {"flag_values": np.arange(4, dtype="int8")}),
        },
        {"time": TIMES, "realisation": numbers, "program_0_load": ("case", LOADS, {"long_name": "program.0.load"})},
    )
    return ds.assign_coords(case_key=(("case", "realisation"), keys), **more)


def interval(values):
    """Of one more log-normal value."""
    x = np.log(values)
    half = scipy.stats.t.ppf(0.975, len(x) - 1) * x.std(ddof=1) * np.sqrt(1 + 1 / len(x))
    return np.exp(x.mean() - half), np.exp(x.mean() + half)


@pytest.mark.parametrize("draw", BANDED)
def test_figures__draw_the_mean_the_band_and_the_scan_itself(draw):
    figure = BANDED[draw](patches())
    (ax,) = figure.axes
    told = [text.get_text() for text in figure.legends[0].get_texts()]
    assert told[-3:] == [
        "mean of 4 Gaussian surrogates",
        "95 % prediction interval",
        "measured scan",
    ]
    bands = [one for one in ax.collections if isinstance(one, PolyCollection)]
    assert len(bands) == (1 if draw == "sweep" else 3)
    corners = bands[-1].get_paths()[0].vertices  # of the largest load over time, or of the end over loads
    low, high = interval(FACTORS[1:])
    top = 1e-7 * LOADS[-1] * 3 * 1e12 if ax.get_ylabel() == "Contact area [µm²]" else 1e-7 * LOADS[-1] * 3 * 1e6
    assert corners[:, 1].max() == pytest.approx(top * high)
    at_end = corners[corners[:, 0] == corners[:, 0].max()]
    assert at_end[:, 1].min() == pytest.approx(top * low)
    drawn = np.concatenate([line.get_ydata() for line in ax.lines])
    for factor in (FACTORS[1:].mean(), FACTORS[0]):
        assert np.isclose(drawn, top * factor).any(), factor
    assert ax.get_ylim()[1] > corners[:, 1].max()


def test_sweep__a_realisation_that_is_missing_does_not_count():
    ds = patches(1)
    hole = (ds["program_0_load"] == LOADS[1]) & (ds["realisation"] == 3)
    ds = ds.assign(contact_area=ds["contact_area"].where(~hole)).assign_coords(case_key=ds["case_key"].where(~hole, ""))
    (ax,) = plot.history(ds).axes
    band = ax.collections[1].get_paths()[0].vertices
    low, _ = interval(FACTORS[[0, 1, 3, 4]])
    unit = 1e12 if "µm²" in ax.get_ylabel() else 1e6
    at_end = band[band[:, 0] == band[:, 0].max()]
    assert at_end[:, 1].min() == pytest.approx(3e-7 * LOADS[1] * low * unit)
