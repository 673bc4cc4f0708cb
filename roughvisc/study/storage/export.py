"""Histories of a result as CSV."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.labels import heading
from roughvisc.observables.frames import need
from roughvisc.study.storage.folder import atomic_write
from roughvisc.variables import OTHER_DIMS, VARIABLES, axis_of


def to_csv(dataset: xr.Dataset, path: str | Path) -> Path:
    """Write the histories of a result to a CSV file, with one row per kept time, or per speed of a friction curve.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result.
    path : path
        File to write; an existing one is replaced.

    Returns
    -------
    pathlib.Path
        The file. Its first row names each column with its unit, as in ``force [N]``; a status is a word; unknown
        values are empty. Numbers are written with all digits.

    Raises
    ------
    InputError
        If the Dataset is not one case's result, or the folder cannot be written to.

    Examples
    --------
    >>> rv.to_csv(rv.open_result("results/quickstart/cc981638f27a0782.nc"), "quickstart.csv")  # doctest: +SKIP
    """
    rows = axis_of(dataset)
    if extra := [str(dim) for dim in dataset.dims if dim not in (rows, *OTHER_DIMS)]:
        raise InputError(f"the result has dimension {extra[0]!r}: choose one case, as in ds.isel({extra[0]}=0)")
    need(dataset, rows)
    names = [name for name, variable in dataset.data_vars.items() if variable.dims == (rows,)]
    table = dataset[names].reset_coords(drop=True).to_dataframe().replace([np.inf, -np.inf], np.nan)
    for name in table:
        if meanings := VARIABLES[name].meanings if name in VARIABLES else ():
            table[name] = [meanings[value] for value in table[name]]
    headings = [heading(str(name), dataset[name].attrs.get("units", "")) for name in (rows, *names)]
    settings = {"index_label": headings[0], "lineterminator": "\r\n"}  # equal files on every system
    with atomic_write(path) as temporary:
        table.to_csv(temporary, header=headings[1:], compression=None, **settings)
    return Path(path)
