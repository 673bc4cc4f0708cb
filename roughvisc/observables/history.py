"""Rows of a result: checks, a function of every frame, histories of the steps, and the work of each cycle."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.labels import expect_declared_units, label, of_one_case, require_steps
from roughvisc.variables import OTHER_DIMS, VARIABLES, axis_of

#: Times closer than this part of a period count as equal.
_SAME = 1e-9


def need(dataset: xr.Dataset, *names: str) -> None:
    """Refuse a result that lacks variables or was converted to other units; the message states the remedy."""
    for name in names:
        if name not in dataset:
            stored = ", ".join(str(known) for known in dataset.data_vars)
            raise InputError(f"the result holds no {name!r} (it holds {stored}): run again with it among the fields")
    expect_declared_units(dataset)


def expect_result(dataset: Any, *names: str) -> xr.Dataset:
    """Return the result of one case, see :func:`roughvisc.labels.of_one_case`.

    Raises
    ------
    InputError
        If the Dataset is not the result of one case, has no rows, or lacks variables, or one has another dimension.
    """
    axis = axis_of(getattr(dataset, "variables", ()))
    if not isinstance(dataset, xr.Dataset):
        raise InputError(f"expected a result (xarray.Dataset), found {type(dataset).__name__}")
    dataset = of_one_case(dataset)
    if extra := [str(dim) for dim in dataset.dims if dim not in (axis, *OTHER_DIMS)]:
        raise InputError(f"the result has dimension {extra[0]!r}: choose one case, as in ds.isel({extra[0]}=0)")
    need(dataset, axis, *names)
    if dataset[axis].size == 0:
        raise InputError(f"the result has no {axis}: expected at least one row")
    for name in names:
        if name in VARIABLES and set(dataset[name].dims) - {*VARIABLES[name].over(axis)}:  # by xarray's where, for one
            dims = dataset[name].dims
            expected = f"dimensions {', '.join(VARIABLES[name].over(axis))}, as stored"
            raise InputError(key=name, found=dims, expected=expected)
    return dataset


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
) -> Any:
    """Apply a function of the (x, y) arrays of one frame to every frame.

    The result is lazy if the fields are on Dask or are not read from their file yet, and computed immediately
    otherwise.

    Parameters
    ----------
    function : callable
        Returns a number or an array, or a tuple for several `outputs`.
    *fields : xarray.DataArray
        Over x and y and any other dimensions.
    outputs : sequence of sequence of str
        Dimensions of each result.
    sizes : dict, optional
        Sizes of the dimensions that the fields do not have.
    over : sequence of str
        Dimensions of a frame, in the order of the axes that the function takes.
    """
    return xr.apply_ufunc(
        function,
        *map(by_frame, fields),
        input_core_dims=[over] * len(fields),
        output_core_dims=outputs,
        vectorize=True,
        dask="parallelized",
        keep_attrs=False,
        output_dtypes=[float] * len(outputs),
        dask_gufunc_kwargs={"output_sizes": sizes or {}},
    )


def history(dataset: xr.Dataset) -> xr.Dataset:
    """Return the histories at every accepted step, under the names of the histories at the kept times.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result.

    Returns
    -------
    xarray.Dataset
        Force, approach, area, mean gap and work over ``time`` at every accepted step.

    Raises
    ------
    InputError
        If the Dataset contains several cases, or has lost the history of its steps.

    See Also
    --------
    roughvisc.plot.history, roughvisc.observables.cycle_work

    Examples
    --------
    >>> import roughvisc as rv
    >>> wave = rv.wavy("1 um", "0.1 mm", "0.1 mm", 16)
    >>> press = rv.Program().pressure("20 kPa", over="1 s")
    >>> ds = rv.simulate(wave, rv.elastic(1e6), press, times=3, progress=False)
    >>> steps = rv.observables.history(ds)
    >>> steps.sizes["time"] >= ds.sizes["time"]
    True
    """
    expect_declared_units(dataset)
    if "case" in dataset.dims:
        raise InputError(f"the Dataset has dimensions {', '.join(map(str, dataset.sizes))}: choose one case first")
    return require_steps(dataset).swap_dims(step="time").drop_attrs(deep=False)


def cycle_work(dataset: xr.Dataset) -> xr.Dataset:
    r"""Return the work done by the force in every cycle of the program, :math:`W = \oint F \, d\delta`.

    If force and approach are equal at the start and the end of a cycle, the work is the energy dissipated in the cycle.
    Otherwise a part of the work is stored, or was stored before.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result with ``work``, under a program with :meth:`Program.cycle`.

    Returns
    -------
    xarray.Dataset
        ``cycle_start`` [s] and ``cycle_work`` [J] over ``cycle``, the numbers of the whole cycles from 1.

    Raises
    ------
    InputError
        If the program has no whole cycle, or the Dataset has lost the history of its steps and a cycle begins or ends
        between its rows.

    See Also
    --------
    roughvisc.observables.history, roughvisc.Program

    Notes
    -----
    The work of a cycle is the change of the variable ``work`` in the cycle, over all accepted steps. Between steps
    ``work`` is interpolated linearly.

    Examples
    --------
    >>> import roughvisc as rv
    >>> rubber = rv.zener(3e6, 1e6, 1e5)
    >>> waves = rv.Program().cycle(mean="0.1 mN", amplitude="0.05 mN", period="0.2 s", cycles=2)
    >>> ds = rv.simulate(rv.sphere(1e-3, 2e-4, 17), rubber, waves, tolerance=1e-2, times=3, progress=False)
    >>> bool((rv.observables.cycle_work(ds).cycle_work > 0).all())
    True
    """
    dataset = expect_result(dataset, "time", "work")
    segments = json.loads(dataset.attrs.get("cycles", "[]"))
    cycles = [(start + number * period, period) for start, period, count in segments for number in range(count)]
    if not cycles:
        expected = "one case's result, under a program with a whole cycle: see Program.cycle"
        raise InputError(key="cycles", found=segments, expected=expected)
    begin, period = np.transpose(cycles)
    ends = np.concatenate([begin, begin + period])
    rows = dataset["time"].values
    is_row = np.abs(ends[:, None] - rows).min(axis=1) <= _SAME * np.tile(period, 2)
    steps = dataset if is_row.all() else require_steps(dataset)  # the work at a row includes all steps before it
    work = np.interp(ends, steps["time"], steps["work"])
    cycle_values = xr.Dataset(
        {"cycle_start": ("cycle", begin), "cycle_work": ("cycle", work[begin.size :] - work[: begin.size])},
        coords={"cycle": np.arange(begin.size) + 1},
    )
    return label(cycle_values)
