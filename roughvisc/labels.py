"""Labels of a Dataset: units, names and comments of its variables, as they are declared in the vocabulary.

A variable that is not declared, or whose dimensions differ, is refused.
"""

from __future__ import annotations

import re
from collections.abc import Hashable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from roughvisc.errors import InputError
from roughvisc.units import quantity
from roughvisc.variables import FLAGS, VARIABLES, Variable
from roughvisc.variables.axes import AXES, ROW, ROWS, axis_of

if TYPE_CHECKING:
    import xarray as xr


def heading(name: str, unit: str) -> str:
    """Heading of a column: the name and, in brackets, the unit if there is one.

    Examples
    --------
    >>> heading("force", "N"), heading("contact_fraction", "1")
    ('force [N]', 'contact_fraction')
    """
    return f"{name} [{unit}]" if unit not in ("", "1") else name


def annotate(dataset: xr.Dataset) -> xr.Dataset:
    """Dataset with the declared dtype and attributes on every variable.

    Parameters
    ----------
    dataset : xarray.Dataset
        Holds declared variables only, and scalar coordinates of any name: what was varied in a case. Extra leading
        dimensions (``case``) are allowed.

    Raises
    ------
    KeyError
        If a variable is not declared.
    ValueError
        If a variable's dimensions are not the declared ones.
    """
    declared = {
        name: _declared(str(name), one.dims)
        for name, one in dataset.variables.items()
        if name in VARIABLES or name not in dataset.coords or one.dims
    }
    other = {}
    for name, one in declared.items():
        variable = dataset.variables[name]
        if variable.dtype != np.dtype(one.dtype) and variable.dtype.kind not in "fUO":
            other[name] = variable.astype(one.dtype)
    annotated = dataset.assign(other)  # once: each assignment merges the whole
    for name, one in declared.items():
        attributes = one.attributes() | ({"cartesian_axis": one.axis} if one.axis else {})
        if stated := " ".join(other for other in one.ancillary if other in annotated):
            attributes["ancillary_variables"] = stated
        annotated.variables[name].attrs.update(attributes)
    for name in FLAGS.keys() & set(annotated.variables):
        annotated.variables[name].attrs.update(_flags(name))
    return annotated


def in_order(dataset: xr.Dataset) -> xr.Dataset:
    """Return a result with its variables in the order of their declaration: main results first."""
    known = list(AXES[axis_of(dataset.variables)].variables)
    return dataset[sorted(dataset.data_vars, key=lambda name: known.index(name) if name in known else len(known))]


def _flags(name: str) -> dict[str, Any]:
    """CF attributes that say what the values of a status mean."""
    meanings = FLAGS[name]
    return {"flag_values": np.arange(len(meanings), dtype="int8"), "flag_meanings": " ".join(meanings)}


def describe(dataset: xr.Dataset) -> xr.Dataset:
    """Dataset of derived variables alone, with the declared attributes and no others; missing after a case's last row.

    Parameters
    ----------
    dataset : xarray.Dataset
        Holds declared variables only; coordinates that are not declared, such as ``case``, stay as they are.

    Raises
    ------
    KeyError
        If a variable is not declared.
    ValueError
        If a variable's dimensions do not end in the declared ones.
    """
    described = dataset.copy()
    if ROW in described.dims and (axis := axis_of(described.variables)) in described.coords:
        described = described.where(described[axis].notnull())
    for name, variable in described.variables.items():
        if name in described.coords and (name not in VARIABLES or name not in described.dims):
            continue
        variable.attrs = _declared(str(name), variable.dims).attributes()
        if name in FLAGS:
            variable.attrs |= _flags(str(name))
    described.attrs = {}
    return described


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


def _declared(name: str, dims: tuple[Hashable, ...]) -> Variable:
    """What is declared of a variable over its axis, if its dimensions are those."""
    axis = axis_of(dims)
    if ROW in dims:  # of cases over one axis, which the dimension does not name
        axis = next((one.name for one in AXES.values() if name in one.variables), axis)
        dims = tuple(axis if dim == ROW else dim for dim in dims)
    known = AXES[axis].variables
    if name not in known:
        raise KeyError(f"variable {name!r} is not declared in roughvisc.variables")
    declared = known[name]
    if dims[len(dims) - len(declared.dims) :] != declared.dims:
        raise ValueError(f"variable {name!r} has dimensions {dims}, declared are {declared.dims}")
    return declared
