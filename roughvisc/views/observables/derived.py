"""Application of a function of frames or of histories to a result."""

from __future__ import annotations

from collections.abc import Callable

import xarray as xr

from roughvisc.errors import InputError
from roughvisc.labels import expect_declared_units


def need(dataset: xr.Dataset, *names: str) -> None:
    for name in names:
        if name not in dataset:
            stored = ", ".join(str(known) for known in dataset.data_vars)
            raise InputError(f"the result holds no {name!r} (it holds {stored}): run again with it among the fields")
    expect_declared_units(dataset)


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
