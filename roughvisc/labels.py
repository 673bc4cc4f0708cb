"""Units, names and comments of the variables of a Dataset, as declared in :mod:`roughvisc.variables`."""

from __future__ import annotations

import re
from collections.abc import Hashable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from roughvisc.errors import InputError
from roughvisc.units import quantity
from roughvisc.variables import AXES, ROW, ROWS, STEP, VARIABLES, Variable, axis_of, errors_of

if TYPE_CHECKING:
    import xarray as xr

#: CF names of the axes; with an attribute ``axis`` on x and y ParaView would wrap the surface on a sphere.
_CARTESIAN = {"time": "T", "x": "X", "y": "Y"}


def heading(name: str, unit: str) -> str:
    """Heading of a column: the name and, in brackets, the unit if there is one.

    Examples
    --------
    >>> heading("force", "N"), heading("contact_fraction", "1")
    ('force [N]', 'contact_fraction')
    """
    return f"{name} [{unit}]" if unit not in ("", "1") else name


def label(dataset: xr.Dataset, declared: Mapping[str, Variable] = VARIABLES) -> xr.Dataset:
    """Return a Dataset with the declared dtype and attributes on every variable.

    Parameters
    ----------
    dataset : xarray.Dataset
        Holds declared variables only, and coordinates of any name: what was varied in a case. Extra leading dimensions
        (``case``) are allowed.
    declared : mapping
        Name -> declaration.

    Raises
    ------
    KeyError
        If a variable is not declared.
    ValueError
        If the dimensions of a variable do not end in the declared ones.

    Notes
    -----
    Values after the last row of a case are missing, if the cases have rows of their own.
    """
    axis = axis_of(dataset.variables)
    if ROW in dataset.dims and axis in dataset.coords:
        dataset = dataset.where(dataset[axis].notnull())
    attributes: dict[Hashable, dict[str, Any]] = {}
    converted = {}
    for name, variable in dataset.variables.items():
        one = declared.get(str(name))
        if one is None or not _ends_in(variable.dims, one.dims):
            if name in dataset.coords:
                continue
            if one is None:
                raise KeyError(f"variable {name!r} is not declared in roughvisc.variables")
            raise ValueError(f"variable {name!r} has dimensions {variable.dims}, declared are {one.dims}")
        if variable.dtype != np.dtype(one.dtype) and variable.dtype.kind not in "fUO":
            converted[name] = variable.astype(one.dtype)
        attributes[name] = one.attributes()
        if stated := " ".join(other for other in errors_of(str(name)) if other in dataset):
            attributes[name]["ancillary_variables"] = stated
        if name in _CARTESIAN:
            attributes[name]["cartesian_axis"] = _CARTESIAN[str(name)]
    labelled = dataset.assign(converted)  # once: each assignment merges the whole
    for name, found in attributes.items():
        labelled.variables[name].attrs.update(found)
    return labelled


def _ends_in(dims: tuple[Hashable, ...], declared: tuple[str, ...]) -> bool:
    """Return whether dimensions end in the declared ones; a row may lie over any axis of rows."""
    own = dims[len(dims) - len(declared) :]
    rows = (*AXES, ROW, STEP)
    return len(own) == len(declared) and all(
        dim in rows if one in (ROW, STEP) else dim == one for dim, one in zip(own, declared, strict=True)
    )


def in_order(dataset: xr.Dataset) -> xr.Dataset:
    """Return a result with its variables in the order of their declaration: main results first."""
    known = list(VARIABLES)
    return dataset[sorted(dataset.data_vars, key=lambda name: known.index(name) if name in known else len(known))]


def warnings_of(attributes: Mapping[Any, Any]) -> dict[str, str]:
    """Return the warnings of a result by subject.

    Examples
    --------
    >>> warnings_of({"warnings": "slope: too steep"})
    {'slope': 'too steep'}
    """
    lines = str(attributes.get("warnings", "")).splitlines()
    return {subject: text for subject, _, text in (line.partition(": ") for line in lines)}


def warnings_text(warnings: Mapping[str, str]) -> str:
    """Return the attribute that states some warnings, one per line; empty ones are left out."""
    return "\n".join(f"{subject}: {' '.join(text.split())}" for subject, text in warnings.items() if text)


def own_rows(case: xr.Dataset) -> xr.Dataset:
    """Return one case of a sweep over its own times or speeds, without rows after its last."""
    if ROW not in case.dims:
        return case
    return case.isel({ROW: slice(int(case[ROWS]))}).swap_dims({ROW: axis_of(case.variables)})


def expect_history(dataset: xr.Dataset) -> None:
    """Refuse a result over another axis than time, where what happened before a row matters."""
    axis = axis_of(dataset.dims)
    if axis != "time":
        raise InputError(f"the result lies over {axis}: expected a history over time")


def expect_declared_units(dataset: xr.Dataset) -> None:
    """Refuse a result that was converted to other units: what is derived from it and drawn is counted in SI.

    Raises
    ------
    InputError
        If a declared variable states another unit than the declared one.
    """
    for name, variable in dataset.variables.items():
        declared = VARIABLES[str(name)].units if name in VARIABLES else ""
        found = str(variable.attrs.get("units", declared))
        if declared and found != declared and not _same_unit(found, declared):
            raise InputError(f"the result has {name!r} in {found!r}: expected {declared!r}, as it was stored")


def _same_unit(found: str, declared: str) -> bool:
    """Whether two texts are one unit: ``m2``, as UDUNITS writes it, is ``m^2``."""
    try:
        factor = quantity("1 " + re.sub(r"(?<=[a-zA-Z])(-?\d)", r"^\1", found), declared)
    except InputError:
        return False
    return factor == 1.0
