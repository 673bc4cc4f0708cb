"""Figure of the solver: iterations, step lengths, and the parts of the stated error."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from roughvisc.errors import InputError
from roughvisc.units import unit_for
from roughvisc.variables.axes import AXES, axis_of
from roughvisc.views.figures import style
from roughvisc.views.figures.histories import steps_of
from roughvisc.views.figures.rows import RowAxis, require, rows_of

#: What is stated of accuracy first, then its parts, and what comes on top.
_ERRORS = (
    ("stated_error", "stated", "k", 1.6),
    ("time_error", "time steps", style.ORANGE, 1.0),
    ("residual", "contact solver (estimate)", style.PURPLE, 1.0),
    ("grid_error_pressure", "grid, pressure", style.SKY, 1.0),
    ("grid_error_area", "grid, area", style.GREEN, 1.0),
    ("grid_error_approach", "grid, approach", style.BLUE, 1.0),
    ("grid_error_gap", "grid, gap", style.VERMILION, 1.0),
)
_COSTS = (("convolutions", "convolutions", style.BLUE), ("iterations", "iterations", style.SKY))
#: Errors below this part of the largest are not shown.
_FAINTEST = 1e-5
#: Width of a panel. [inch]
_WIDTH = 5.6


@style.apply
def diagnostics(dataset: xr.Dataset) -> Figure:
    """What the solver did: cost of each row, length of each step, and the stated error with its parts.

    What the result does not hold is left out. Over time the steps are all accepted ones, cost and errors those of the
    kept times. The tolerance is a dotted line.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the Dataset is not one case's result, or holds neither cost nor accuracy.
    """
    require(dataset)
    dataset = dataset.sortby(axis_of(dataset.variables))
    steps = rows_of(steps_of(dataset))
    drawn = [
        (_draw_cost, any(name in dataset for name, _, _ in _COSTS)),
        (_draw_steps, steps.size > rows_of(dataset).size),
        (_draw_accuracy, any(name in dataset for name, _, _, _ in _ERRORS)),
    ]
    chosen = [draw for draw, known in drawn if known]
    if not chosen:
        raise InputError("the result holds neither iterations nor errors: nothing to draw")
    figure = style.new_figure(_WIDTH + 1.0, 0.6 + 1.6 * len(chosen))
    axes = list(figure.subplots(len(chosen), 1, sharex=True, squeeze=False)[:, 0])
    axis = RowAxis.of(steps)
    for ax, draw in zip(axes, chosen, strict=True):
        draw(ax, axis, dataset, steps)
        axis.apply(ax, steps)
        ax.grid(color="0.9", lw=0.5)
        style.legend_over(ax, _WIDTH)
        if ax is not axes[-1]:
            ax.set_xlabel("")
    style.letter_panels(axes)
    figure.align_ylabels(axes)
    return figure


def _draw_cost(ax: Axes, axis: RowAxis, dataset: xr.Dataset, steps: xr.DataArray) -> None:
    """What every row has cost."""
    rows = axis.unit(rows_of(dataset))
    found = [(dataset[name].values.astype(float), label, colour) for name, label, colour in _COSTS if name in dataset]
    for values, label, colour in found:
        ax.plot(rows, values, color=colour, marker=style.marker_of(len(rows)), ms=2.5, lw=1, label=label)
    shown = np.concatenate([values for values, _, _ in found])
    if shown.min() > 0 and shown.max() > 100 * shown.min():
        ax.set_yscale("log")
    else:
        style.leave_room(ax, shown)
        ax.yaxis.set_major_locator(MaxNLocator(5, integer=True))
    ax.set_ylabel(f"Per {AXES[str(rows_of(dataset).name)].rows.removesuffix('s')}")


def _draw_steps(ax: Axes, axis: RowAxis, dataset: xr.Dataset, steps: xr.DataArray) -> None:
    """Length of every accepted step, at its end."""
    lengths = np.diff(steps.values)
    known = lengths > 0
    unit = unit_for(lengths, "s")
    ax.plot(axis.unit(steps)[1:][known], unit(lengths)[known], ".", color=style.BLUE, ms=3)
    ax.set_yscale("log")
    ax.yaxis.set_minor_formatter(NullFormatter())
    ax.set_ylabel(unit.label("Step length"))


def _draw_accuracy(ax: Axes, axis: RowAxis, dataset: xr.Dataset, steps: xr.DataArray) -> None:
    """What the rows state of themselves."""
    floor, ceiling = math.inf, 0.0
    for name, label, colour, width in _ERRORS:
        if name not in dataset:
            continue
        rows, values = axis.unit(rows_of(dataset)), dataset[name].values.astype(float)
        known = np.isfinite(values) & (values > 0)
        if known.any():
            look = {"marker": style.marker_of(len(rows)), "ms": 2.5, "lw": width}
            ax.plot(rows[known], values[known], color=colour, label=label, **look)
            floor, ceiling = min(floor, values[known].min()), max(ceiling, values[known].max())
    tolerance = dataset.attrs.get("tolerance")
    if tolerance:
        ax.axhline(tolerance, color="0.3", lw=0.8, ls=(0, (1, 1.5)), label="tolerance")
        floor, ceiling = min(floor, tolerance), max(ceiling, tolerance)
    if ceiling > 0:
        floor = max(floor, _FAINTEST * ceiling)
        ax.set_yscale("log")
        ax.set_ylim(floor / 3, ceiling * 3)
        decades = math.log10(ceiling / floor) + 1
        ax.yaxis.set_major_locator(LogLocator(numticks=5))
        ax.yaxis.set_minor_locator(LogLocator(subs=range(2, 10) if decades < 5 else (1.0,), numticks=99))
        ax.yaxis.set_minor_formatter(NullFormatter())
    else:
        ax.set_yticks([])
    ax.set_ylabel("Relative error")
