"""Groups of a result: at the root what a user wants; beside it steps, energies, the parts of the error, the cost.

Inside the package a result is one Dataset, the whole of it, in which names of what lies over the accepted steps begin
with ``step_``, and in which each attribute stands by itself. In a file, and in what a user gets, the root and each
group are Datasets of their own. A root carries its groups in ``encoding``: xarray keeps that through selections and
copies, and writes it to no file.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from roughvisc.errors import InputError
from roughvisc.variables import STEPPED, of_step
from roughvisc.variables.attributes import attributes_of, for_root
from roughvisc.variables.axes import AXES, axis_of

if TYPE_CHECKING:
    import xarray as xr

#: Name of each group -> what it holds.
GROUPS = {
    "steps": "histories of every accepted step",
    "energy": "work and energies since the start",
    "accuracy": "stated errors, their parts, and bounds",
    "cost": "iterations, convolutions and time that the rows have cost",
}
_CARRIED = "roughvisc_groups"
_PREFIX = of_step("")


def split(whole: xr.Dataset) -> dict[str, xr.Dataset]:
    """Root and groups of a whole result: the root under an empty name, and no group that would be empty."""
    rows = axis_of(whole.variables)
    known = AXES[rows].variables
    names: dict[str, list[str]] = {}
    for name in map(str, whole.data_vars):
        names.setdefault(known[name].group if name in known else "", []).append(name)
    root = whole.drop_vars([name for group, members in names.items() if group for name in members])
    root = root.drop_vars("step", errors="ignore")
    root.encoding.pop(_CARRIED, None)
    root.attrs = for_root(whole.attrs)
    parts = {"": root}
    for group in [group for group in GROUPS if group in names]:
        part = whole[names[group]]
        scalars = [name for name, one in part.coords.items() if not one.dims and (name != rows or group == "steps")]
        part = part.drop_vars(["step", *scalars], errors="ignore")
        if group == "steps":
            part = part.rename({name: name.removeprefix(_PREFIX) for name in names[group]}).set_coords("time")
        part.encoding = {}
        part.attrs = {"title": GROUPS[group]}
        parts[group] = part
    return {group: _with_references_inside(part) for group, part in parts.items()}


def _with_references_inside(part: xr.Dataset) -> xr.Dataset:
    """A part of a result whose variables refer to variables of this part alone."""
    part = part.copy(deep=False)  # its variables may be those of the whole, whose attributes stay
    for name, one in part.variables.items():
        if stated := one.attrs.get("ancillary_variables"):
            others = [other.removeprefix(_PREFIX) if "step" in one.dims else other for other in stated.split()]
            inside = " ".join(other for other in others if other in part.variables)
            attributes = {key: value for key, value in one.attrs.items() if key != "ancillary_variables"}
            part[name].attrs = attributes | ({"ancillary_variables": inside} if inside else {})
    return part


def root_of(whole: xr.Dataset) -> xr.Dataset:
    """Root of a whole result, which carries its groups."""
    parts = split(whole)
    return carrying(parts.pop(""), parts)


def carrying(root: xr.Dataset, groups: dict[str, xr.Dataset]) -> xr.Dataset:
    """The root, which carries these groups from now on, and by what it is known again."""
    known = root[[name for name in AXES[axis_of(root.variables)].needed if name in root.variables]]
    known = known.drop_vars([name for name, one in known.coords.items() if not one.dims])
    known.encoding = {}
    root.encoding = {**root.encoding, _CARRIED: (known, groups)}
    return root


def with_groups_of(root: xr.Dataset, dataset: xr.Dataset) -> xr.Dataset:
    """A Dataset that xarray alone has opened, or a selection of it, carrying the groups of the same root."""
    found = dataset.copy(deep=False)
    found.encoding = {**dataset.encoding, _CARRIED: root.encoding[_CARRIED]}
    return found


def groups_of(root: xr.Dataset) -> dict[str, xr.Dataset]:
    """The groups that a root carries."""
    return root.encoding[_CARRIED][1] if _CARRIED in root.encoding else {}


def whole_of(dataset: xr.Dataset) -> xr.Dataset:
    """The whole of a result, as far as its root, or what was selected of that, carries its groups.

    What xarray puts together of several results keeps the encoding of the first: its groups belong to that alone.
    """
    rows, found = axis_of(dataset.variables), {}
    whole = dataset.copy(deep=False)
    whole.attrs = attributes_of(dataset.attrs)
    if not _is_known(dataset, rows):
        return whole
    for group, part in groups_of(dataset).items():
        here = _selected(part, dataset, rows)
        assert here is not None, "its rows and cases are those of the root"
        prefix = _PREFIX if group == "steps" else ""
        left_out = dataset.variables.keys() | (() if prefix else here.coords.keys())
        names = {f"{prefix}{name}": one for name, one in here.variables.items() if name != "case_key"}
        found |= {name: one for name, one in names.items() if name not in left_out}
    return whole.assign(found)


def _is_known(dataset: xr.Dataset, rows: str) -> bool:
    """Whether the rows of a Dataset are rows of the root that its groups were split from."""
    if _CARRIED not in dataset.encoding:
        return False
    here = _selected(dataset.encoding[_CARRIED][0], dataset, rows)
    return here is not None and all(
        name in dataset.variables and dataset.variables[name].equals(one) for name, one in here.variables.items()
    )


def _selected(part: xr.Dataset, dataset: xr.Dataset, rows: str) -> xr.Dataset | None:
    """A group at the rows and the cases that a Dataset holds; None where these are not all known."""
    for dimension in ("realisation", rows):
        if dimension not in part.dims:
            continue
        wanted = dataset.coords.get(dimension)
        if wanted is None or wanted.dims not in ((), (dimension,)) or not np.isin(wanted, part[dimension]).all():
            return None
        if not wanted.equals(part[dimension]):
            part = part.sel({dimension: wanted.values})
    if "case" not in part.dims:
        return part
    wanted = dataset.coords.get("case_key")
    if wanted is None or wanted.dims != tuple(dim for dim in part["case_key"].dims if dim in dataset.dims):
        return None
    known = np.reshape(part["case_key"].values, (part.sizes["case"], -1))
    row_of = {key: row for row, keys in enumerate(known) for key in keys if key}  # empty: no result there
    several = "case" in wanted.dims
    found = [
        next((row_of[key] for key in np.ravel(keys) if key in row_of), None)
        for keys in (wanted.values if several else [wanted.values])
    ]
    if None in found:
        return None
    return part.isel(case=found if several else found[0])


def group_of(dataset: xr.Dataset, group: str) -> xr.Dataset:
    """A group of a result. Where every accepted step is a row, the group of the steps is that of the rows.

    Raises
    ------
    InputError
        If there is no group of that name, or the Dataset does not carry it.
    """
    if group not in GROUPS:
        raise InputError(f"group is {group!r}: expected one of {', '.join(GROUPS)}")
    rows, found = axis_of(dataset.variables), None
    if not _is_known(dataset, rows):
        found = split(dataset).get(group)
    elif group in groups_of(dataset):
        found = _selected(groups_of(dataset)[group], dataset, rows)
    every_step = [name for name in STEPPED if name in dataset]
    if found is None and group == "steps" and every_step and "time" in dataset.dims:
        whole = whole_of(dataset)
        rows = whole[[name for name in STEPPED if name in whole]]
        rows = rows.drop_vars([name for name, one in rows.coords.items() if not one.dims])
        found = rows.drop_indexes("time").rename_dims(time="step")
        found.encoding, found.attrs = {}, {"title": GROUPS[group]}
    if found is None:
        raise InputError(
            f"the Dataset carries no group {group!r}: expected a result as rv.simulate and rv.open_result "
            "give it, or a selection of one"
        )
    return found
