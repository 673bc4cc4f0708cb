"""A quantity over two parameters as colours, a panel for each time; axes of varied parameters."""

from __future__ import annotations

import math
from collections.abc import Sequence

import matplotlib
import numpy as np
from matplotlib.axis import Axis
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullFormatter

from roughvisc.errors import InputError
from roughvisc.views.figures import style
from roughvisc.views.sweep_figures.case_text import ENDLESS
from roughvisc.views.sweep_figures.cases import Cases, Parameter, label_of, quantity_unit
from roughvisc.views.sweep_figures.colouring import even_in_log, readable_ticks


def draw_maps(
    cases: Cases, axes_of: Sequence[Parameter], quantity: str, values: np.ndarray, titles: list[str]
) -> Figure:
    """Two parameters: a panel for each time, in it a cell for each combination."""
    across, up = axes_of
    if len(set(zip(across.places, up.places, strict=True))) < len(cases.members):
        more = ", ".join(one.key for one in cases.parameters if one not in axes_of)
        raise InputError(f"several cases lie in one cell of the map: choose among {more} first, or use kind='lines'")
    unit = quantity_unit(cases, quantity, values)
    shown = unit(values)
    known = shown[np.isfinite(shown)]
    low, high = (known.min(), known.max()) if known.size else (0.0, 1.0)
    logarithmic = low > 0 and high >= 30 * low
    norm = LogNorm(low, high) if logarithmic else Normalize(low, high if high > low else low + 1)
    figure = style.new_figure(1.4 + 2.6 * len(values), 2.9)
    panels = figure.subplots(1, len(values), sharey=True, squeeze=False)[0]
    colours = matplotlib.colormaps["viridis"].with_extremes(bad=style.ABSENT)
    for ax, row in zip(panels, shown, strict=True):
        cells = np.full((len(up.levels), len(across.levels)), np.nan)
        cells[up.places, across.places] = row
        mesh = ax.pcolormesh(
            _borders_between(across), _borders_between(up), np.ma.masked_invalid(cells), cmap=colours, norm=norm
        )
        set_parameter_axis(ax.xaxis, across)
        set_parameter_axis(ax.yaxis, up)
        ax.tick_params(direction="out", which="both")
        ax.label_outer(remove_inner_ticks=False)
        ax.set_xlabel(across.label)
    bar = figure.colorbar(mesh, ax=list(panels), pad=0.02, aspect=22)
    bar.set_label(label_of(cases, quantity, unit))
    bar.outline.set_linewidth(0.6)
    bar.minorticks_off()
    readable_ticks(bar.ax.yaxis, *mesh.get_clim(), logarithmic)
    style.letter_panels(panels, titles)
    return figure


def positions(parameter: Parameter) -> np.ndarray:
    """Where the levels of a parameter lie on its axis; an infinite one a step beyond the others."""
    if not parameter.numeric:
        return np.arange(len(parameter.levels), dtype=float)
    places = parameter.unit(parameter.levels)
    if parameter.endless:
        last, before = places[-2], places[-3] if len(places) > 2 else places[-2] / 2
        places[-1] = last * last / before if before > 0 else math.inf
        if not even_in_log(places):
            places[-1] = 2 * last - before
    return places


def _borders_between(parameter: Parameter) -> np.ndarray:
    """Borders between the cells of a map, half way between the levels on the scale of the axis."""
    places = positions(parameter)
    logarithmic = parameter.numeric and even_in_log(places)
    places = np.log(places) if logarithmic else places
    middle = (places[1:] + places[:-1]) / 2
    borders = np.concatenate([[2 * places[0] - middle[0]], middle, [2 * places[-1] - middle[-1]]])
    return np.exp(borders) if logarithmic else borders


def set_parameter_axis(axis: Axis, parameter: Parameter) -> None:
    """Scale, limits, ticks and label of an axis of a parameter."""
    places, count = positions(parameter), len(parameter.levels)
    horizontal = axis.axis_name == "x"
    logarithmic = parameter.numeric and even_in_log(places)
    set_limits = axis.axes.set_xlim if horizontal else axis.axes.set_ylim
    if logarithmic:
        (axis.axes.set_xscale if horizontal else axis.axes.set_yscale)("log")
    borders = _borders_between(parameter)
    set_limits(borders[0], borders[-1])
    if parameter.numeric:
        scaled = np.log(places) if logarithmic else places
        if parameter.endless or (count <= 6 and np.diff(scaled).min() > 0.11 * np.ptp(scaled)):
            beyond = places[-1] if parameter.endless else math.inf
            step = -(-count // 6)
            axis.set_major_locator(FixedLocator(places[(count - 1) % step :: step]))
            axis.set_major_formatter(lambda value, _: ENDLESS if value == beyond else f"{value:.4g}")
            axis.set_minor_locator(FixedLocator([]))
            axis.set_minor_formatter(NullFormatter())
        else:
            readable_ticks(axis, places[0], places[-1], logarithmic)
    else:
        step = -(-count // 25)
        texts = parameter.texts()[::step]
        axis.set_ticks(places[::step], labels=texts)
        if horizontal and sum(map(len, texts)) > 34:
            for label in axis.get_ticklabels():
                label.set(rotation=30 if len(texts) <= 6 else 90, ha="right", rotation_mode="anchor")
                label.set_va("top" if len(texts) <= 6 else "center")
        axis.axes.tick_params(axis=axis.axis_name, length=0)
    axis.set_label_text(parameter.label)
