"""Labels of a Dataset: units, names and comments of its variables, as they are declared in the vocabulary.

A variable that is not declared, or whose dimensions differ, is refused.
"""

from __future__ import annotations

from collections.abc import Hashable
from typing import TYPE_CHECKING

import numpy as np

from roughvisc.variables import SLIDING, STATUS_MEANINGS, VARIABLES, Variable, of_step

if TYPE_CHECKING:
    import xarray as xr


def annotate(dataset: xr.Dataset) -> xr.Dataset:
    """Dataset with the declared dtype and attributes on every variable.

    Parameters
    ----------
    dataset : xarray.Dataset
        Holds declared variables only; extra leading dimensions (``case``) are allowed.

    Raises
    ------
    KeyError
        If a variable is not declared.
    ValueError
        If a variable's dimensions are not the declared ones.
    """
    other = {}
    for name, variable in dataset.variables.items():
        declared = _declared(str(name), variable.dims)
        if variable.dtype != np.dtype(declared.dtype) and variable.dtype.kind not in "fUO":
            other[name] = variable.astype(declared.dtype)
    annotated = dataset.assign(other)  # once: each assignment merges the whole
    for name, variable in annotated.variables.items():
        declared = _vocabulary(variable.dims)[str(name)]
        variable.attrs.update(declared.attributes())
        if stated := " ".join(other for other in declared.ancillary if other in annotated):
            variable.attrs["ancillary_variables"] = stated
    for name in {"status", of_step("status")} & set(annotated.variables):
        annotated.variables[name].attrs.update(
            flag_values=np.arange(len(STATUS_MEANINGS), dtype="int8"),
            flag_meanings=" ".join(STATUS_MEANINGS),
        )
    return annotated


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


def _vocabulary(dims: tuple[Hashable, ...]) -> dict[str, Variable]:
    return SLIDING if "speed" in dims else VARIABLES


def _declared(name: str, dims: tuple[Hashable, ...]) -> Variable:
    known = _vocabulary(dims)
    if name not in known:
        raise KeyError(f"variable {name!r} is not declared in roughvisc.variables")
    declared = known[name]
    if dims[-len(declared.dims) :] != declared.dims:
        raise ValueError(f"variable {name!r} has dimensions {dims}, declared are {declared.dims}")
    return declared
