"""Result Datasets: labels of their variables as :mod:`roughvisc.variables` declares them, warnings, rows and steps.

A result contains rows at its kept times. The history of every accepted step is a second Dataset, the group ``steps`` of
the file. The first Dataset contains it in ``encoding``, which xarray keeps in selections and copies and does not write
to files; a sweep contains a function that reads the steps of a case. A function that needs the steps refuses a Dataset
without them, because its rows are too few for the same numbers.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Mapping
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.variables import ROW, ROWS, VARIABLES, axis_of

#: Coordinate of a sweep with the attributes in which the files of its cases differ, as JSON.
ATTRIBUTES = "attributes"
#: Group of the steps in a result's file, and its title; and the key of the steps in the encoding of a result, or of the
#: function from the key of a case to its steps in the encoding of a sweep.
STEPS = "steps"
TITLE = "histories of every accepted step"
CARRIED = "roughvisc_steps"
#: Prefix of a method -> module of its function, which lies in a higher layer and is imported at its first use.
_ROOMS = {"": "roughvisc.observables", "plot_": "roughvisc.plot"}


def heading(name: str, unit: str) -> str:
    """Return the heading of a column: the name, followed by any unit in brackets.

    Examples
    --------
    >>> heading("force", "N"), heading("contact_fraction", "1")
    ('force [N]', 'contact_fraction')
    """
    return f"{name} [{unit}]" if unit not in ("", "1") else name


def label(dataset: xr.Dataset) -> xr.Dataset:
    """Return a Dataset with the declared dtype and attributes on every variable.

    Parameters
    ----------
    dataset : xarray.Dataset
        Contains declared variables only, and coordinates of any name, for the varied parameters of a case.

    Raises
    ------
    KeyError
        If a variable is not declared.

    Notes
    -----
    If the cases have different rows, values after the last row of a case are missing.
    """
    if ROW in dataset.dims and (axis := axis_of(dataset.variables)) in dataset.coords:
        dataset = dataset.where(dataset[axis].notnull())
    declared = {}
    converted = {}
    for name, variable in dataset.variables.items():
        if name in VARIABLES or name in dataset.data_vars:
            declared[name] = VARIABLES[str(name)]
            if variable.dtype.kind not in "fUO" and variable.dtype != declared[name].dtype:
                converted[name] = variable.astype(declared[name].dtype)
    labelled = dataset.assign(converted) if converted else dataset.copy()  # once: each assignment merges the whole
    for name, declaration in declared.items():
        attributes = labelled.variables[name].attrs
        attributes.update(declaration.attributes)
        if errors := " ".join(filter(dataset.__contains__, declaration.errors)):
            attributes["ancillary_variables"] = errors
    return labelled


def warnings_of(attributes: Mapping[Any, Any]) -> dict[str, str]:
    """Return the warnings of a result by subject.

    Examples
    --------
    >>> warnings_of({"warnings": "slope: too steep"})
    {'slope': 'too steep'}
    """
    return dict(re.findall("^(.+?): (.+)$", str(attributes.get("warnings", "")), re.MULTILINE))


def grid_error_of(results: Iterable[Mapping[Any, Any]]) -> str:
    """Return the largest grid error of some results as text: of the pressure or, for a friction curve, of friction.

    Examples
    --------
    >>> grid_error_of([{"grid_error": [0.709, 0.02]}]), grid_error_of([{"force": [1.0]}])
    ('71 % of the pressure', 'not estimated (grid_error = true in [solve])')
    """
    known = list(results)
    for quantity in ("pressure", "friction_force"):
        name = VARIABLES[quantity].grid_error
        if errors := [np.ravel(result[name]) for result in known if np.size(result.get(name, ()))]:
            largest = np.fmax.reduce(np.concatenate(errors))
            of_quantity = f"% of the {quantity.removesuffix('_force')}"
            return "not known" if math.isnan(largest) else f"{100 * largest:.2g} {of_quantity}"
    return "not estimated (grid_error = true in [solve])"


def error_of(rows: xr.Dataset, name: str) -> xr.DataArray | None:
    """Return the stated error of a quantity at each row, in its unit: of steps and solver, and of the grid.

    None if the rows have neither. An error of the grid is relative to the largest row over time, and to the same row
    over speed.

    Parameters
    ----------
    rows : xarray.Dataset
        All rows of a result.
    name : str
        Variable over the rows.
    """
    if name not in VARIABLES:
        return None
    parts = []
    if VARIABLES[name].error in rows:
        parts.append(rows[VARIABLES[name].error])
    if VARIABLES[name].grid_error in rows:
        size = abs(rows[name])
        parts.append(rows[VARIABLES[name].grid_error] * (size.max() if axis_of(rows.variables) == "time" else size))
    return sum(parts[1:], parts[0]) if parts else None


def expect_declared_units(dataset: xr.Dataset) -> None:
    """Refuse a result that was converted to other units: derived quantities and figures need SI units.

    Raises
    ------
    InputError
        If a declared variable states another unit than the declared one.
    """
    for name, variable in dataset.variables.items():
        declared = VARIABLES[str(name)].units if name in VARIABLES else ""
        found = str(variable.attrs.get("units", declared))
        if declared and found.replace("^", "") != declared.replace("^", ""):  # UDUNITS writes m2 for m^2
            raise InputError(f"the result has {name!r} in {found!r}: expected {declared!r}, as it was stored")


def of_one_case(dataset: xr.Dataset) -> xr.Dataset:
    """Return a case that was selected from a sweep as its file contains it: all attributes, and only its own rows.

    Any other Dataset is returned unchanged.

    Examples
    --------
    >>> case = xr.Dataset({"force": ("time", [1.0])}, {"time": [0.0], "attributes": '{"boundary": "free"}'})
    >>> of_one_case(case).attrs
    {'boundary': 'free'}
    """
    if ATTRIBUTES in dataset.coords and not dataset[ATTRIBUTES].ndim and dataset[ATTRIBUTES].item():
        stated = json.loads(dataset[ATTRIBUTES].item())
        of_height = stated.pop("height", {})
        dataset = dataset.drop_vars(ATTRIBUTES).assign_attrs(stated)
        if "height" in dataset:
            dataset["height"] = dataset["height"].assign_attrs(of_height)
    axis = axis_of(dataset.variables)
    if axis in dataset.coords and dataset[axis].dims == (ROW,):
        known = np.flatnonzero(dataset[axis].notnull())
        dataset = dataset.isel({ROW: known}).swap_dims({ROW: axis}).drop_vars(ROWS, errors="ignore")
    return dataset


def boundary_of(dataset: xr.Dataset) -> str:
    """Return the boundary of a result or of a sweep; ``free`` if the attribute is absent.

    Raises
    ------
    InputError
        If the cases of a sweep have different boundaries.
    """
    stated = of_one_case(dataset)
    if ATTRIBUTES in stated.coords and "boundary" not in stated.attrs:
        raise InputError(key="boundary", found="several boundaries", expected="one case, as in ds.isel(case=0)")
    return str(stated.attrs.get("boundary", "free"))


def steps_of(result: xr.Dataset) -> xr.Dataset | None:
    """Return the history of the accepted steps that a result carries; None if it carries none, or another result's.

    When xarray combines several Datasets, it keeps the encoding of the first. Therefore the rows are compared with the
    steps.
    """
    result = of_one_case(result)
    steps = result.encoding.get(CARRIED)
    named = {"time", "force"} <= result.variables.keys()
    if callable(steps):
        key = str(result.attrs.get("case_key", ""))
        steps = steps(key) if key else None
    if steps is None or not named or result["force"].dims not in ((), ("time",)):
        return None
    rows = set(zip(np.ravel(result["time"]).tolist(), np.ravel(result["force"]).tolist(), strict=True))
    known = set(zip(steps["time"].values.tolist(), steps["force"].values.tolist(), strict=True))
    return steps if rows <= known else None


def cost_of(result: xr.Dataset) -> tuple[float, float]:
    """Return the wall time [s] and the convolutions of a result; NaN if it does not state them.

    A result over time states both in the history of its steps.
    """
    steps = steps_of(result)
    known = result if steps is None else steps
    if "wall_time" not in known:
        return math.nan, math.nan
    return float(known["wall_time"].max()), float(known["convolutions"].sum())


def require_steps(result: xr.Dataset) -> xr.Dataset:
    """Return the history of the accepted steps of a result.

    Raises
    ------
    InputError
        If the Dataset carries none.
    """
    steps = steps_of(result)
    if steps is None:
        raise InputError(
            key=STEPS,
            found=f"a Dataset over {', '.join(map(str, result.dims)) or 'nothing'} without the history of its steps",
            expected="a result from rv.simulate, rv.run or rv.open_result, one case of rv.sweep, or a selection of its "
            "rows (xarray loses the steps when it computes or combines values, and in to_netcdf)",
        )
    return steps


@xr.register_dataset_accessor("roughvisc")
class ResultAccessor:
    """Steps, observables and figures of a result; each method calls the function of its name with this result.

    ``ds.roughvisc.clusters()`` is ``rv.observables.clusters(ds)``, and ``ds.roughvisc.plot_maps()`` is
    ``rv.plot.maps(ds)``. Each function is imported at its first use.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result, or several as :func:`roughvisc.open_results` opens them.
    """

    def __init__(self, dataset: xr.Dataset) -> None:
        self._dataset = dataset

    @property
    def steps(self) -> xr.Dataset:
        """Histories of every accepted step, over ``step``."""
        return require_steps(self._dataset)

    def __getattr__(self, name: str) -> Any:
        start = "plot_" if name.startswith("plot_") else ""
        room = import_module(_ROOMS[start])
        function = name.removeprefix(start)
        if function not in room.__all__:
            raise AttributeError(f"the accessor roughvisc has no {name!r}")
        method = partial(getattr(room, function), self._dataset)
        method.__doc__ = method.func.__doc__
        return method

    def __dir__(self) -> list[str]:
        known = (start + name for start, module in _ROOMS.items() for name in import_module(module).__all__)
        return [*super().__dir__(), *known]
