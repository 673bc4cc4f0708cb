"""The figure of steady sliding: friction and contact area against speed."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from roughvisc.errors import InputError
from roughvisc.variables import NOT_CONVERGED, SLIDING
from roughvisc.views.figures.axes import CYCLE, new_figure, styled, unit_for

_FRICTION, _FRACTION = "friction_coefficient", "contact_fraction"


@styled
def friction(dataset: xr.Dataset) -> Figure:
    """Friction coefficient and contact area over the nominal one, against the logarithm of the speed.

    Speeds whose iteration did not converge are drawn as open circles.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`roughvisc.friction`.

    Returns
    -------
    matplotlib.figure.Figure
    """
    for name in (_FRICTION, _FRACTION):
        if not isinstance(dataset, xr.Dataset) or name not in dataset or dataset[name].dims != ("speed",):
            raise InputError(f"expected a result of rv.friction, with {name!r} over the speed")
    ordered = dataset.sortby("speed")
    across = unit_for(ordered["speed"].values, "m/s")
    speed, settled = across(ordered["speed"].values), ordered["status"].values != NOT_CONVERGED
    figure = new_figure(3.8, 3.0)
    ax = figure.add_subplot()
    beside = ax.twinx()
    lines = []
    for axes, name, colour, dashes in ((ax, _FRICTION, CYCLE[0], "-"), (beside, _FRACTION, CYCLE[1], "--")):
        values = ordered[name].values
        (line,) = axes.plot(speed, values, dashes, color=colour, label=SLIDING[name].label)
        axes.plot(speed[settled], values[settled], "o", ms=3, color=colour)
        axes.plot(speed[~settled], values[~settled], "o", ms=4, mfc="w", color=colour)
        axes.set_ylabel(SLIDING[name].label, color=colour)
        axes.tick_params(axis="y", colors=colour)
        axes.set_ylim(0, 1.08 * float(np.max(values)) or 1.0)
        lines.append(line)
    ax.set_xscale("log")
    ax.set_xlabel(across.label(SLIDING["speed"].label))
    ax.grid(color="0.9", lw=0.5)
    return figure
