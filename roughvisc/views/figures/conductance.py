"""Figure of conductance: that of the contact spots over time, with its error and two estimates."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from roughvisc.errors import InputError
from roughvisc.units import unit_for
from roughvisc.variables import VARIABLES
from roughvisc.variables.spots import CONDUCTANCES
from roughvisc.views.figures.axes import BLUE, RowAxis, new_figure, require, rows_of, styled
from roughvisc.views.figures.histories import leave_room, marker_of
from roughvisc.views.observables import asked

#: Estimates with their labels and dashes.
_ESTIMATES = (("holm", "Holm", (0, (4, 2))), ("greenwood", "Greenwood", (0, (1, 1.5))))


@styled
def conductance(dataset: xr.Dataset) -> Figure:
    """Conductance of the contact spots over time, with its stated error as a band and the estimates as lines.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result, merged with what :func:`roughvisc.observables.conductance` gives of it, or of a study that
        asks for it in ``[observe]``.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the Dataset is not one case's result, or neither holds a conductance nor asks for one.
    """
    require(dataset)
    held = dataset if any(kind in dataset for kind in CONDUCTANCES) else asked(dataset).compute()
    found = [kind for kind in CONDUCTANCES if kind in held]
    if not found:
        raise InputError("the result holds no conductance: merge it with rv.observables.conductance(ds, resistivity)")
    figure = new_figure(4.2, 0.4 + 2.5 * len(found))
    axis = RowAxis.of(rows_of(dataset))
    axes = figure.subplots(len(found), 1, sharex=True, squeeze=False)[:, 0]
    for ax, kind in zip(axes, found, strict=True):
        _draw(ax, axis, held, kind)
        axis.apply(ax, rows_of(dataset))
    for ax in axes[:-1]:
        ax.set_xlabel("")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def _draw(ax: Axes, axis: RowAxis, dataset: xr.Dataset, kind: str) -> None:
    """Values in full contact are infinite, and left out."""
    finite = {name: dataset[name].where(np.isfinite(dataset[name])).values for name in _names(dataset, kind)}
    unit, times = unit_for(finite[kind], VARIABLES[kind].units), axis.unit(rows_of(dataset))
    values, error = unit(finite[kind]), unit(finite[f"{kind}_error"])
    ax.fill_between(times, np.maximum(values - error, 0), values + error, color=BLUE, alpha=0.25, lw=0)
    ax.plot(times, values, color=BLUE, marker=marker_of(len(times)), ms=2.5, label="computed, with its error")
    shown = [values + error]
    for suffix, label, dashes in _ESTIMATES:
        if (name := f"{kind}_{suffix}") in finite:
            ax.plot(times, unit(finite[name]), color="0.35", ls=dashes, lw=0.9, label=label)
            shown.append(unit(finite[name]))
    leave_room(ax, *shown)
    ax.set_ylabel(unit.label(VARIABLES[kind].label))
    ax.grid(color="0.9", lw=0.5)


def _names(dataset: xr.Dataset, kind: str) -> list[str]:
    return [name for name in (kind, *(f"{kind}_{one}" for one in ("error", "holm", "greenwood"))) if name in dataset]
