"""Groups of a result: at the root what a user wants; beside it steps, energies, the parts of the error, the cost.

Inside the package a result is one Dataset, the whole of it, in which names of what lies over the accepted steps begin
with ``step_``, and in which each attribute stands by itself. In a file, and in what a user gets, the root and each
group are Datasets of their own. The root has at most twelve attributes, :data:`AT_ROOT`: those that a user reads first,
and all others in one of them, as JSON. It carries its groups in ``encoding``: xarray keeps that through selections and
copies, and writes it to no file.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from roughvisc.errors import InputError
from roughvisc.variables import STEPPED, of_step
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

#: Attribute that holds, as JSON, those that have no place of their own.
DETAILS = "details"
#: Attribute that holds the notes that warn, a line each.
NOTES = "notes"
#: Notes that warn of what a result is worth, in the order in which one should read them.
WARNINGS = ("accuracy_note", "edge_note", "border_note", "slope_note", "wake_note", "octave_note", "measurement_note")
#: Attributes of the root, in the order in which they are read.
AT_ROOT = (
    "title",
    NOTES,
    "boundary",
    "tolerance",
    "source",
    "history",
    "references",
    "Conventions",
    "result_format",
    "case_key",
    "case",
    DETAILS,
)
#: Attributes that stand among the details; an attribute that is not named here stays where the user has put it.
IN_DETAILS = (
    # how it was computed
    *("comment", "numerics_revision", "transforms", "method", "memory", "series_error", "left_out", "edge"),
    *("direction", "last_octave", "observed"),
    # the body
    *("thickness", "base", "kernel", "poisson", "compliance_at_once", "compliance_at_end", "time_scale"),
    # the surface
    *("surface_sha256", "source_file", "format", "instrument", "channel", "recipe", "filled_points", "fill_method"),
    # notes that do not warn
    *("model_note", "body_note", "material_note", "program_note", "slide_note"),
)
_NOTE = "_note"


def attributes_of(attributes: Mapping[Any, Any]) -> dict[str, Any]:
    """All that a result says of itself, each under its own name.

    Parameters
    ----------
    attributes : mapping
        Of a whole result, or of the root of one.

    Raises
    ------
    InputError
        If its details are no table in JSON.

    Examples
    --------
    >>> attributes_of({"title": "ball", "notes": "slope: too steep", "details": '{"method": "fast"}'})
    {'title': 'ball', 'method': 'fast', 'slope_note': 'too steep'}
    """
    found = {str(name): value for name, value in attributes.items() if name not in (DETAILS, NOTES)}
    if DETAILS in attributes:
        found |= {name: value for name, value in _table(attributes[DETAILS]).items() if name not in found}
    others = []
    for line in str(attributes.get(NOTES, "")).splitlines():
        about, _, text = line.partition(": ")
        if f"{about}{_NOTE}" in WARNINGS:
            found.setdefault(f"{about}{_NOTE}", text)
        else:
            others.append(line)
    return found | ({NOTES: "\n".join(others)} if others else {})


def for_root(attributes: Mapping[Any, Any]) -> dict[str, Any]:
    """The same as the root of a result has them: few, and the notes that warn among the first.

    Examples
    --------
    >>> for_root({"method": "fast", "slope_note": "too steep", "title": "ball"})
    {'title': 'ball', 'notes': 'slope: too steep', 'details': '{"method": "fast"}'}
    """
    known = attributes_of(attributes)
    notes = [f"{name.removesuffix(_NOTE)}: {' '.join(known.pop(name).split())}" for name in WARNINGS if name in known]
    if notes or NOTES in known:
        known[NOTES] = "\n".join([*notes, *([known[NOTES]] if NOTES in known else [])])
    details = {name: _plain(known.pop(name)) for name in IN_DETAILS if name in known}
    if details:
        known[DETAILS] = json.dumps(details, ensure_ascii=False)
    first = {name: known[name] for name in AT_ROOT if name in known}
    return first | known


def _table(text: Any) -> dict[str, Any]:
    try:
        found = json.loads(text)
    except (TypeError, ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise InputError(f"has an attribute {DETAILS} that is no table in JSON")
    return found


def _plain(value: Any) -> Any:
    """A value as JSON has it."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return value if isinstance(value, str | int | float | list | tuple) else str(value)


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
