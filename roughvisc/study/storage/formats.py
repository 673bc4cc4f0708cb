"""Formats of results: files of former versions are read under the names of today.

The attribute ``result_format`` of a result is a number that says which meaning its names have. It is
:data:`roughvisc.variables.RESULT_FORMAT` today. Results of format 1 have no number. In them ``contact_area`` is the
count of cells; ``contact_fraction``, ``contact_area_lower`` and ``contact_area_upper`` belong to that count; and
``contact_area_corrected`` is the corrected area. ``leak_rate_lower`` and ``leak_rate_upper`` are bounds by the flow
solver. Files of format 2 have no groups: all their variables are at the root. In files of format 3 the energies are at
the root, and every attribute stands by itself: what splits a result sorts both.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.labels import annotate, format_of
from roughvisc.variables import NAMES_OF_TODAY, RESULT_FORMAT, of_step
from roughvisc.variables.axes import AXES, axis_of

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[Any]

#: Names of format 1 whose values stay, and their names today.
_RENAMED = {
    "contact_area": "contact_area_counted",
    "contact_area_corrected": "contact_area",
    "leak_rate_lower": "leak_rate_solver_lower",
    "leak_rate_upper": "leak_rate_solver_upper",
}
_FORMER = (*_RENAMED, "contact_fraction", "contact_area_lower", "contact_area_upper")
#: Before a name: nothing over the rows, and what stands there over the accepted steps.
_PREFIXES = ("", of_step(""))
#: All names that have another meaning in format 1.
FORMER_NAMES = tuple(f"{prefix}{name}" for prefix in _PREFIXES for name in _FORMER)


def current_histories(histories: Mapping[str, Array], attributes: Mapping[Any, Any]) -> dict[str, Array]:
    """Histories of a result under the names of today.

    Parameters
    ----------
    histories : mapping
        Name -> values; the last axis is that of the rows, or of the accepted steps.
    attributes : mapping
        Of the result.

    Raises
    ------
    InputError
        If the result's format is none that this version can read, or the histories are no numbers of one length.
    """
    if format_of(histories, attributes) >= NAMES_OF_TODAY:
        return dict(histories)
    found = {name: values for name, values in histories.items() if name not in FORMER_NAMES}
    for prefix in _PREFIXES:
        former = {name: histories[f"{prefix}{name}"] for name in _FORMER if f"{prefix}{name}" in histories}
        found |= {f"{prefix}{name}": values for name, values in _converted(former, found).items()}
    return found


def _converted(former: Mapping[str, Array], others: Mapping[str, Array]) -> dict[str, Array]:
    """Variables of format 1 as those of today; what cannot be derived from them is left out."""
    from roughvisc.mechanics.contact.neighbours import area_bounds, bounds_with_grid

    kinds = {(values.dtype.kind, values.shape) for values in former.values()}
    if len(kinds) > 1 or any(kind != "f" for kind, _ in kinds):
        raise InputError(f"holds {', '.join(former)} in different types or lengths: expected numbers of one length")
    found = {name: former[old] for old, name in _RENAMED.items() if old in former}
    if not {"contact_area", "contact_area_corrected"} <= former.keys():
        return found
    counted, area = found["contact_area_counted"], found["contact_area"]
    if "contact_fraction" in former:
        touching = counted > 0
        found["contact_fraction"] = former["contact_fraction"] * np.divide(
            area, counted, out=np.zeros_like(area), where=touching
        )
    if {"contact_area_lower", "contact_area_upper"} <= former.keys():
        inside, outside = counted - former["contact_area_lower"], former["contact_area_upper"] - counted
        lower, upper = area_bounds(counted, area, inside, outside)
        found |= {"contact_area_solver_lower": lower, "contact_area_solver_upper": upper}
        if "grid_error_area" in others:
            error = others["grid_error_area"] * np.max(area, axis=-1, keepdims=True)
            lower, upper = bounds_with_grid(lower, upper, error)
            found |= {"contact_area_lower": lower, "contact_area_upper": upper}
    return found


def to_current(dataset: xr.Dataset) -> xr.Dataset:
    """A result, or a trade of accuracy against speed, under the names of today; one that has them is as it was.

    Parameters
    ----------
    dataset : xarray.Dataset
        As its file has it.

    Raises
    ------
    InputError
        If its format is none that this version can read.
    """

    if "quantity" in dataset.coords:
        return _current_trade(dataset)
    found = format_of(dataset.variables, dataset.attrs)
    if found == RESULT_FORMAT:
        return dataset
    if found >= NAMES_OF_TODAY:
        return _with_labels_of_today(dataset)
    former = [name for name in FORMER_NAMES if name in dataset.variables]
    read = {name: dataset[name].values for name in (*former, "grid_error_area") if name in dataset.variables}
    known = AXES[axis_of(dataset.variables)].variables
    dims = {name.startswith(of_step("")): dataset[name].dims for name in former}
    columns = {
        name: (dims[name.startswith(of_step(""))], values)
        for name, values in current_histories(read, dataset.attrs).items()
        if name in known and name != "grid_error_area"
    }
    if "grid_error_area" in read:
        columns["grid_error_area"] = dataset["grid_error_area"].variable
    return _with_labels_of_today(dataset.drop_vars(former).assign(columns))


def _with_labels_of_today(dataset: xr.Dataset) -> xr.Dataset:
    """A result whose names have the meaning of today, with their labels, too."""
    import xarray as xr

    known = AXES[axis_of(dataset.variables)].variables
    declared = [name for name, one in dataset.variables.items() if name in known and one.dims == known[str(name)].dims]
    labelled = annotate(xr.Dataset({name: dataset[name].variable for name in declared}))
    found = dataset.assign_attrs(result_format=RESULT_FORMAT)
    for name, one in labelled.variables.items():
        found[name].attrs = dataset[name].attrs | one.attrs
    return found


def _current_trade(dataset: xr.Dataset) -> xr.Dataset:
    """A trade whose quantities have the names of today."""
    names = [str(name) for name in dataset["quantity"].values]
    if format_of(names, dataset.attrs) >= NAMES_OF_TODAY:
        return dataset
    return dataset.assign_coords(quantity=[_RENAMED.get(name, name) for name in names]).assign_attrs(
        result_format=RESULT_FORMAT
    )
