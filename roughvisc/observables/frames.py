"""Application of a function of one frame to every frame of a result."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import xarray as xr

from roughvisc.errors import InputError
from roughvisc.labels import expect_declared_units
from roughvisc.variables import OTHER_DIMS, axis_of


def need(dataset: xr.Dataset, *names: str) -> None:
    """Refuse a result that lacks variables or was converted to other units; the message states the remedy."""
    for name in names:
        if name not in dataset:
            stored = ", ".join(str(known) for known in dataset.data_vars)
            raise InputError(f"the result holds no {name!r} (it holds {stored}): run again with it among the fields")
    expect_declared_units(dataset)


def expect_result(dataset: Any, *names: str) -> None:
    """Refuse a Dataset that is not the result of one case, has no rows, or lacks variables."""
    axis = axis_of(getattr(dataset, "variables", ()))
    if not isinstance(dataset, xr.Dataset):
        raise InputError(f"expected a result (xarray.Dataset), found {type(dataset).__name__}")
    if extra := [str(dim) for dim in dataset.dims if dim not in (axis, *OTHER_DIMS)]:
        raise InputError(f"the result has dimension {extra[0]!r}: choose one case, as in ds.isel({extra[0]}=0)")
    need(dataset, axis, *names)
    if dataset[axis].size == 0:
        raise InputError(f"the result has no {axis}: expected at least one row")


def by_frame(field: xr.DataArray) -> xr.DataArray:
    """Return a field on Dask, one frame a block, unless it is in memory."""
    in_memory = field.variable._in_memory
    return field if in_memory else field.chunk({dim: -1 if dim in ("x", "y") else 1 for dim in field.dims})


def frame_by_frame(
    function: Callable[..., Any],
    *fields: xr.DataArray,
    outputs: Sequence[Sequence[str]] = ((),),
    sizes: dict[str, int] | None = None,
    over: Sequence[str] = ("x", "y"),
) -> tuple[xr.DataArray, ...]:
    """Apply a function of the (x, y) arrays of one frame to every frame.

    The result is lazy if the fields are on Dask or are not read from their file yet, and computed immediately
    otherwise.

    Parameters
    ----------
    function : callable
        Returns a tuple with one number or array for each of `outputs`.
    *fields : xarray.DataArray
        Over x and y and any other dimensions.
    outputs : sequence of sequence of str
        Dimensions of each result.
    sizes : dict, optional
        Sizes of the dimensions that the fields do not have.
    over : sequence of str
        Dimensions of a frame, in the order of the axes that the function takes.
    """
    found = xr.apply_ufunc(
        function if len(outputs) > 1 else lambda *frame: function(*frame)[0],
        *map(by_frame, fields),
        input_core_dims=[over] * len(fields),
        output_core_dims=outputs,
        vectorize=True,
        dask="parallelized",
        keep_attrs=False,
        output_dtypes=[float] * len(outputs),
        dask_gufunc_kwargs={"output_sizes": sizes or {}},
    )
    return found if len(outputs) > 1 else (found,)
