"""Labels of a Dataset: units, names and comments of its variables, as they are declared in the vocabulary.

A variable that is not declared, or whose dimensions differ, is refused.
"""

from __future__ import annotations

import re
from collections.abc import Container, Hashable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from roughvisc.errors import InputError
from roughvisc.units import quantity, shown
from roughvisc.variables import FLAGS, NAMES_OF_TODAY, OLDER_NAMES, RESULT_FORMAT, VARIABLES, Variable
from roughvisc.variables.axes import AXES, axis_of

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


def _flags(name: str) -> dict[str, Any]:
    """CF attributes that say what the values of a status mean."""
    meanings = FLAGS[name]
    return {"flag_values": np.arange(len(meanings), dtype="int8"), "flag_meanings": " ".join(meanings)}


def describe(dataset: xr.Dataset) -> xr.Dataset:
    """Dataset of derived variables alone, with the declared attributes and no others.

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
    for name, variable in described.variables.items():
        if name in described.coords and (name not in VARIABLES or name not in described.dims):
            continue
        variable.attrs = _declared(str(name), variable.dims).attributes()
        if name in FLAGS:
            variable.attrs |= _flags(str(name))
    described.attrs = {}
    return described


def expect_history(dataset: xr.Dataset) -> None:
    """Refuse a result over another axis than time, where what happened before a row matters."""
    axis = axis_of(dataset.dims)
    if axis != "time":
        raise InputError(f"the result lies over {axis}: expected a history over time")


def format_of(names: Container[Hashable], attributes: Mapping[Any, Any]) -> int:
    """Format of a result.

    Without a number it is 1 if it has the attributes or the names that results of format 1 have. What a user has put
    together without attributes has the names of today.

    Parameters
    ----------
    names : container of hashable
        Variables that it holds.
    attributes : mapping
        Of the result.

    Raises
    ------
    InputError
        If the number is none that this version can read.
    """
    if "result_format" in attributes:
        found = attributes["result_format"]
        found = found.item() if isinstance(found, np.generic) else found
        if isinstance(found, int) and 1 <= found <= RESULT_FORMAT:
            return found
        raise InputError(
            f"result_format is {shown(found)}: expected 1 to {RESULT_FORMAT}, the formats that this version of "
            "roughvisc reads"
        )
    if "contact_area_counted" in names:
        return RESULT_FORMAT
    return 1 if "tolerance" in attributes or any(name in names for name in OLDER_NAMES) else RESULT_FORMAT


def expect_current_names(dataset: xr.Dataset) -> None:
    """Refuse a result of a former version as xarray alone opens it: its names have other meanings.

    Raises
    ------
    InputError
        If its format is one in which names have other meanings.
    """
    found = format_of(dataset.variables, dataset.attrs)
    if found < NAMES_OF_TODAY:
        raise InputError(
            f"the result is of format {found}, in which 'contact_area' and other names have another meaning than today "
            f"(from format {NAMES_OF_TODAY} on): expected it as rv.open_result opens its file"
        )


def expect_declared_units(dataset: xr.Dataset) -> None:
    """Refuse a result that was converted to other units: what is derived from it and drawn is counted in SI.

    Raises
    ------
    InputError
        If a declared variable states a unit that is not the declared one in other words, or holds a pint array; or if
        the result is of a former format, in which names have other meanings.
    """
    expect_current_names(dataset)
    for name, variable in dataset.variables.items():
        declared = VARIABLES[str(name)].units if name in VARIABLES else ""
        if declared and "units" not in variable.attrs and hasattr(variable.data, "magnitude"):
            raise InputError(
                f"the result holds {name!r} as a pint array: expected numbers, as ds.pint.dequantify() gives"
            )
        found = str(variable.attrs.get("units", declared))
        if declared and found != declared and not _same_unit(found, declared):
            raise InputError(f"the result has {name!r} in {found!r}: expected {declared!r}, as it was stored")


def _same_unit(found: str, declared: str) -> bool:
    """Whether two texts are one unit: ``m2``, as UDUNITS and earlier results write it, is ``m^2``."""
    try:
        factor = quantity("1 " + re.sub(r"(?<=[a-zA-Z])(-?\d)", r"^\1", found), declared)
    except InputError:
        return False
    return factor == 1.0


def _declared(name: str, dims: tuple[Hashable, ...]) -> Variable:
    """What is declared of a variable over its axis, if its dimensions are those."""
    known = AXES[axis_of(dims)].variables
    if name not in known:
        raise KeyError(f"variable {name!r} is not declared in roughvisc.variables")
    declared = known[name]
    if dims[len(dims) - len(declared.dims) :] != declared.dims:
        raise ValueError(f"variable {name!r} has dimensions {dims}, declared are {declared.dims}")
    return declared
