"""Deformed surface of the body."""

from __future__ import annotations

import numpy as np
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
        One case's result with ``height``, and ``gap`` or ``displacement``.
    time : float or str
        Time [s] or speed [m/s], of which the nearest row is used; a negative whole number counts rows from the end.

    Returns
    -------
    xarray.DataArray, dims (x, y)
        Height of the surface in the frame of the pressed profile: equal to the height of the profile in contact, above
        the profile elsewhere; missing at absent cells unless ``displacement`` was kept. [m]

    Raises
    ------
    InputError
        If the Dataset lacks the variables.
    """
    axis = axis_of(dataset.variables)
    need(dataset, axis, "x", "y", "height", *([] if "displacement" in dataset else ["gap"]))
    at = dataset.isel({axis: int(time)}) if time < 0 else dataset.sel({axis: time}, method="nearest")
    height, place = at["height"], AXES[axis].place(float(at[axis]), 3)
    if "displacement" not in at:
        surface = height + at["gap"]
    elif "gap" in at:  # displacement and surface differ by one distance everywhere
        surface = at["displacement"] + float(np.nanmedian(height + at["gap"] - at["displacement"]))
    else:
        surface = at["displacement"] + float((height - at["displacement"]).max())
    surface = surface.load().drop_vars(axis, errors="ignore").rename("height")
    history = f"{dataset.attrs.get('history', '')}\ndeformed surface at {place}".lstrip("\n")
    attributes = {"units": "m", "long_name": "height of the deformed surface of the half-space", "history": history}
    return surface.drop_attrs(deep=False).assign_attrs(attributes)
