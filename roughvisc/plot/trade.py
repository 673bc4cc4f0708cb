"""Figures of a trade, time against error, and of a budget, the sources of an error."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from roughvisc.errors import InputError
from roughvisc.plot import style
from roughvisc.study.trade import format_tolerance, pareto_front, uncertainty
from roughvisc.units import unit_for
from roughvisc.variables import AXES, VARIABLES, axis_of

#: Markers of the grids, from the coarsest on.
_MARKERS = "o^vsDP"


@style.apply
def trade(dataset: xr.Dataset, quantity: str | Sequence[str] | None = None) -> Figure:
    """Draw wall time against error of every setting, with the Pareto front.

    Each grid has a marker. Labels state the tolerances of the front. Errors below the uncertainty of the reference lie
    in a grey band, and are not part of the front.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of :func:`roughvisc.trade`.
    quantity : str or sequence of str, optional
        One panel for each quantity. Default: the first two of the trade.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the Dataset is not a trade, does not hold the quantity, or holds no measured setting.
    """
    if not isinstance(dataset, xr.Dataset) or "run_time" not in dataset:
        raise InputError("expected the Dataset of rv.trade")
    known = dataset["quantity"].values.tolist()
    wanted = known[:2] if quantity is None else [quantity] if isinstance(quantity, str) else list(quantity)
    for name in wanted:
        if name not in known:
            raise InputError(key="quantity", found=name, expected=f"some of {', '.join(known)}")
    shown = [name for name in wanted if np.isfinite(dataset["error"].sel(quantity=name)).any()]
    if not shown:
        raise InputError("the trade holds no measured setting: nothing to draw")
    figure, axes = style.new_panels(len(shown), len(shown), (2.7, 2.6))
    for ax, name in zip(axes, shown, strict=True):
        _draw_trade(ax, dataset, name)
    style.legend_above(figure, style.named_in(*axes))
    return figure


def _draw_trade(ax: Axes, dataset: xr.Dataset, quantity: str) -> None:
    """Draw the settings of one quantity."""
    table = dataset[["run_time", "tolerance", "cells_x", "cells_y"]].to_dataframe()
    table["error"] = 100 * dataset["error"].sel(quantity=quantity).values
    unsure = float(np.nan_to_num(100 * uncertainty(dataset, quantity)))
    front = table[pareto_front(dataset, quantity) & (table["error"] > unsure)].sort_values("run_time", kind="stable")
    table = table[np.isfinite(table["run_time"]) & np.isfinite(table["error"])]
    style.log_axis(ax.xaxis, table["run_time"])
    style.log_axis(ax.yaxis, table["error"])
    ax.plot(front["run_time"], front["error"], color="0.35", lw=1.0, zorder=1, label="Pareto front")
    for number, (grid, own) in enumerate(table.groupby(["cells_x", "cells_y"], sort=True)):
        look = {"color": style.CYCLE[number % len(style.CYCLE)], "label": f"{grid[0]} × {grid[1]} cells"}
        ax.plot(own["run_time"], own["error"], _MARKERS[number % len(_MARKERS)], ms=5, mew=0, zorder=3, **look)
    ax.margins(0.15)
    ax.set_ylim(ax.get_ylim())
    if unsure > ax.get_ylim()[0]:
        ax.axhspan(ax.get_ylim()[0], unsure, color="0.93", zorder=0, label="uncertainty of the reference")
    for place in zip(front["run_time"], front["error"], front["tolerance"], strict=True):
        look = {"textcoords": "offset points", "fontsize": 6.5, "color": "0.25"}
        ax.annotate(format_tolerance(place[2]), place[:2], (5, 3), **look)
    ax.set_xlabel(f"{VARIABLES['wall_time'].label} [s]")
    ax.set_ylabel(f"Error of {VARIABLES[quantity].label.lower()} [%]")


@style.apply
def budget(dataset: xr.Dataset, row: int = -1) -> Figure:
    """Draw the sources of error of a result as bars, and the result over its rows with its 95 % interval.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of :func:`roughvisc.budget`, for one quantity.
    row : int
        Number of the row whose sources are drawn.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the Dataset is not a budget, or holds several quantities.
    """
    if not isinstance(dataset, xr.Dataset) or "half_width" not in dataset or "source" not in dataset.dims:
        raise InputError("expected the Dataset of rv.budget")
    if "quantity" in dataset.dims:
        raise InputError("found several quantities: expected one, such as dataset.sel(quantity='contact_area')")
    axis = axis_of(dataset.variables)
    rows, quantity = dataset[axis], str(dataset["quantity"].values)
    unknown = dataset.attrs["open"].split("; ")
    names = [f"{name} (open)" if name in unknown else str(name) for name in dataset["source"].values]
    names.append("all together")
    at = dataset.isel({axis: row})
    half, towards = at["half_width"].values, at["direction"].values
    low, high = np.where(towards <= 0, -half, 0.0), np.where(towards >= 0, half, 0.0)
    whole = [float(at[end] / at["value"].where(at["value"] != 0)) for end in ("lower", "upper")]
    ends = 100 * (np.nan_to_num([*np.exp(np.c_[low, high]), whole], nan=1.0) - 1)
    count = min(rows.size, 2)
    left = 0.2 + style.LETTER * max(map(len, names))
    figure, axes = style.new_panels(count, count, (2.1, 2.1), left=left, between=0.75)
    ax = axes[0]
    colours = [*[style.BLUE] * half.size, "0.35"]
    ax.barh(names, ends[:, 1] - ends[:, 0], left=ends[:, 0], height=0.62, color=colours)
    ax.invert_yaxis()
    ax.axvline(0.0, color="black", lw=0.7)
    ax.set_xlabel(f"Error at {AXES[axis].place(float(rows[row]))} [%]")
    ax.use_sticky_edges = False  # else a bar ends at the frame
    ax.margins(x=0.15, y=0.06)
    for curve in axes[1:]:
        unit, over = unit_for(dataset["upper"].values, VARIABLES[quantity].units), style.row_axis([curve], rows)(rows)
        curve.fill_between(over, unit(dataset["lower"]), unit(dataset["upper"]), color=style.BLUE, alpha=0.25, lw=0)
        curve.plot(over, unit(dataset["value"]), "o-", color=style.BLUE)
        curve.set_ylabel(unit.label(quantity.replace("_", " ").capitalize()))
    return figure
