"""The method ``plot`` of the accessor ``roughvisc``: the maps of a result."""

from __future__ import annotations

from typing import Any

import xarray as xr
from matplotlib.figure import Figure

from roughvisc.variables.axes import AXES, axis_of
from roughvisc.views.figures.fields import maps


def quick_plot(data: xr.Dataset, **options: Any) -> Figure:
    """Maps with x to the right, y upwards and equal scales along both; the colours leave out rare spikes.

    xarray's own ``ds.pressure.isel(time=-1).plot()`` draws the first dimension, x, upwards: give it ``x="x"``.

    Parameters
    ----------
    data : xarray.Dataset
        A result, or one or more of its rows.
    **options
        As :func:`roughvisc.plot.maps` has them.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the data have no rows that could be drawn.

    Examples
    --------
    >>> ds.roughvisc.plot(times=-1)  # doctest: +SKIP
    """
    rows = axis_of(data.variables)
    if rows in data.coords and rows not in data.dims:  # one row of a result
        known = AXES[rows].variables
        of_surface = {name: one.variable for name, one in data.data_vars.items() if rows not in known[str(name)].dims}
        data = data.expand_dims(rows).assign(of_surface)
    return maps(data, **options)
