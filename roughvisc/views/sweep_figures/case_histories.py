"""Histories of all cases of a sweep in one panel, coloured by what was varied."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from roughvisc.views.figures.axes import TimeAxis, new_figure, styled
from roughvisc.views.observables import history
from roughvisc.views.sweep_figures.cases import Parameter, cases_of, label_of, quantity_unit
from roughvisc.views.sweep_figures.colouring import Colouring, readable_ticks

#: Line styles of a second parameter; of one with more values nothing tells the lines apart.
_DASHES = ("-", (0, (4, 1.5)), (0, (1, 1)), (0, (6, 1.5, 1, 1.5)))


@styled
def histories_of_cases(results: Any, quantity: str | None = None, *, by: str | None = None) -> Figure:
    """A history of every case over time, coloured by what was varied; a dot for each kept time, where these are few.

    Up to eight values have a legend, more a colour bar. A second parameter of up to four values has line styles.

    Parameters
    ----------
    results : xarray.Dataset or xarray.DataTree
        What :func:`roughvisc.sweep` or :func:`roughvisc.open_results` gives; of a tree the times may differ.
    quantity : str, optional
        A history of every case, such as ``"approach"``; by default the contact area, corrected where all have it.
    by : str, optional
        Dotted key of the parameter that colours the lines; by default the one with the most numbers.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the results are no sweep, or a name is unknown.
    """
    cases = cases_of(results)
    quantity = quantity or cases.area
    cases.need(quantity)
    ordered = sorted(cases.parameters, key=lambda one: (not one.numeric, -len(one.levels)))
    first = cases.parameter(by) if by else ordered[0] if ordered else _numbered(len(cases.members))
    second = next((one for one in ordered if one is not first and len(one.levels) <= len(_DASHES)), None)
    colouring = Colouring(first)
    lines = [_line(member, quantity) for member in cases.members]
    times = np.unique(np.concatenate([line["time"].values for line in lines]))
    axis = TimeAxis.of(times)
    unit = quantity_unit(cases, quantity, np.concatenate([line.values for line in lines]))
    handles = colouring.handles() + _styles(second)
    figure = new_figure(4.6, 3.1 + 0.07 * len(handles))
    ax = figure.add_subplot()
    places = first.places
    dashes = second.places if second is not None else np.zeros(len(places), dtype=int)
    for member, line, level, dash in zip(cases.members, lines, places, dashes, strict=True):
        style = {"color": colouring.colour(int(level)), "lw": 1.2 if len(cases.members) <= 30 else 0.8}
        ax.plot(axis.unit(line["time"]), unit(line), ls=_DASHES[dash], **style)
        if len(cases.members) <= 8 and member.sizes["time"] <= 40 and second is None:
            ax.plot(axis.unit(member["time"]), unit(member[quantity]), "o", ms=2.5, color=style["color"])
    axis.apply(ax, times)
    _limits(ax)
    ax.set_ylabel(label_of(cases, quantity, unit))
    ax.grid(color="0.9", lw=0.5)
    if handles:
        columns = 4 if max(len(handle.get_label()) for handle in handles) < 14 else 1
        legend = figure.legend(handles=handles, loc="outside upper center", ncols=columns, handlelength=1.8)
        names = [one.name for one in (first, second) if one is not None]
        legend.set_title(", ".join(names) if colouring.few else names[-1], prop={"size": 7.5})
    colouring.draw_bar(figure, ax)
    return figure


def _line(member: xr.Dataset, quantity: str) -> xr.DataArray:
    """A quantity over every accepted step, or over the kept times if it is known at these alone."""
    steps = history(member)
    return steps[quantity] if quantity in steps else member[quantity]


def _numbered(count: int) -> Parameter:
    """Cases that nothing tells apart, by their number."""
    return Parameter("case", np.arange(1, count + 1), "", "Case")


def _styles(parameter: Parameter | None) -> list[Line2D]:
    if parameter is None:
        return []
    texts = parameter.texts()
    return [Line2D([], [], color="0.3", ls=dash, label=text) for dash, text in zip(_DASHES, texts, strict=False)]


def _limits(ax) -> None:
    """Linear from zero, or logarithmic where all that is drawn is positive and spans two decades."""
    shown = np.concatenate([np.asarray(line.get_ydata(), dtype=float) for line in ax.lines])
    shown = shown[np.isfinite(shown)]
    low, high = (shown.min(), shown.max()) if shown.size else (0.0, 1.0)
    logarithmic = bool(low > 0 and high >= 100 * low)
    if logarithmic:
        ax.set_yscale("log")
        ax.set_ylim(low / 1.5, high * 1.5)
    else:
        bottom, top = min(low, 0.0), max(high, 0.0)
        span = (top - bottom) or 1.0
        ax.set_ylim(bottom - 0.05 * span, top + 0.12 * span)
    readable_ticks(ax.yaxis, *ax.get_ylim(), logarithmic)
