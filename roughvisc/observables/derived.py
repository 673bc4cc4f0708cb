"""Application of a function of one frame to every frame of a result."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.labels import expect_declared_units, expect_history


def need_history(dataset: xr.Dataset, *names: str) -> None:
    """Refuse what is no history over time, or lacks variables."""
    expect_history(dataset)
    need(dataset, *names)


def need(dataset: xr.Dataset, *names: str) -> None:
    """Refuse a result that lacks variables, or was converted to other units; say how to get them."""
    for name in names:
        if name not in dataset:
            stored = ", ".join(str(known) for known in dataset.data_vars)
            raise InputError(f"the result holds no {name!r} (it holds {stored}): run again with it among the fields")
    expect_declared_units(dataset)


def material_of(dataset: xr.Dataset, missing: str = "the result does not record its material: give material=") -> Any:
    """Material of the case in the attributes of a result; an :class:`InputError` of these words if there is none."""
    if "case" not in dataset.attrs:
        raise InputError(missing)
    from roughvisc.study.case import Case

    return Case.from_json(dataset.attrs["case"]).material()


def frame_by_frame(
    function: Callable,
    *fields: xr.DataArray,
    outputs: int = 1,
    dtype: type = float,
    over: tuple[str, int] | None = None,
):
    """Apply a function of the (x, y) arrays of one frame to every frame.

    Lazily on Dask, otherwise at once; of fields that are read from a file one frame is in memory at a time.

    Parameters
    ----------
    function : callable
        Gives as many numbers or, with `over`, arrays as there are `outputs`.
    *fields : xarray.DataArray
        Over x and y and any other dimensions.
    outputs : int
        How many DataArrays come out; more than one as a tuple.
    dtype : type
        Theirs.
    over : tuple of str and int, optional
        Dimension of the arrays that the function gives, and its size.
    """
    if not any(field.chunks for field in fields):
        return _one_after_the_other(function, fields, outputs, dtype, over)
    sizes = {} if over is None else {"output_sizes": dict([over])}
    return xr.apply_ufunc(
        function,
        *fields,
        input_core_dims=[["x", "y"]] * len(fields),
        output_core_dims=[[] if over is None else [over[0]]] * outputs,
        vectorize=True,
        dask="parallelized",
        output_dtypes=[dtype] * outputs,
        dask_gufunc_kwargs={"allow_rechunk": True, **sizes},
    )


def _one_after_the_other(function: Callable, fields, outputs: int, dtype: type, over: tuple[str, int] | None):
    """The same without Dask."""
    coords = {name: one for field in fields for name, one in field.coords.items() if not {"x", "y"} & set(one.dims)}
    sizes = {dim: size for field in fields for dim, size in field.sizes.items() if dim not in ("x", "y")}
    shape = tuple(sizes.values())
    found = [np.empty((*shape, *(() if over is None else over[1:])), dtype) for _ in range(outputs)]
    for place in np.ndindex(shape):
        at = dict(zip(sizes, place, strict=True))
        frame = [field.isel(at, missing_dims="ignore").transpose("x", "y").values for field in fields]
        values = function(*frame)
        for one, value in zip(found, (values,) if outputs == 1 else values, strict=True):
            one[place] = value
    dims = (*sizes, *(() if over is None else over[:1]))
    arrays = tuple(xr.DataArray(one, coords, dims) for one in found)
    return arrays[0] if outputs == 1 else arrays
