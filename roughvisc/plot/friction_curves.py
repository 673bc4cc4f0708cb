"""Figures of friction: against speed, and against the distance of a program that slides."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from roughvisc.errors import InputError
from roughvisc.observables import history
from roughvisc.plot import style
from roughvisc.plot.rows import require
from roughvisc.plot.sweeps import histories
from roughvisc.units import Unit, unit_for
from roughvisc.variables import VARIABLES

_PANELS = (("friction_coefficient", style.BLUE), ("contact_area", style.CONTACT))


@style.apply
def friction_against_distance(dataset: xr.Dataset) -> Figure:
    """Friction coefficient and contact area against the distance slid, at every accepted step.

    Strokes are lines; what happens at a stop lies at one distance, and is dotted. Friction is counted against the
    motion: after a reversal it begins below zero.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result, of a program with slides.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the Dataset is not one case's result, or its program never slides.
    """
    require(dataset, "time", "sliding_distance", "friction_coefficient")
    steps = history(dataset)
    across = unit_for(steps["sliding_distance"].values, "m")
    distance = across(steps["sliding_distance"].values)
    panels = [panel for panel in _PANELS if panel[0] in steps]
    figure = style.new_figure(4.6, 1.3 + 1.5 * len(panels))
    axes = list(figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0])
    for ax, (name, colour) in zip(axes, panels, strict=True):
        unit = unit_for(steps[name].values, VARIABLES[name].units)
        values = unit(steps[name].values)
        _draw_against_distance(ax, distance, values, colour)
        style.leave_room(ax, values[_shown(distance)])
        ax.set_ylabel(unit.label(VARIABLES[name].label))
        ax.grid(color="0.9", lw=0.5)
    axes[0].axhline(0.0, color="0.3", lw=0.6)
    if len(_stops(distance)):
        axes[0].plot([], [], color="0.3", label="sliding")
        axes[0].plot([], [], color="0.3", lw=0.9, ls=(0, (1, 1.5)), label="at a stop")
        style.legend_over(axes[0], 3.6)
    axes[-1].set_xlabel(across.label(VARIABLES["sliding_distance"].label))
    style.letter_panels(axes)
    figure.align_ylabels(axes)
    return figure


def _shown(distance: np.ndarray) -> np.ndarray:
    """Steps from the one on at which the first slide begins."""
    begins = max(np.flatnonzero(distance > 0)[:1].sum() - 1, 0)
    return np.arange(len(distance)) >= begins


def _stops(distance: np.ndarray) -> list[tuple[int, int]]:
    """First and last step of each stop after a slide."""
    still = np.concatenate([[False], (np.diff(distance) == 0) & (distance[1:] > 0), [False]])
    return list(zip(np.flatnonzero(~still[:-1] & still[1:]), np.flatnonzero(still[:-1] & ~still[1:]), strict=True))


def _draw_against_distance(ax: Axes, distance: np.ndarray, values: np.ndarray, colour: str) -> None:
    first = int(np.argmax(_shown(distance)))
    for began, end in _stops(distance):
        ax.plot(distance[first : began + 1], values[first : began + 1], color=colour)
        ax.plot(distance[began : end + 1], values[began : end + 1], color=colour, lw=0.9, ls=(0, (1, 1.5)))
        first = end
    ax.plot(distance[first:], values[first:], color=colour)


#: What is drawn on the left and on the right: of the solution, by Persson's theory, and the error of the grid.
_DRAWN = (
    ("friction_coefficient", "persson_friction_coefficient", "grid_error_friction"),
    ("contact_fraction", "persson_contact_fraction", "grid_error_area"),
)
_TOLD = {
    "computed": "computed",
    "theory": "Persson (2001): waves stressed as in full contact",
    "grid": "error of the grid",
}


@style.apply
def friction(dataset: xr.Dataset, *, reduced: bool = False) -> Figure:
    """Friction coefficient and contact area over the nominal one, against the logarithm of the speed.

    Speeds whose contact is not solved are missing. Bands show the error of the grid, if the result states it. Of a
    sweep the friction coefficient of all cases is drawn.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`roughvisc.friction`, or of a study of friction. Merged with the result of
        :func:`roughvisc.observables.persson`, the theory is drawn as dotted lines.
    reduced : bool
        Of a sweep: against the speed times the shift factor of the material's temperature, ``a_T V``. Curves of several
        temperatures then fall on one master curve.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the Dataset is not one of friction over the speed.
    """
    if "case" in getattr(dataset, "dims", ()):
        return histories(dataset, "friction_coefficient", over="reduced_speed" if reduced else "")
    for name, *_ in _DRAWN:
        if not isinstance(dataset, xr.Dataset) or name not in dataset or dataset[name].dims != ("speed",):
            raise InputError(f"expected a result of rv.friction, with {name!r} over the speed")
    ordered = dataset[[name for name in dataset.data_vars if dataset[name].dims == ("speed",)]].sortby("speed").load()
    across = unit_for(ordered["speed"].values, "m/s")
    told = {"computed": Line2D([], [], color="0.3")}
    figure = style.new_figure(3.8, 3.0)
    ax = figure.add_subplot()
    for axes, names, colour in zip((ax, ax.twinx()), _DRAWN, (style.BLUE, style.CONTACT), strict=True):
        told |= _draw(axes, ordered, names, across, colour)
    if len(told) > 1:
        known = [name for name in _TOLD if name in told]
        figure.set_figheight(3.0 + 0.18 * len(known))
        style.legend_above(figure, {_TOLD[name]: told[name] for name in known})
    ax.set_xscale("log")
    ax.set_xlabel(across.label(VARIABLES["speed"].label))
    ax.grid(color="0.9", lw=0.5)
    return figure


def _draw(
    axes: Axes, ordered: xr.Dataset, names: tuple[str, str, str], across: Unit, colour: str
) -> dict[str, Line2D | Patch]:
    """One quantity on its axis; entries of a legend for what is drawn beside the solution."""
    solved, theory, grid = names
    speed = across(ordered["speed"].values)
    values = ordered[solved].values
    told: dict[str, Line2D | Patch] = {}
    most = [values]
    axes.plot(speed, values, "o-", ms=3, color=colour, label=VARIABLES[solved].label)
    if grid in ordered and np.isfinite(ordered[grid]).any():
        error = ordered[grid].values * values
        axes.fill_between(speed, np.maximum(values - error, 0), values + error, color=colour, alpha=0.18, lw=0)
        told["grid"] = Patch(color="0.3", alpha=0.25, lw=0)
        most.append((values + error)[np.isfinite(error)])
    if theory in ordered:
        axes.plot(speed, ordered[theory].values, ":", color=colour, label=VARIABLES[theory].label)
        told["theory"] = Line2D([], [], color="0.3", ls=":")
        most.append(ordered[theory].values)
    axes.set_ylabel(VARIABLES[solved].label, color=colour)
    axes.tick_params(axis="y", colors=colour)
    axes.set_ylim(0, 1.08 * float(np.nanmax(np.concatenate(most), initial=0.0)) or 1.0)
    return told
