"""Contact clusters: position, number, size, percolation."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.labels import describe
from roughvisc.topography.grid import spacing
from roughvisc.views.observables.connectivity import cluster_sizes, percolates
from roughvisc.views.observables.derived import frame_by_frame, need


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

    Raises
    ------
    InputError
        If the result holds neither ``pressure`` nor ``gap``.
    """
    if "pressure" in dataset:
        return dataset["pressure"] > 0
    need(dataset, "gap")
    return dataset["gap"] <= 0


def clusters(dataset: xr.Dataset, *, connectivity: int = 4) -> xr.Dataset:
    """Number and size of the contact clusters.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with ``pressure`` or ``gap``; where its attribute ``boundary`` is ``"periodic"``, a cluster goes on
        across opposite borders.
    connectivity : {4, 8}
        Whether cells that share only a corner are apart or together.

    Returns
    -------
    xarray.Dataset
        ``cluster_count``, ``cluster_area_mean`` and ``cluster_area_largest`` over time; areas are missing while
        there is no contact. [1], [m2], [m2]

    Raises
    ------
    InputError
        If the result holds neither ``pressure`` nor ``gap``, or the cells of its grid are not equal.
    """

    def measure(mask):
        sizes = cluster_sizes(mask, _is_periodic(dataset), connectivity)
        return (len(sizes), sizes.mean(), sizes[0]) if len(sizes) else (0.0, np.nan, np.nan)

    cell = math.prod(spacing(dataset, "clusters"))
    count, mean, largest = frame_by_frame(measure, contact(dataset), outputs=3)
    return describe(
        xr.Dataset(
            {
                "cluster_count": count.astype("int64"),
                "cluster_area_mean": mean * cell,
                "cluster_area_largest": largest * cell,
            }
        )
    )


def cluster_areas(dataset: xr.Dataset, *, connectivity: int = 4) -> xr.Dataset:
    """Area of every contact cluster; computed at once, one frame in memory at a time.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result with ``pressure`` or ``gap``.
    connectivity : {4, 8}
        Whether cells that share only a corner are apart or together.

    Returns
    -------
    xarray.Dataset
        ``cluster_area`` with dimensions ``(time, cluster)``, largest first, missing beyond the number of clusters. [m2]

    Raises
    ------
    InputError
        If the result holds neither ``pressure`` nor ``gap``, or is not of one case.
    """
    touching = contact(dataset)
    if touching.dims != ("time", "x", "y"):
        raise InputError(f"the result has dimensions {touching.dims}: choose one case first")
    sizes = [
        cluster_sizes(touching.isel(time=frame).values, _is_periodic(dataset), connectivity)
        for frame in range(touching.sizes["time"])
    ]
    areas = np.full((len(sizes), max(map(len, sizes), default=0)), np.nan)
    for row, found in zip(areas, sizes, strict=True):
        row[: len(found)] = found * math.prod(spacing(dataset, "clusters"))
    return describe(xr.Dataset({"cluster_area": (("time", "cluster"), areas)}, coords={"time": dataset["time"]}))


def percolation(dataset: xr.Dataset, *, connectivity: int = 4) -> xr.Dataset:
    """Whether the region out of contact connects opposite sides: whether the contact leaks.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with ``pressure`` or ``gap``; its attribute ``boundary`` says whether the map repeats itself.
        Absent cells are out of contact.
    connectivity : {4, 8}
        4: a channel that only a corner keeps open is closed. 8: it is open.

    Returns
    -------
    xarray.Dataset
        ``percolates_x`` and ``percolates_y`` over time, 1 or 0. [1]

    Raises
    ------
    InputError
        If the result holds neither ``pressure`` nor ``gap``.
    """
    along_x, along_y = frame_by_frame(
        lambda touching: percolates(~touching, _is_periodic(dataset), connectivity),
        contact(dataset),
        outputs=2,
        dtype=bool,
    )
    return describe(xr.Dataset({"percolates_x": along_x.astype("int8"), "percolates_y": along_y.astype("int8")}))
