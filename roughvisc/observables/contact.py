"""Cells in contact, contact clusters, and distributions of pressure and gap."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
import xarray as xr

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.labels import label
from roughvisc.mechanics.transport import label_clusters
from roughvisc.observables.frames import by_frame, frame_by_frame, need
from roughvisc.topography.grid import spacing
from roughvisc.units import in_si
from roughvisc.variables import VARIABLES


def contact(dataset: xr.Dataset) -> xr.DataArray:
    """Return the mask of cells in contact: cells with pressure or, if pressure is not stored, cells without a gap.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with ``pressure`` or ``gap``.

    Returns
    -------
    xarray.DataArray of bool, dims (time, x, y)
        A Dask array if the field is one, or is not read from its file yet.

    Raises
    ------
    InputError
        If the result contains neither ``pressure`` nor ``gap``.
    """
    name = "pressure" if "pressure" in dataset else "gap"
    need(dataset, name)
    field = by_frame(dataset[name]).drop_attrs(deep=False)
    return field > 0 if name == "pressure" else field <= 0


def clusters(dataset: xr.Dataset) -> xr.Dataset:
    """Count and measure the contact clusters. Cells that share only a corner are not connected.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with ``pressure`` or ``gap``. If its attribute ``boundary`` is ``"periodic"``, clusters continue across
        opposite borders. If it is ``"mirror"``, only the part of a cluster inside the border counts.

    Returns
    -------
    xarray.Dataset
        ``cluster_count``, ``cluster_area_mean`` and ``cluster_area_largest`` over time; areas are missing without
        contact. [1], [m2], [m2]

    Raises
    ------
    InputError
        If the result contains neither ``pressure`` nor ``gap``, or the cells of its grid are not equal.
    """
    periodic = dataset.attrs.get("boundary") == "periodic"

    def measure(frame: np.ndarray) -> tuple[float, float, float]:
        sizes = np.bincount(label_clusters(frame, (periodic, periodic)).ravel())[1:]
        return (sizes.size, sizes.mean(), sizes.max()) if sizes.size else (0.0, np.nan, np.nan)

    cell = math.prod(spacing(dataset, "clusters"))
    count, mean, largest = frame_by_frame(measure, contact(dataset), outputs=[(), (), ()])
    found = {
        "cluster_count": count.astype("int64"),
        "cluster_area_mean": mean * cell,
        "cluster_area_largest": largest * cell,
    }
    return label(xr.Dataset(found))


def distribution(
    dataset: xr.Dataset, name: Literal["pressure", "gap"] = "pressure", bins: int | Sequence[float | str] = 60
) -> xr.Dataset:
    """Return the probability density of the pressure in the contact, or of the gap outside it, over present cells.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with the field.
    name : {"pressure", "gap"}
        The field.
    bins : int, or array_like of float or str
        Number of equal bins from zero to the largest value at all times (which is read immediately), or their edges.
        [Pa] or [m]

    Returns
    -------
    xarray.Dataset
        ``pressure_density`` over time and ``pressure_bin`` [1/Pa], missing without contact; or ``gap_density`` over
        time and ``gap_bin`` [1/m], missing in full contact.

    Raises
    ------
    InputError
        If the result does not contain the field, or edges do not increase.
    """
    one_of("name", name, ("pressure", "gap"))
    need(dataset, name)
    field, dim = by_frame(dataset[name]), f"{name}_bin"
    if isinstance(bins, int | np.integer):
        largest = float(field.max())
        edges = np.linspace(0.0, largest if largest > 0 else 1.0, int(bins) + 1)
    else:
        edges = np.asarray(in_si(bins, VARIABLES[name].units, "bins"), dtype=float)
    if edges.ndim != 1 or len(edges) < 2 or not np.all(np.diff(edges) > 0):
        raise InputError(key="bins", found=bins, expected="a number, or two or more edges that increase")

    def measure(frame: np.ndarray) -> np.ndarray:
        values = frame[frame > 0]
        inside = np.histogram(values, edges)[0]
        return inside / (values.size * np.diff(edges)) if values.size else np.full(len(edges) - 1, np.nan)

    density = frame_by_frame(measure, field, outputs=[(dim,)], sizes={dim: len(edges) - 1})
    return label(xr.Dataset({f"{name}_density": density}, {dim: (edges[1:] + edges[:-1]) / 2}))
