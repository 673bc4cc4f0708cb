"""Figure of a budget: its sources as bars, and the number with its interval."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from roughvisc.errors import InputError
from roughvisc.plot import style
from roughvisc.plot.rows import RowAxis
from roughvisc.units import unit_for
from roughvisc.variables import AXES, axis_of

#: Bars of sources that raise and lower the number, and of those that only do one of the two.
_BOTH, _ONE = style.BLUE, style.ORANGE
#: Half-width of the logarithm beyond which errors are drawn as factors, and the part of it below which no bar is seen.
_FACTORS, _SEEN = 0.5, 0.01


@style.apply
def budget(dataset: xr.Dataset, row: int | None = None) -> Figure:
    """The sources of error of a number as bars, and the number over its axis with the interval that they make.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`roughvisc.budget`, of one quantity.
    row : int, optional
        Number of the row whose sources are drawn. Default: the last.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the Dataset is no budget, or of several quantities.
    """
    if not isinstance(dataset, xr.Dataset) or "half_width" not in dataset or "source" not in dataset.dims:
        raise InputError("expected the Dataset of rv.budget")
    if "quantity" in dataset.dims:
        raise InputError("found several quantities: expected one, such as dataset.sel(quantity='contact_area')")
    row = dataset["value"].size - 1 if row is None else row
    several = dataset["value"].size > 1
    figure = style.new_figure(6.8 if several else 4.4, 2.9)
    axes = figure.subplots(1, 1 + several, squeeze=False, width_ratios=[1.25, 1.0][: 1 + several])[0]
    _draw_sources(axes[0], dataset, row)
    if (dataset["direction"].isel({axis_of(dataset.variables): row}) != 0).any():
        bars = [Patch(color=_BOTH, label="in both directions"), Patch(color=_ONE, label="in one direction")]
        figure.legend(handles=bars, loc="outside upper left", ncols=2, handlelength=1.2)
    if several:
        _draw_interval(axes[1], dataset)
        style.letter_panels(axes)
    return figure


def _draw_sources(ax: Axes, dataset: xr.Dataset, row: int) -> None:
    """One bar for each source, in % of the number or as a factor of it; what is open or has no meaning in words."""
    axis = axis_of(dataset.variables)
    at = dataset.isel({axis: row})
    names = dataset["source"].values.tolist()
    with np.errstate(divide="ignore", invalid="ignore"):
        together = [float(np.log(at[end] / at["value"])) for end in ("lower", "upper")]
    reach = max(float(np.nanmax(np.abs([*together, 1e-4]))), 1e-4)
    wide = reach > _FACTORS
    shown = np.exp if wide else lambda log: 100 * np.expm1(log)
    places = np.arange(len(names) + 1)[::-1]
    for place, name in zip(places, names, strict=False):
        one = at.sel(source=name)
        half, towards = float(one["half_width"]), int(one["direction"])
        if half > 0:
            low, high = (-half if towards <= 0 else 0.0), (half if towards >= 0 else 0.0)
            ax.barh(place, shown(high) - shown(low), left=shown(low), height=0.62, color=_ONE if towards else _BOTH)
        if not half > _SEEN * reach:
            state = str(one["state"].values)
            word = state if state in ("open", "none") else "below 1 %" if half < 0.01 else ""
            look = {"va": "center", "fontsize": 7.5, "color": "0.35"}
            ax.annotate(word, (shown(0.0), place), (5, 0), textcoords="offset points", **look)
    if np.isfinite(together).all():
        ax.barh(places[-1], shown(together[1]) - shown(together[0]), left=shown(together[0]), height=0.62, color="0.35")
    ax.axvline(shown(0.0), color="black", lw=0.7)
    place = AXES[axis].place(float(dataset[axis].values[row]))
    if wide:
        ax.set_xscale("log")
        style.plain_log_ticks(ax.xaxis, fine=True)
    ends = [min([-1e-4, *(end for end in together if end < 0)]), max([1e-4, *(end for end in together if end > 0)])]
    room = 0.15 * (ends[1] - ends[0])
    ax.set_xlim(shown(ends[0] - room), shown(ends[1] + room))
    ax.set_ylim(places[-1] - 0.6, places[0] + 0.6)
    ax.set_xlabel(f"Factor of the value at {place} [-]" if wide else f"Error at {place} [%]")
    ax.set_yticks(places, [*names, "together"])
    ax.tick_params(axis="y", length=0)


def _draw_interval(ax: Axes, dataset: xr.Dataset) -> None:
    """The number over its axis, and the interval that holds it at 95 %."""
    axis = axis_of(dataset.variables)
    rows = RowAxis.of(dataset[axis])
    unit = unit_for(dataset["upper"].values, dataset["value"].attrs["units"])
    at = rows.unit(dataset[axis].values)
    ax.fill_between(at, unit(dataset["lower"].values), unit(dataset["upper"].values), color=_BOTH, alpha=0.25, lw=0)
    ax.plot(at, unit(dataset["value"].values), "o-", color=_BOTH)
    rows.apply(ax, dataset[axis].values)
    name = dataset.attrs["quantity"].replace("_", " ").capitalize()
    ax.set_ylabel(f"{name} [{unit.symbol}]" if unit.symbol else name)
    if float((dataset["upper"] / dataset["lower"]).max()) > np.exp(2 * _FACTORS):
        ax.set_yscale("log")
    ax.margins(y=0.08)
