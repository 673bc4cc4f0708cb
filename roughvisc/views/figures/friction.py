"""The figure of steady sliding: friction and contact area against speed."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from roughvisc.errors import InputError
from roughvisc.variables import NOT_CONVERGED, SLIDING
from roughvisc.views.figures.axes import CYCLE, new_figure, styled, unit_for

#: What is drawn: on the left and on the right; of the solution, and by Persson's theory.
_DRAWN = (
    ("friction_coefficient", "persson_friction_coefficient"),
    ("contact_fraction", "persson_contact_fraction"),
)
_TOLD = ("computed", "Persson (2001): waves stressed as in full contact")


@styled
def friction(dataset: xr.Dataset, *, persson: bool = False) -> Figure:
    """Friction coefficient and contact area over the nominal one, against the logarithm of the speed.

    Speeds whose iteration did not converge are drawn as open circles.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`roughvisc.friction`.
    persson : bool
        Whether to draw Persson's theory of the same waves too, as dotted lines.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the Dataset is not one of friction over the speed.
    """
    for name in [one for solved, theory in _DRAWN for one in (solved, theory)[: 1 + persson]]:
        if not isinstance(dataset, xr.Dataset) or name not in dataset or dataset[name].dims != ("speed",):
            raise InputError(f"expected a result of rv.friction, with {name!r} over the speed")
    ordered = dataset.sortby("speed")
    across = unit_for(ordered["speed"].values, "m/s")
    speed, settled = across(ordered["speed"].values), ordered["status"].values != NOT_CONVERGED
    figure = new_figure(3.8, 3.2 if persson else 3.0)
    ax = figure.add_subplot()
    for axes, (name, theory), colour in zip((ax, ax.twinx()), _DRAWN, CYCLE, strict=False):
        values = ordered[name].values
        axes.plot(speed, values, "-", color=colour, label=SLIDING[name].label)
        axes.plot(speed[settled], values[settled], "o", ms=3, color=colour)
        axes.plot(speed[~settled], values[~settled], "o", ms=4, mfc="w", color=colour)
        if persson:
            axes.plot(speed, ordered[theory].values, ":", color=colour, label=SLIDING[theory].label)
            values = np.append(values, ordered[theory].values)
        axes.set_ylabel(SLIDING[name].label, color=colour)
        axes.tick_params(axis="y", colors=colour)
        axes.set_ylim(0, 1.08 * float(np.max(values)) or 1.0)
    if persson:
        handles = [ax.plot([], [], dashes, color="0.3")[0] for dashes in ("-", ":")]
        figure.legend(handles, _TOLD, loc="outside upper center")
    ax.set_xscale("log")
    ax.set_xlabel(across.label(SLIDING["speed"].label))
    ax.grid(color="0.9", lw=0.5)
    return figure
