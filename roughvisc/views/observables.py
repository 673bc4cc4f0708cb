"""Quantities derived from a result: what the contact looks like, and what it means mechanically.

Every function takes a result and returns a Dataset of the new variables alone (``xarray.merge`` or
``Dataset.update`` puts them beside the others). Leading dimensions other than time, such as ``case``, pass through;
fields on Dask are worked on frame by frame, lazily unless a docstring says otherwise.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.variables import Variable
from roughvisc.views.connectivity import cluster_sizes, percolates

_SERIES = ("time",)

#: The derived variables, in the form of :data:`roughvisc.variables.VARIABLES`.
OBSERVABLES: dict[str, Variable] = {
    "cluster_count": Variable(_SERIES, "1", "number of contact clusters", dtype="int64"),
    "cluster_area_mean": Variable(_SERIES, "m2", "mean area of a contact cluster"),
    "cluster_area_largest": Variable(_SERIES, "m2", "area of the largest contact cluster"),
    "cluster_area": Variable(
        ("time", "cluster"), "m2", "area of a contact cluster", "largest first; missing beyond the number of clusters"
    ),
    "pressure_bin": Variable(("pressure_bin",), "Pa", "pressure at the middle of a bin"),
    "gap_bin": Variable(("gap_bin",), "m", "gap at the middle of a bin"),
    "pressure_density": Variable(
        ("time", "pressure_bin"),
        "Pa-1",
        "probability density of the contact pressure",
        "over the cells in contact: its integral is 1",
    ),
    "gap_density": Variable(
        ("time", "gap_bin"),
        "m-1",
        "probability density of the gap",
        "over the present cells out of contact: its integral is 1",
    ),
    "gap_mean": Variable(_SERIES, "m", "mean gap over the present cells", "cells in contact included"),
    "gap_median": Variable(_SERIES, "m", "median gap over the present cells", "cells in contact included"),
    "area_growth_exponent": Variable(
        _SERIES, "1", "growth exponent of the contact area", "d ln(area) / d ln(time), local"
    ),
    "contact_stiffness": Variable(
        _SERIES,
        "N/m",
        "slope of force over approach along the history",
        "includes the creep between kept times; missing while the approach stands still",
    ),
    "work": Variable(
        _SERIES,
        "J",
        "work done by the force since the first kept time",
        "trapezoidal integral of force over approach; over a closed loop it is the energy dissipated",
    ),
    "percolates_x": Variable(
        _SERIES, "1", "whether the region out of contact connects opposite sides along x", dtype="int8"
    ),
    "percolates_y": Variable(
        _SERIES, "1", "whether the region out of contact connects opposite sides along y", dtype="int8"
    ),
}


def describe(dataset: xr.Dataset) -> xr.Dataset:
    """Dataset with the declared attributes of the derived variables.

    Raises
    ------
    KeyError
        If a variable is not declared in :data:`OBSERVABLES`.
    ValueError
        If a variable's dimensions do not end in the declared ones.
    """
    described = dataset.copy()
    for name in described.variables:
        if name in described.coords and name not in OBSERVABLES:
            continue
        declared = OBSERVABLES[str(name)]
        found = described[name].dims
        if found[-len(declared.dims) :] != declared.dims:
            raise ValueError(f"variable {name!r} has dimensions {found}, declared are {declared.dims}")
        described[name].attrs = declared.attributes()
    described.attrs = {}
    return described


def _need(dataset: xr.Dataset, *names: str) -> None:
    for name in names:
        if name not in dataset:
            stored = ", ".join(str(known) for known in dataset.data_vars)
            raise InputError(f"the result holds no {name!r} (it holds {stored}): run again with it among the fields")


def _frames(function: Callable, *fields: xr.DataArray, outputs: int = 1, dtype: type = float):
    """Apply a function of the (x, y) arrays of one frame to every frame, lazily on Dask."""
    return xr.apply_ufunc(
        function,
        *fields,
        input_core_dims=[["x", "y"]] * len(fields),
        output_core_dims=[[]] * outputs,
        vectorize=True,
        dask="parallelized",
        output_dtypes=[dtype] * outputs,
        dask_gufunc_kwargs={"allow_rechunk": True},
    )


def _cell_area(dataset: xr.Dataset) -> float:
    sides = [float(dataset[name][-1] - dataset[name][0]) / max(dataset.sizes[name] - 1, 1) for name in ("x", "y")]
    return sides[0] * sides[1]


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
    """
    if "pressure" in dataset:
        return dataset["pressure"] > 0
    _need(dataset, "gap")
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
    """

    def measure(mask):
        sizes = cluster_sizes(mask, _is_periodic(dataset), connectivity)
        return (len(sizes), sizes.mean(), sizes[0]) if len(sizes) else (0.0, np.nan, np.nan)

    cell = _cell_area(dataset)
    count, mean, largest = _frames(measure, contact(dataset), outputs=3)
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
        row[: len(found)] = found * _cell_area(dataset)
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
        ``percolates_x`` and ``percolates_y`` over time, 1 or 0.
    """
    along_x, along_y = _frames(
        lambda touching: percolates(~touching, _is_periodic(dataset), connectivity),
        contact(dataset),
        outputs=2,
        dtype=bool,
    )
    return describe(xr.Dataset({"percolates_x": along_x.astype("int8"), "percolates_y": along_y.astype("int8")}))


