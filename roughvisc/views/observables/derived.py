"""The vocabulary of derived variables, and how functions of a frame or of a history are applied to a result."""

from __future__ import annotations

from collections.abc import Callable

import xarray as xr

from roughvisc.errors import InputError
from roughvisc.variables import Variable

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
    "cycle": Variable(("cycle",), "1", "number of the loading cycle", "counted from 1", dtype="int64"),
    "cycle_start": Variable(("cycle",), "s", "time at which the cycle starts"),
    "cycle_work": Variable(("cycle",), "J", "work done by the force in the cycle"),
    "cycle_closure": Variable(
        ("cycle",),
        "1",
        "how far force and approach at the ends of the cycle are apart",
        "over their ranges in the cycle; 0: the loop is closed",
    ),
    "dissipated_energy": Variable(
        ("cycle",), "J", "energy dissipated in the cycle", "missing where the loop does not close"
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


def need(dataset: xr.Dataset, *names: str) -> None:
    for name in names:
        if name not in dataset:
            stored = ", ".join(str(known) for known in dataset.data_vars)
            raise InputError(f"the result holds no {name!r} (it holds {stored}): run again with it among the fields")


def frame_by_frame(function: Callable, *fields: xr.DataArray, outputs: int = 1, dtype: type = float):
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


def along_time(function: Callable, *histories: xr.DataArray) -> xr.DataArray:
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
