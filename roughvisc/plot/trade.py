"""Figures of a trade, time against error, and of a budget, the sources of an error."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from roughvisc.errors import InputError
from roughvisc.plot import style
from roughvisc.units import unit_for
from roughvisc.variables import AXES, VARIABLES, axis_of

#: Markers of the grids, from the finest on.
_MARKERS = "o^vsDP"
#: Width and height of the label of a point. [1/72 inch]
_LABEL = 26, 9


@style.apply
def trade(dataset: xr.Dataset, quantity: str | Sequence[str] | None = None) -> Figure:
    """Draw wall time against error of every setting, with the Pareto front.

    Each grid has a marker. Labels state the tolerances; a label without a free place is left out. Errors below the
    uncertainty of the reference lie in a grey band, and are not part of the front.

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
    figure, axes = style.new_panels(len(shown), len(shown), 2.7, 2.6)
    for ax, name in zip(axes, shown, strict=True):
        _draw_trade(ax, dataset, name)
    style.letter_panels(axes)
    style.legend_above(figure, style.named_in(*axes))
    return figure


def _draw_trade(ax: Axes, dataset: xr.Dataset, quantity: str) -> None:
    """Draw the settings of one quantity."""
    from roughvisc.study.trade import format_tolerance, pareto_front, uncertainty  # slow to import

    time, error = dataset["run_time"].values, 100 * dataset["error"].sel(quantity=quantity).values
    unsure = float(np.nan_to_num(100 * uncertainty(dataset, quantity)))
    known = np.isfinite(time) & np.isfinite(error)
    front = np.flatnonzero(pareto_front(dataset, quantity) & (error > unsure))
    front = front[np.argsort(time[front], kind="stable")]
    style.log_axis(ax.xaxis, time[known])
    style.log_axis(ax.yaxis, error[known])
    ax.plot(time[front], error[front], color="0.35", lw=1.0, zorder=1, label="Pareto front")
    grids = list(zip(dataset["cells_x"].values, dataset["cells_y"].values, strict=True))
    order = sorted({grids[i] for i in np.flatnonzero(known)}, reverse=True)
    for grid, marker, colour in zip(order, itertools.cycle(_MARKERS), itertools.cycle(style.CYCLE)):
        chosen = [i for i in np.flatnonzero(known) if grids[i] == grid]
        look = {"color": colour, "ms": 5, "mew": 0, "label": f"{grid[0]} × {grid[1]} cells", "zorder": 3}
        ax.plot(time[chosen], error[chosen], marker, **look)
    ax.margins(0.15)
    low, high = ax.get_ylim()
    if unsure > low:
        ax.axhspan(low, unsure, color="0.93", zorder=0, label="uncertainty of the reference")
        ax.set_ylim(low, high)
    ax.figure.draw_without_rendering()
    points = ax.transData.transform(np.c_[time, error]) * 72 / ax.figure.dpi
    placed: list[np.ndarray] = []
    for i in [*front, *np.setdiff1d(np.flatnonzero(known), front)]:
        for side, below in ((1, 0), (-1, 0), (1, 1), (-1, 1)):
            offset = np.array([5 * side, -9 if below else 3])
            centre = points[i] + offset + (13 * side, 3)
            is_clear = (np.abs(points[known] - centre) > (16, 6)).any(axis=1).all()
            if is_clear and all((np.abs(other - centre) > _LABEL).any() for other in placed):
                placed.append(centre)
                text = format_tolerance(float(dataset["tolerance"][i]))
                look = {"fontsize": 6.5, "color": "0.25", "ha": "left" if side > 0 else "right"}
                ax.annotate(text, (time[i], error[i]), offset, textcoords="offset points", **look)
                break
    ax.set_xlabel(f"{VARIABLES['wall_time'].label} [s]")
    ax.set_ylabel(f"Error of {VARIABLES[quantity].label.lower()} [%]")
    ax.grid()


@style.apply
def budget(dataset: xr.Dataset, row: int = -1) -> Figure:
    """Draw the sources of error of a result as bars, and the result over its rows with its 95 % interval.

    Errors are in percent, or as factors on a logarithmic axis if they exceed a factor of 1.6.

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
    rows, names, quantity = dataset[axis], dataset["source"].values.tolist(), str(dataset["quantity"].values)
    at = dataset.isel({axis: row})
    half, towards = at["half_width"].values, at["direction"].values
    with np.errstate(divide="ignore", invalid="ignore"):
        whole = [np.log(float(at[end] / at["value"])) for end in ("lower", "upper")]
    low, high = np.where(towards <= 0, -half, 0.0), np.where(towards >= 0, half, 0.0)
    logs = np.nan_to_num([*np.c_[low, high], whole])
    wide = bool(np.abs(logs).max() > 0.5)
    ends, middle = (np.exp(logs), 1.0) if wide else (100 * np.expm1(logs), 0.0)
    count = min(rows.size, 2)
    names = [*names, "all together"]
    left = 0.2 + style.LETTER * max(map(len, names))
    figure, axes = style.new_panels(count, count, 2.1, 2.1, left=left, between=0.75)
    ax, places = axes[0], np.arange(len(names))[::-1]
    colours = [*np.where(towards == 0, style.BLUE, style.ORANGE), "0.35"]
    ax.barh(places, ends[:, 1] - ends[:, 0], left=ends[:, 0], height=0.62, color=colours)
    for place, name in zip(places, names, strict=False):
        if name in dataset.attrs["open"].split("; "):
            look = {"va": "center", "fontsize": 7.5, "color": "0.35", "textcoords": "offset points"}
            ax.annotate("open", (middle, place), (5, 0), **look)
    ax.axvline(middle, color="black", lw=0.7)
    if wide:
        style.log_axis(ax.xaxis, ends)
    text = AXES[axis].place(float(rows[row]))
    ax.set_xlabel(f"Factor of the value at {text} [-]" if wide else f"Error at {text} [%]")
    ax.set_yticks(places, names)
    ax.tick_params(axis="y", length=0)
    ax.use_sticky_edges = False  # else a bar ends at the frame
    ax.margins(x=0.15, y=0.06)
    if (towards != 0).any():
        ax.set_title("orange: one direction only", loc="right", fontsize=8)
    for curve in axes[1:]:
        unit = unit_for(dataset["upper"].values, VARIABLES[quantity].units)
        over = style.row_unit(rows)(rows)
        curve.fill_between(over, unit(dataset["lower"]), unit(dataset["upper"]), color=style.BLUE, alpha=0.25, lw=0)
        curve.plot(over, unit(dataset["value"]), "o-", color=style.BLUE)
        style.row_axis([curve], rows)
        curve.set_ylabel(unit.label(quantity.replace("_", " ").capitalize()))
        if wide:
            curve.set_yscale("log")
    style.letter_panels(axes)
    return figure
