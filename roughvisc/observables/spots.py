"""Contact clusters: position, number, size."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.labels import label
from roughvisc.observables.connectivity import cluster_sizes
from roughvisc.observables.derived import frame_by_frame, need
from roughvisc.topography.grid import spacing
from roughvisc.variables import axis_of


def _is_periodic(dataset: xr.Dataset) -> bool:
    return dataset.attrs.get("boundary") == "periodic"


def contact(dataset: xr.Dataset) -> xr.DataArray:
    """Cells in contact: those that carry pressure or, where no pressure is stored, those with no gap.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with ``pressure`` or ``gap``.

    Returns
    -------
    xarray.DataArray of bool, dims (time, x, y)
        A Dask array with one frame per block, if the result was opened from a file and several frames are not read yet.

    Raises
    ------
    InputError
        If the result holds neither ``pressure`` nor ``gap``.
    """
    field, touches = _telling(dataset)
    if field.ndim > 2 and not field.chunks and not field.variable._in_memory:
        field = field.chunk(dict.fromkeys(set(field.dims) - {"x", "y"}, 1))  # or all frames would be read here
    return touches(field)


def _telling(dataset: xr.Dataset) -> tuple[xr.DataArray, Callable]:
    """The field that tells where the contact is, and how it tells."""
    if "pressure" in dataset:
        need(dataset, "pressure")
        return dataset["pressure"], lambda pressure: pressure > 0
    need(dataset, "gap")
    return dataset["gap"], lambda gap: gap <= 0


def clusters(dataset: xr.Dataset) -> xr.Dataset:
    """Number and size of the contact clusters. Cells that share only a corner are not connected.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with ``pressure`` or ``gap``. If its attribute ``boundary`` is ``"periodic"``, clusters continue across
        opposite borders. If it is ``"mirror"``, a cluster counts with its part inside the border.

    Returns
    -------
    xarray.Dataset
        ``cluster_count``, ``cluster_area_mean`` and ``cluster_area_largest`` over time; areas are missing while
        there is no contact. [1], [m2], [m2]

    Raises
    ------
    InputError
        If the result contains neither ``pressure`` nor ``gap``, or the cells of its grid are not equal.
    """

    field, touches = _telling(dataset)

    def measure(frame):
        sizes = cluster_sizes(touches(frame), _is_periodic(dataset))
        return (len(sizes), sizes.mean(), sizes[0]) if len(sizes) else (0.0, np.nan, np.nan)

    cell = math.prod(spacing(dataset, "clusters"))
    count, mean, largest = frame_by_frame(measure, field, outputs=3)
    return label(
        xr.Dataset(
            {
                "cluster_count": count.astype("int64"),
                "cluster_area_mean": mean * cell,
                "cluster_area_largest": largest * cell,
            }
        )
    )


def cluster_areas(dataset: xr.Dataset) -> xr.Dataset:
    """Area of every contact cluster; computed immediately, with one frame in memory at a time.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result with ``pressure`` or ``gap``.

    Returns
    -------
    xarray.Dataset
        ``cluster_area`` with dimensions ``(time, cluster)``, or those of another axis, largest first, missing beyond
        the number of clusters. [m2]

    Raises
    ------
    InputError
        If the result holds neither ``pressure`` nor ``gap``, or is not of one case.
    """
    field, touches = _telling(dataset)
    rows = axis_of(field.dims)
    if field.dims != (rows, "x", "y"):
        raise InputError(f"the result has dimensions {field.dims}: choose one case first")
    sizes = [cluster_sizes(touches(frame.values), _is_periodic(dataset)) for frame in field]
    areas = np.full((len(sizes), max(map(len, sizes), default=0)), np.nan)
    for row, found in zip(areas, sizes, strict=True):
        row[: len(found)] = found * math.prod(spacing(dataset, "clusters"))
    return label(xr.Dataset({"cluster_area": ((rows, "cluster"), areas)}, coords={rows: dataset[rows]}))
