"""The method ``plot`` of the accessor ``roughvisc``: the maps of a result or of a field, or the look of a surface."""

from __future__ import annotations

from typing import Any

import xarray as xr
from matplotlib.figure import Figure

from roughvisc.errors import InputError
from roughvisc.variables import FIELDS
from roughvisc.variables.axes import AXES, axis_of
from roughvisc.views.figures.fields import maps
from roughvisc.views.figures.surfaces import surface


def quick_plot(data: xr.Dataset | xr.DataArray, **options: Any) -> Figure:
    """Maps with x to the right, y upwards and equal scales along both; the colours leave out rare spikes.

    xarray's own ``ds.pressure.isel(time=-1).plot()`` draws the first dimension, x, upwards: give it ``x="x"``.

    Parameters
    ----------
    data : xarray.Dataset or xarray.DataArray
        A result, or one or more of its rows; one of its fields, ``ds.pressure`` or ``ds.pressure.isel(time=-1)``; or
        heights over (x, y).
    **options
        Of a result or a field: as :func:`roughvisc.plot.maps` has them.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the data have no rows and no grid that could be drawn, or an option is given for heights.

    Examples
    --------
    >>> ds.roughvisc.plot(times=-1)  # doctest: +SKIP
    >>> ds.pressure.isel(time=-1).roughvisc.plot()  # doctest: +SKIP
    """
    if isinstance(data, xr.DataArray) and data.name not in FIELDS:
        if options:
            raise InputError(f"plot of heights has no option {next(iter(options))!r}: expected none")
        return surface(data)
    if isinstance(data, xr.DataArray):
        data = data.to_dataset(name=data.name)
        options = {"fields": list(map(str, data.data_vars))} | options
    rows = axis_of(data.variables)
    if rows in data.coords and rows not in data.dims:  # one row of a result
        known = AXES[rows].variables
        of_surface = {name: one.variable for name, one in data.data_vars.items() if rows not in known[str(name)].dims}
        data = data.expand_dims(rows).assign(of_surface)
    return maps(data, **options)
