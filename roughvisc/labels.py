"""Labels of a Dataset: units, names and comments of its variables, as they are declared in the vocabulary.

A variable that is not declared, or whose dimensions differ, is refused.
"""

from __future__ import annotations

import re
from collections.abc import Hashable
from typing import TYPE_CHECKING

import numpy as np

from roughvisc.errors import InputError
from roughvisc.units import quantity
from roughvisc.variables import SLIDING, STATUS_MEANINGS, VARIABLES, Variable, of_step

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
    other = {}
    known = {name: one for name, one in dataset.variables.items() if not _is_label(dataset, name)}
    for name, variable in known.items():
        declared = _declared(str(name), variable.dims)
        if variable.dtype != np.dtype(declared.dtype) and variable.dtype.kind not in "fUO":
            other[name] = variable.astype(declared.dtype)
    annotated = dataset.assign(other)  # once: each assignment merges the whole
    for name in known:
        variable = annotated.variables[name]
        declared = _vocabulary(variable.dims)[str(name)]
        variable.attrs.update(declared.attributes() | ({"cartesian_axis": declared.axis} if declared.axis else {}))
        if stated := " ".join(other for other in declared.ancillary if other in annotated):
            variable.attrs["ancillary_variables"] = stated
    for name in {"status", of_step("status")} & set(annotated.variables):
        annotated.variables[name].attrs.update(
            flag_values=np.arange(len(STATUS_MEANINGS), dtype="int8"),
            flag_meanings=" ".join(STATUS_MEANINGS),
        )
    return annotated


def _is_label(dataset: xr.Dataset, name: Hashable) -> bool:
    """Whether a variable is a scalar coordinate that is not declared."""
    return name not in VARIABLES and name in dataset.coords and not dataset.variables[name].dims


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
    described.attrs = {}
    return described


def expect_declared_units(dataset: xr.Dataset) -> None:
    """Refuse a result that was converted to other units: what is derived from it and drawn is counted in SI.

    Raises
    ------
    InputError
        If a declared variable states a unit that is not the declared one in other words.
    """
    for name, variable in dataset.variables.items():
        declared = VARIABLES[str(name)].units if name in VARIABLES else ""
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


def _vocabulary(dims: tuple[Hashable, ...]) -> dict[str, Variable]:
    return SLIDING if "speed" in dims else VARIABLES


def _declared(name: str, dims: tuple[Hashable, ...]) -> Variable:
    known = _vocabulary(dims)
    if name not in known:
        raise KeyError(f"variable {name!r} is not declared in roughvisc.variables")
    declared = known[name]
    if dims[len(dims) - len(declared.dims) :] != declared.dims:
        raise ValueError(f"variable {name!r} has dimensions {dims}, declared are {declared.dims}")
    return declared
