"""The figure of force against approach."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from roughvisc.variables import VARIABLES
from roughvisc.views.figures.axes import BLUE, VERMILION, new_figure, require, styled, unit_for
from roughvisc.views.figures.histories import failed_frames, leave_room, marker_of
from roughvisc.views.observables import history
from roughvisc.views.observables.cycles import cycle_energy, has_cycles

#: Part of its range by which the approach must have come back for a loop.
_BACK = 0.01


def has_loop(dataset: xr.Dataset) -> bool:
    """Whether the approach comes back at all: force against approach encloses nothing otherwise."""
    approach = history(dataset)["approach"].values
    fallen = np.max(np.maximum.accumulate(approach) - approach, initial=0.0)
    return bool(fallen > _BACK * np.ptp(approach))


@styled
def hysteresis(dataset: xr.Dataset) -> Figure:
    """Force against approach at every accepted step, the direction of time marked, and the work done in all.

    Where the program has cycles, what is dissipated in the last one that closes is stated too; where the approach never
    comes back, that there is no loop.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result.

    Returns
    -------
    matplotlib.figure.Figure
    """
    require(dataset, "time", "force", "approach")
    steps = history(dataset)
    force, approach = steps["force"].values, steps["approach"].values
    across, up = unit_for(approach, "m"), unit_for(force, "N")
    x, y = across(approach), up(force)
    figure = new_figure(3.6, 3.0)
    ax = figure.add_subplot()
    ax.plot(x, y, color=BLUE, marker=marker_of(len(x)), ms=2)
    _draw_arrows(ax, x, y)
    ax.plot(x[:1], y[:1], "o", color="k", ms=4, label="start")
    if len(x) > 1:
        ax.plot(x[-1:], y[-1:], "s", color="k", mfc="w", ms=4.5, label=_end(dataset))
    lost = cycle_energy(dataset)["cycle_dissipated_energy"].dropna("cycle") if has_cycles(dataset) else np.zeros(0)
    if len(lost):
        energy = unit_for([float(lost[-1])], "J")
        label = f"cycle {int(lost['cycle'][-1])}: {energy.text(float(lost[-1]))} dissipated"
        ax.plot([], [], ls="", label=label)
    failed = failed_frames(steps)
    if failed.any():
        ax.plot(x[failed], y[failed], "x", color=VERMILION, ms=6, mew=1.2, label="not converged")
    if not has_loop(dataset):
        ax.set_title("The approach does not come back: no loop", color="0.4")
    ax.set_xlabel(across.label(VARIABLES["approach"].label))
    ax.set_ylabel(up.label(VARIABLES["force"].label))
    leave_room(ax, y)
    ax.grid(color="0.9", lw=0.5)
    figure.legend(*ax.get_legend_handles_labels(), loc="outside upper center", ncols=2, handlelength=1.2)
    return figure


def _end(dataset: xr.Dataset) -> str:
    """What the last point is, with the work that the result states."""
    if "work" not in dataset:
        return "end"
    work = float(dataset["work"][-1])
    return f"end: {unit_for([work], 'J').text(work)} of work done"


def _draw_arrows(ax: Axes, x: np.ndarray, y: np.ndarray, count: int = 5) -> None:
    """Arrows in the direction of time, at even distances along a path."""
    width, height = (np.ptp(x) or 1.0), (np.ptp(y) or 1.0)
    length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x) / width, np.diff(y) / height))])
    if length[-1] == 0:
        return
    for place in (np.arange(count) + 0.5) / count * length[-1]:
        k = min(max(int(np.searchsorted(length, place)), 1), len(x) - 1)
        share = (place - length[k - 1]) / (length[k] - length[k - 1])
        start = np.array([x[k - 1], y[k - 1]])
        tip = start + share * (np.array([x[k], y[k]]) - start)
        style = {"arrowstyle": "-|>", "color": BLUE, "mutation_scale": 13, "shrinkA": 0, "shrinkB": 0}
        ax.annotate("", tip, start, arrowprops=style)
