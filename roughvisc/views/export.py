"""Results for other tools: histories as CSV, the deformed surface as heights."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from roughvisc.labels import heading
from roughvisc.plot.rows import frame_at, require, rows_of
from roughvisc.plot.sections import deformed_surface
from roughvisc.study.storage.files import atomic_write
from roughvisc.units import Quantity, quantities
from roughvisc.variables import AXES, VARIABLES, axis_of


def to_csv(dataset: xr.Dataset, path: str | Path) -> Path:
    """Write everything over time to a CSV file, a row a kept time; of a curve of friction a row a speed.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result.
    path : path
        The file to write; one of that name is replaced.

    Returns
    -------
    pathlib.Path
        The file. Its first row names each column with its unit, as in ``force [N]``; a status is a word; what is
        not known is empty. Numbers have 17 significant digits at most, which give back the same value.

    Raises
    ------
    InputError
        If the Dataset is not one case's result, or the folder cannot be written to.

    Examples
    --------
    >>> rv.to_csv(rv.open_result("results/quickstart/cc981638f27a0782.nc"), "quickstart.csv")  # doctest: +SKIP
    """
    rows = axis_of(dataset)
    require(dataset, rows)
    names = [name for name, variable in dataset.data_vars.items() if variable.dims == (rows,)]
    table = dataset[names].reset_coords(drop=True).to_dataframe().replace([np.inf, -np.inf], np.nan)
    for name in table:
        if meanings := VARIABLES[name].meanings if name in VARIABLES else ():
            table[name] = [meanings[value] for value in table[name]]
    headings = [heading(str(name), dataset[name].attrs.get("units", "")) for name in (rows, *names)]
    settings = {"index_label": headings[0], "lineterminator": "\r\n"}  # the same on every system
    with atomic_write(path) as temporary:
        table.to_csv(temporary, header=headings[1:], compression=None, **settings)
    return Path(path)


@quantities(time="s")
def deformed(dataset: xr.Dataset, time: Quantity = -1) -> xr.DataArray:
    """Heights of the half-space's deformed surface, as any surface over (x, y).

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result with ``height``, and ``gap`` or ``displacement``.
    time : float or str
        The nearest kept time [s] is taken, or place of another axis; a negative whole number counts rows from the end.

    Returns
    -------
    xarray.DataArray, dims (x, y)
        Height of the surface in the frame of the pressed profile: equal to the profile's where they touch, above
        it elsewhere; missing above absent cells unless ``displacement`` was kept. [m]

    Raises
    ------
    InputError
        If the Dataset is not one case's result, or lacks the variables.
    """
    require(dataset, "x", "y", "height")
    rows = rows_of(dataset)
    frame = frame_at(rows, time)
    surface = deformed_surface(dataset, frame).drop_vars(str(rows.name), errors="ignore").rename("height")
    place = AXES[str(rows.name)].place(float(rows[frame]), 3)
    surface.attrs = {
        "units": "m",
        "long_name": "height of the deformed surface of the half-space",
        "history": f"{dataset.attrs.get('history', '')}\ndeformed surface at {place}".lstrip("\n"),
    }
    return surface
