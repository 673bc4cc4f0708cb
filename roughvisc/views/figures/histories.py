"""Figures of histories: force, approach and area over time, hysteresis loops, area against load."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from roughvisc.errors import InputError
from roughvisc.groups import whole_of
from roughvisc.variables import NOT_CONVERGED, VARIABLES
from roughvisc.variables.axes import axis_of
from roughvisc.views.figures.axes import (
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    RowAxis,
    letter_panels,
    new_figure,
    require,
    rows_of,
    styled,
    unit_for,
)
from roughvisc.views.observables import area_by_theory
from roughvisc.views.observables import history as over_steps

_PANELS = (
    ("force", BLUE),
    ("approach", VERMILION),
    ("contact_area", GREEN),
    ("mean_gap", PURPLE),
    ("work", ORANGE),
)
#: What else belongs in a panel, with its label, colour and dashes.
_BESIDE = {
    "contact_area": (
        ("contact_area_counted", "counted", "k", (0, (4, 2))),
        ("persson_contact_area", "Persson", "0.5", (0, (1, 1.5))),
    ),
    "work": (
        ("stored_energy", "stored", SKY, (0, (4, 2))),
        ("dissipated_energy", "dissipated", VERMILION, (0, (1, 1.5))),
    ),
}
#: The line that they stand beside.
_ITSELF = {"contact_area": "corrected for the grid", "work": "in all"}
#: What is stated of accuracy first, then its parts, and what comes on top.
_ERRORS = (
    ("stated_error", "stated", "k", 1.6),
    ("time_error", "time steps", ORANGE, 1.0),
    ("residual", "contact solver (estimate)", PURPLE, 1.0),
    ("grid_error", "grid", SKY, 1.0),
)
_COSTS = (("convolutions", "convolutions", BLUE), ("iterations", "iterations", SKY))
#: Errors below this part of the largest are not shown.
_FAINTEST = 1e-5
#: Panels up to which they stand in one column.
_ONE_COLUMN = 3


def marker_of(count: int) -> str:
    """Points are marked as long as they can be told apart."""
    return "o" if count <= 40 else ""


def failed_frames(dataset: xr.Dataset) -> np.ndarray:
    """Frames whose step did not converge."""
    if "status" not in dataset:
        return np.zeros(rows_of(dataset).size, dtype=bool)
    return dataset["status"].values == NOT_CONVERGED


def leave_room(ax: Axes, *values: np.ndarray) -> None:
    """Linear limits from zero to somewhat above the largest value; a constant history lies in the middle."""
    shown = np.concatenate([np.ravel(one) for one in values])
    shown = shown[np.isfinite(shown)]
    lowest, highest = (min(shown.min(), 0.0), max(shown.max(), 0.0)) if shown.size else (0.0, 1.0)
    span = (highest - lowest) or 1.0
    ax.set_ylim(lowest - 0.05 * span, highest + 0.15 * span)


def _draw_history(ax: Axes, axis: RowAxis, dataset: xr.Dataset, steps: xr.Dataset, name: str, colour: str) -> None:
    """A line through every accepted step, and a dot at each kept time."""
    times, values = axis.unit(rows_of(steps)), steps[name].values
    unit = unit_for(values, VARIABLES[name].units)
    beside = [one for one in _BESIDE.get(name, ()) if one[0] in steps and steps[one[0]].notnull().any()]
    ax.plot(times, unit(values), color=colour, label=_ITSELF[name] if beside else "_")
    if marker := marker_of(rows_of(dataset).size):
        ax.plot(axis.unit(rows_of(dataset)), unit(dataset[name]), ls="", marker=marker, color=colour)
    failed = failed_frames(steps)
    if failed.any():
        note = "not converged" if name == "force" else "_"
        ax.plot(times[failed], unit(values[failed]), "x", color="k", ms=5, mew=1.2, zorder=5, label=note)
    for other, said, shade, dashes in beside:
        ax.plot(times, unit(steps[other]), color=shade, ls=dashes, lw=0.9, label=said)
    leave_room(ax, *(unit(steps[one]) for one in (name, *(one[0] for one in beside))))
    ax.set_ylabel(unit.label(VARIABLES[name].label))


def _fraction_axis(ax: Axes, steps: xr.Dataset) -> None:
    """Contact fraction on the right of the panel of the area, where the two are proportional."""
    if "contact_fraction" not in steps:
        return
    area = unit_for(steps["contact_area"], "m^2")(steps["contact_area"])
    touching = area > 0
    if not touching.any():
        return
    ratios = 100 * steps["contact_fraction"].values[touching] / area[touching]
    ratio = float(np.nanmean(ratios))
    if ratio > 0 and float(np.nanmax(np.abs(ratios - ratio))) < 1e-6 * ratio:  # not so on a tapered surface
        right = ax.secondary_yaxis("right", functions=(lambda shown: shown * ratio, lambda shown: shown / ratio))
        right.set_ylabel("of nominal [%]")


def _draw_accuracy(ax: Axes, axis: RowAxis, dataset: xr.Dataset) -> None:
    """What the kept times state of themselves."""
    floor, ceiling = math.inf, 0.0
    for name, label, colour, width in _ERRORS:
        if name not in dataset:
            continue
        times, values = axis.unit(rows_of(dataset)), dataset[name].values.astype(float)
        known = np.isfinite(values) & (values > 0)
        if known.any():
            style = {"marker": marker_of(len(times)), "ms": 2.5, "lw": width}
            ax.plot(times[known], values[known], color=colour, label=label, **style)
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
        ax.text(0.5, 0.5, "no accuracy recorded", transform=ax.transAxes, ha="center", va="center", color="0.4")
    ax.set_ylabel("Rel. error")


def _draw_cost(ax: Axes, axis: RowAxis, dataset: xr.Dataset) -> None:
    """What every row has cost."""
    times = axis.unit(rows_of(dataset))
    found = [(dataset[name].values.astype(float), label, colour) for name, label, colour in _COSTS if name in dataset]
    for values, label, colour in found:
        ax.plot(times, values, color=colour, marker=marker_of(len(times)), ms=2.5, lw=1, label=label)
    shown = np.concatenate([values for values, _, _ in found])
    if shown.min() > 0 and shown.max() > 100 * shown.min():
        ax.set_yscale("log")
    else:
        leave_room(ax, shown)
        ax.yaxis.set_major_locator(MaxNLocator(5, integer=True))
    over = str(rows_of(dataset).name)
    ax.set_ylabel("Per kept time" if over == "time" else f"Per {over}")


@styled
def history(dataset: xr.Dataset, *, persson: bool = False) -> Figure:
    """Force, approach, contact area, mean gap and work over the axis of a result, with its cost and accuracy.

    Over time these are drawn at every accepted step, cost and accuracy at kept times.

    Rows are dots, where these are few. What the result does not hold is left out. The time axis is linear or
    logarithmic as the steps suit. Steps that did not converge are crossed out. Work is that of the force so far, in
    all and by where it went: stored in the springs of the material, or dissipated. Accuracy is the stated error, its
    parts, and the tolerance as a line.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result.
    persson : bool
        Whether to draw the contact area by Persson's theory too, up to where the load falls: see
        :func:`~roughvisc.views.observables.area_by_theory`.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the Dataset is not one case's result, or holds none of the histories; of Persson's theory, as that.
    """
    require(dataset)
    dataset, over = whole_of(dataset), axis_of(dataset.variables)
    dataset = dataset if over == "time" else dataset.sortby(over)
    steps = over_steps(dataset) if over == "time" else dataset
    if persson:
        theory = area_by_theory(steps.assign(height=dataset["height"]).assign_attrs(dataset.attrs))
        steps = steps.assign(persson_contact_area=theory["persson_contact_area"])
    panels = [panel for panel in _PANELS if panel[0] in steps]
    if not panels:
        names = ", ".join(name for name, _ in _PANELS)
        raise InputError(f"the result holds none of {names}: nothing to draw over {over}")
    costs = any(name in dataset for name, _, _ in _COSTS)
    figure, axes = _history_panels(len(panels) + costs)
    axis = RowAxis.of(rows_of(steps))
    for ax, (name, colour) in zip(axes, panels, strict=False):
        _draw_history(ax, axis, dataset, steps, name, colour)
        if name == "contact_area":
            _fraction_axis(ax, steps)
    if costs:
        _draw_cost(axes[-2], axis, dataset)
    _draw_accuracy(axes[-1], axis, dataset)
    for ax in axes:
        axis.apply(ax, rows_of(steps))
        lowest = ax.get_subplotspec().is_last_row() or _nothing_below(ax, axes)
        ax.tick_params(labelbottom=lowest)
        ax.set_xlabel(ax.get_xlabel() if lowest else "")
        ax.grid(axis="both", color="0.9", lw=0.5)
        if count := len(ax.get_legend_handles_labels()[1]):
            across = 5 if len(axes) > _ONE_COLUMN + 1 or count < 4 else 3
            told = {"ncols": across, "borderaxespad": 0.15, "handlelength": 1.6, "columnspacing": 1.4}
            ax.legend(loc="lower left", bbox_to_anchor=(0.08, 1.0), **told)
    letter_panels(axes)
    figure.align_ylabels(axes)
    return figure


def _history_panels(count: int) -> tuple[Figure, list[Axes]]:
    """So many panels in one or two columns, and one below them across the whole width."""
    columns = 1 if count <= _ONE_COLUMN else 2
    rows = -(-count // columns)
    figure = new_figure(4.6 if columns == 1 else 7.4, 1.25 * rows + 1.3 + 0.25 * (columns - 1))
    grid = figure.add_gridspec(rows + 1, columns, height_ratios=[1.0] * rows + [0.75])
    cells = [grid[number // columns, number % columns] for number in range(count)]
    return figure, [figure.add_subplot(cell) for cell in (*cells, grid[rows, :])]


def _nothing_below(ax: Axes, axes: Sequence[Axes]) -> bool:
    """Whether no panel of the same column has its time axis right below."""
    place = ax.get_subplotspec()
    below = [other.get_subplotspec() for other in axes]
    return not any(one.rowspan.start == place.rowspan.stop and one.colspan == place.colspan for one in below)
