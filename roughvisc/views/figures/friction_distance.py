"""The figure of a program that slides: friction and contact area against the distance."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from roughvisc.variables import VARIABLES
from roughvisc.views.figures.axes import BLUE, GREEN, VERMILION, letter_panels, new_figure, require, styled, unit_for
from roughvisc.views.figures.histories import failed_frames, leave_room
from roughvisc.views.observables import history

_PANELS = (("friction_coefficient", BLUE), ("contact_area", GREEN))


@styled
def friction_against_distance(dataset: xr.Dataset) -> Figure:
    """Friction coefficient and contact area against the distance slid, at every accepted step.

    Strokes are lines; what happens at a stop lies at one distance, and is dotted. Friction is counted against the
    motion: after a reversal it begins below zero. Steps that did not converge are crossed out.

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
    figure = new_figure(4.6, 1.3 + 1.5 * len(panels))
    axes = list(figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0])
    failed = failed_frames(steps)
    for ax, (name, colour) in zip(axes, panels, strict=True):
        unit = unit_for(steps[name].values, VARIABLES[name].units)
        values = unit(steps[name].values)
        _draw(ax, distance, values, colour)
        ax.plot(distance[failed], values[failed], "x", color=VERMILION, ms=5, mew=1.2)
        leave_room(ax, values[_shown(distance)])
        ax.set_ylabel(unit.label(VARIABLES[name].label))
        ax.grid(color="0.9", lw=0.5)
    axes[0].axhline(0.0, color="0.3", lw=0.6)
    if len(_stops(distance)):
        axes[0].plot([], [], color="0.3", label="sliding")
        axes[0].plot([], [], color="0.3", lw=0.9, ls=(0, (1, 1.5)), label="at a stop")
        axes[0].legend(loc="lower left", bbox_to_anchor=(0.08, 1.0), ncols=2, borderaxespad=0.15)
    axes[-1].set_xlabel(across.label(VARIABLES["sliding_distance"].label))
    letter_panels(axes)
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


def _draw(ax: Axes, distance: np.ndarray, values: np.ndarray, colour: str) -> None:
    first = int(np.argmax(_shown(distance)))
    for began, end in _stops(distance):
        ax.plot(distance[first : began + 1], values[first : began + 1], color=colour)
        ax.plot(distance[began : end + 1], values[began : end + 1], color=colour, lw=0.9, ls=(0, (1, 1.5)))
        first = end
    ax.plot(distance[first:], values[first:], color=colour)