def _bin_edges(field: xr.DataArray, bins) -> np.ndarray:
    if not np.isscalar(bins):
        given = np.asarray(bins, dtype=float)
        if given.ndim != 1 or len(given) < 2 or not np.all(np.diff(given) > 0):
            raise InputError("bin edges must increase, and be two or more")
        return given
    largest = float(field.max())
    return np.linspace(0.0, largest if largest > 0 else 1.0, int(bins) + 1)


def _density(field: xr.DataArray, bins, name: str) -> xr.Dataset:
    """Probability density of the positive values of a field, frame by frame."""
    limits = _bin_edges(field, bins)

    def measure(values):
        values = values[values > 0]
        inside = np.histogram(values, limits)[0]
        return inside / (max(len(values), 1) * np.diff(limits)) if len(values) else np.full(len(limits) - 1, np.nan)

    dim = f"{name}_bin"
    density = xr.apply_ufunc(
        measure,
        field,
        input_core_dims=[["x", "y"]],
        output_core_dims=[[dim]],
        vectorize=True,
        dask="parallelized",
        output_dtypes=[float],
        dask_gufunc_kwargs={"allow_rechunk": True, "output_sizes": {dim: len(limits) - 1}},
    )
    return describe(
        xr.Dataset({f"{name}_density": density}).assign_coords({dim: (dim, (limits[1:] + limits[:-1]) / 2)})
    )


def pressure_distribution(dataset: xr.Dataset, bins=60) -> xr.Dataset:
    """Probability density of the pressure over the cells in contact.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with ``pressure``.
    bins : int or array_like
        Number of even bins from zero to the largest pressure of all times (which is looked up at once), or their
        edges. [Pa]

    Returns
    -------
    xarray.Dataset
        ``pressure_density`` over time and ``pressure_bin``; missing while there is no contact. [1/Pa]
    """
    _need(dataset, "pressure")
    return _density(dataset["pressure"], bins, "pressure")


def gap_distribution(dataset: xr.Dataset, bins=60) -> xr.Dataset:
    """Probability density of the gap over the present cells out of contact.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with ``gap``.
    bins : int or array_like
        Number of even bins from zero to the largest gap of all times (which is looked up at once), or their
        edges. [m]

    Returns
    -------
    xarray.Dataset
        ``gap_density`` over time and ``gap_bin``; missing in full contact. [1/m]
    """
    _need(dataset, "gap")
    return _density(dataset["gap"], bins, "gap")


def gap_statistics(dataset: xr.Dataset) -> xr.Dataset:
    """Mean and median gap over the present cells, those in contact included.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with ``gap``.

    Returns
    -------
    xarray.Dataset
        ``gap_mean`` and ``gap_median`` over time. [m]
    """
    _need(dataset, "gap")

    def measure(gap):
        present = gap[~np.isnan(gap)]
        return (present.mean(), np.median(present)) if present.size else (np.nan, np.nan)

    mean, median = _frames(measure, dataset["gap"], outputs=2)
    return describe(xr.Dataset({"gap_mean": mean, "gap_median": median}))


