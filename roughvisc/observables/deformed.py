"""Deformed surface of the body."""

from __future__ import annotations

import xarray as xr

from roughvisc.observables.frames import need
from roughvisc.units import Quantity, quantities
from roughvisc.variables import AXES, axis_of


@quantities(time="s")
def deformed(dataset: xr.Dataset, time: Quantity = -1) -> xr.DataArray:
    """Return the heights of the deformed surface of the body.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result with ``height`` and ``gap``.
    time : float or str
        Time [s] or speed [m/s], of which the nearest row is used; a negative whole number counts rows from the end.

    Returns
    -------
    xarray.DataArray, dims (x, y)
        Height of the surface in the frame of the pressed profile: equal to the height of the profile in contact, above
        the profile elsewhere; missing at absent cells. [m]

    Raises
    ------
    InputError
        If the Dataset lacks the variables.
    """
    axis = axis_of(dataset.variables)
    need(dataset, axis, "x", "y", "height", "gap")
    at = dataset.isel({axis: int(time)}) if time < 0 else dataset.sel({axis: time}, method="nearest")
    surface = (at["height"] + at["gap"]).load().drop_vars(axis).rename("height")
    place = AXES[axis].place(float(at[axis]), 3)
    history = f"{dataset.attrs.get('history', '')}\ndeformed surface at {place}".lstrip("\n")
    attributes = {"units": "m", "long_name": "height of the deformed surface of the half-space", "history": history}
    return surface.drop_attrs(deep=False).assign_attrs(attributes)
