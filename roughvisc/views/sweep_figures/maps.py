"""A quantity over two parameters as colours, a panel for each time."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib
import numpy as np
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure

from roughvisc.errors import InputError
from roughvisc.views.figures.axes import ABSENT, letter_panels, new_figure
from roughvisc.views.sweep_figures.cases import Cases, Parameter, label_of, quantity_unit
from roughvisc.views.sweep_figures.colouring import readable_ticks
from roughvisc.views.sweep_figures.parameter_axes import borders_between, set_parameter_axis


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
    figure = new_figure(1.4 + 2.6 * len(values), 2.9)
    panels = figure.subplots(1, len(values), sharey=True, squeeze=False)[0]
    colours = matplotlib.colormaps["viridis"].with_extremes(bad=ABSENT)
    for ax, row, title in zip(panels, shown, titles, strict=True):
        cells = np.full((len(up.levels), len(across.levels)), np.nan)
        cells[up.places, across.places] = row
        mesh = ax.pcolormesh(
            borders_between(across), borders_between(up), np.ma.masked_invalid(cells), cmap=colours, norm=norm
        )
        set_parameter_axis(ax.xaxis, across)
        set_parameter_axis(ax.yaxis, up)
        ax.tick_params(direction="out", which="both")
        ax.set_title(title, loc="right")
        ax.label_outer(remove_inner_ticks=False)
        ax.set_xlabel(across.label)
    bar = figure.colorbar(mesh, ax=list(panels), pad=0.02, aspect=22)
    bar.set_label(label_of(cases, quantity, unit))
    bar.outline.set_linewidth(0.6)
    bar.minorticks_off()
    readable_ticks(bar.ax.yaxis, *mesh.get_clim(), logarithmic)
    if len(values) > 1:
        letter_panels(panels)
    return figure