def _along_time(function: Callable, *histories: xr.DataArray) -> xr.DataArray:
    histories = tuple(one.chunk({"time": -1}) if one.chunks else one for one in histories)
    return xr.apply_ufunc(
        function,
        *histories,
        input_core_dims=[["time"]] * len(histories),
        output_core_dims=[["time"]],
        vectorize=True,
        dask="parallelized",
        output_dtypes=[float],
    )


def _slope(value: np.ndarray, over: np.ndarray) -> np.ndarray:
    """Derivative along a path: second order where ``over`` runs on, the last secant where it turns or starts."""
    slope = np.full(len(over), np.nan)
    if len(over) < 2:
        return slope
    step = np.diff(over)
    moving = np.abs(step) > 1e-12 * np.max(np.abs(over), initial=0.0, where=np.isfinite(over))
    secant = np.where(moving, np.diff(value) / np.where(moving, step, 1.0), np.nan)
    slope[1:] = secant
    slope[0] = secant[0]
    before, after = step[:-1], step[1:]
    runs_on = moving[:-1] & moving[1:] & (before * after > 0)
    total = np.where(runs_on, before + after, 1.0)
    slope[1:-1] = np.where(runs_on, (secant[:-1] * after + secant[1:] * before) / total, slope[1:-1])
    return slope


def area_growth(dataset: xr.Dataset, *, since: float = 0.0) -> xr.Dataset:
    """Growth exponent of the contact area, ``d ln(area) / d ln(time - since)``.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result; the area corrected for the grid is preferred where it is there.
    since : float
        The instant from which time is counted, such as the end of a loading ramp. [s]

    Returns
    -------
    xarray.Dataset
        ``area_growth_exponent`` over time; missing up to ``since`` and while there is no contact.
    """
    name = "contact_area_corrected" if "contact_area_corrected" in dataset else "contact_area"
    _need(dataset, name)

    def measure(area, time):
        grown = (time > since) & (area > 0)
        exponent = np.full(len(time), np.nan)
        exponent[grown] = _slope(np.log(area[grown]), np.log(time[grown] - since))
        return exponent

    return describe(xr.Dataset({"area_growth_exponent": _along_time(measure, dataset[name], dataset["time"])}))


def stiffness(dataset: xr.Dataset) -> xr.Dataset:
    """Contact stiffness: the slope of force over approach along the history.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result.

    Returns
    -------
    xarray.Dataset
        ``contact_stiffness`` over time: central differences where the approach runs on, the last secant where it
        turns; missing while it stands still. [N/m]
    """
    _need(dataset, "force", "approach")
    return describe(xr.Dataset({"contact_stiffness": _along_time(_slope, dataset["force"], dataset["approach"])}))


def work(dataset: xr.Dataset) -> xr.Dataset:
    """Work done by the force since the first kept time: the trapezoidal integral of force over approach.

    Over a loop that closes in force and approach its change is the energy dissipated.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result. What a jump at its very start did is not in it: one state of it is kept.

    Returns
    -------
    xarray.Dataset
        ``work`` over time. [J]
    """
    _need(dataset, "force", "approach")

    def measure(force, approach):
        done = np.diff(approach) * (force[1:] + force[:-1]) / 2
        return np.concatenate([np.zeros(min(len(force), 1)), np.cumsum(done)])

    return describe(xr.Dataset({"work": _along_time(measure, dataset["force"], dataset["approach"])}))


def observe(dataset: xr.Dataset) -> xr.Dataset:
    """All derived histories that the variables of a result allow.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result.

    Returns
    -------
    xarray.Dataset
        Clusters, percolation, gap statistics, growth exponent, stiffness and work over time.
    """
    found = []
    if "pressure" in dataset or "gap" in dataset:
        found += [clusters(dataset), percolation(dataset)]
    if "gap" in dataset:
        found.append(gap_statistics(dataset))
    if "contact_area" in dataset or "contact_area_corrected" in dataset:
        found.append(area_growth(dataset))
    if "force" in dataset and "approach" in dataset:
        found += [stiffness(dataset), work(dataset)]
    return xr.merge(found, compat="equals", join="exact")
