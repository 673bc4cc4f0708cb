"""Figure of the error over two parameters, with the refused cases."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from roughvisc.errors import InputError
from roughvisc.views.figures import style

#: A case that was refused.
_REFUSED: dict[str, Any] = {"facecolor": "0.9", "edgecolor": "0.5", "hatch": "////", "lw": 0}


@style.apply
def stability_map(dataset: xr.Dataset, *, name: str = "error", expected: float | None = None) -> Figure:
    """Errors over two parameters, each of many decades, as a map.

    Parameters
    ----------
    dataset : xarray.Dataset
        ``error`` over two positive coordinates, the first drawn along x; missing where the case was refused,
        infinite where its result is no number. Axes are labelled by the ``long_name`` of the coordinates.
    name : str
        Variable that holds the errors. [-]
    expected : float, optional
        The largest error that was asked for: larger ones are framed. [-]

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the variable is not there or is not over two coordinates.
    """
    if name not in dataset or dataset[name].ndim != 2:
        raise InputError(f"{name}: not in the dataset over two coordinates: expected errors over two parameters")
    error = dataset[name]
    across, up = error.dims
    values = error.transpose(up, across).values
    right = np.isfinite(values) & (values > 0)
    highest = max(expected or 0.0, float(values[right].max(initial=1e-15)))
    lowest = min(1e-2 * highest, max(float(values[right].min(initial=highest)), 1e-6 * highest))
    figure = style.new_figure(5.6, 3.9)
    axes = figure.subplots()
    shown = np.ma.masked_invalid(np.maximum(values, lowest))
    image = axes.pcolormesh(shown, cmap="cividis", norm=LogNorm(lowest, highest), edgecolors="w", lw=0.6)
    refused = np.isnan(values)
    wrong = np.isinf(values) | (values > expected if expected else False)
    for row, column in np.argwhere(refused):
        axes.fill_between([column, column + 1], row, row + 1, **_REFUSED)
    for row, column in np.argwhere(wrong):
        corners = (column + np.array([0, 1, 1, 0, 0]), row + np.array([0, 0, 1, 1, 0]))
        axes.plot(*corners, color=style.VERMILION)
    for axis, dim in ((axes.xaxis, across), (axes.yaxis, up)):
        ticks = np.log10(dataset[dim].values)
        axis.set_ticks(np.arange(len(ticks)) + 0.5, [f"$10^{{{tick:.3g}}}$" for tick in ticks])
        axis.set_label_text(str(dataset[dim].attrs.get("long_name", dim)))
        axis.set_tick_params(length=0)
    figure.colorbar(image, ax=axes, extend="min", label=str(error.attrs.get("long_name", name)))
    legend = []
    if refused.any():
        legend.append(Patch(**_REFUSED, label="refused, with a reason"))
    if wrong.any():
        legend.append(Patch(facecolor="none", edgecolor=style.VERMILION, label=f"beyond {expected:g}"))
    if legend:
        figure.legend(handles=legend, loc="outside upper center", ncols=2)
    return figure
