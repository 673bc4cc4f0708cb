"""Cases: read from study files, varied, and identified by a key."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.arguments import a_table, located, split
from roughvisc.errors import InputError, RoughviscError, short_repr
from roughvisc.experiment.base import Experiment
from roughvisc.experiment.loading import Loading
from roughvisc.mechanics.adhesion import Adhesion
from roughvisc.mechanics.body import Body
from roughvisc.mechanics.materials.creep import Material
from roughvisc.mechanics.program import Program
from roughvisc.paths import path_of
from roughvisc.settings import Settings
from roughvisc.study.case_text import value_text
from roughvisc.study.study_file import in_si, parts_of, shift_factor, unit_of, with_files, without_late_times
from roughvisc.study.sweep_table import SURROGATE, place, sweep_changes, value_at
from roughvisc.topography.conditioning import STEPS
from roughvisc.topography.readers import sha256
from roughvisc.topography.scans import is_card, measured_file, read_card, read_toml, surface_height
from roughvisc.units import format_quantity
from roughvisc.version import NUMERICS_REVISION

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Case", "read_cases", "read_study", "vary"]


@dataclass(frozen=True)
class Case:
    """One simulation: a surface, a material, a program or a friction curve, and the settings of the solve.

    :func:`read_study`, :func:`read_cases` and :meth:`from_json` make and check it; :func:`vary` changes it.

    Attributes
    ----------
    tables : mapping
        The tables of the study file in SI, with absolute paths and the content of CSV files.
    origin : Path or None
        The study file.
    varied : mapping
        Values that a sweep or :func:`vary` set: dotted key -> value in SI.
    late_times : tuple of float
        Times of the study that are not kept, because in this case of its sweep they are after the end of the program.
        [s]
    title : str
        Title of the study.
    body : Body
        A half-space of the material, a sheet, or layers.
    experiment : Experiment
        A loading program or steady sliding.
    settings : Settings
        Settings of the solve, with the boundary that ``auto`` resolves to.
    """

    tables: Mapping[str, Any]
    origin: Path | None
    varied: Mapping[str, Any] = field(default_factory=dict, kw_only=True)
    late_times: tuple[float, ...] = field(default=(), kw_only=True, compare=False)
    title: str = field(compare=False)
    body: Body = field(compare=False)
    experiment: Experiment = field(compare=False)
    settings: Settings = field(compare=False)

    def __repr__(self) -> str:
        """Return title, surface, material, experiment and varied values in one line."""
        name = Path(self.surface["file"]).name if "file" in self.surface else self.surface["generate"]
        parts = [f"{self.title!r}, {name} on {self.tables['material']['model']}", repr(self.experiment)]
        parts += [f"{key} = {value_text(key, value)}" for key, value in self.varied.items()]
        return f"Case {'; '.join(parts)}"

    @property
    def surface(self) -> Mapping[str, Any]:
        """Table ``[surface]``."""
        return self.tables["surface"]

    @property
    def material(self) -> Material:
        """The material."""
        return self.body.material

    @property
    def note(self) -> str:
        """The times that are left out, and how a measured history became segments; empty if there is nothing to say."""
        notes = [self.experiment.program.note] if isinstance(self.experiment, Loading) else []
        if self.late_times:
            late = ", ".join(format_quantity(time, "s") for time in self.late_times)
            notes.append(f"Times after the end of the program are left out: {late}.")
        return " ".join(filter(None, notes))

    @property
    def shift_factor(self) -> float:
        """Factor of all times of the material at its temperature. [-]"""
        return shift_factor(self.tables["material"])

    @property
    def program(self) -> Program:
        """The loading program.

        Raises
        ------
        InputError
            If the study states friction, which has no program.
        """
        if not isinstance(self.experiment, Loading):
            raise InputError(key="friction", found="steady sliding", expected="[[program]] tables")
        return self.experiment.program

    @property
    def observed(self) -> Mapping[str, dict[str, Any]]:
        """Arguments of each observable that the study requests, in SI."""
        return self.tables.get("observe", {})

    @property
    def audit_inputs(self) -> Mapping[str, Any]:
        """Properties that the study states for an audit, in SI."""
        return self.tables.get("audit", {})

    @property
    def surface_sha256(self) -> str:
        """SHA-256 of the scan's file, or of the recipe of a generated surface."""
        return self.checksums[0][0]

    @cached_property
    def checksums(self) -> list[tuple[str, str]]:
        """Checksums of the files of the surface when the case was read, as :func:`checksums_of` returns them."""
        return checksums_of(self.surface)

    @cached_property
    def key(self) -> str:
        """Sixteen hexadecimal digits that identify everything that determines the numbers.

        The key is a digest of the tables in SI, the checksums of the scans, and
        :data:`roughvisc.version.NUMERICS_REVISION`. The title, the paths, and the tables ``[observe]`` and ``[audit]``
        do not count.
        """
        settings: dict[str, Any] = {"fields": sorted(self.settings.fields)}
        for one in fields(self.settings):
            if (value := getattr(self.settings, one.name)) != one.default:
                settings.setdefault(one.name, vars(value) if isinstance(value, Adhesion) else value)
        tables = {"material": self.tables["material"]}
        tables |= {"program": self.tables.get("program"), "friction": self.tables.get("friction")}
        surface = []
        for face in filter(None, (self.surface, self.surface.get("second"))):
            stated = split(face, "file", "second")[1]
            for name in face:
                if face[name] is False:  # a step left out
                    del stated[name]
            surface.append(stated)
        return _digest([tables, surface, settings, self.checksums, NUMERICS_REVISION])[:16]

    def height(self) -> xr.DataArray:
        """Return the conditioned heights of the surface, peaks up. [m]

        Raises
        ------
        InputError
            If the scan cannot be read, or its conditioning or its recipe is impossible.
        RoughviscError
            If a file has changed since the key was computed.
        """
        from roughvisc.experiment.resources import require_surface  # slow to import

        before, source = self.checksums, str(self.origin or "case")
        try:
            if "shape" in self.surface:
                require_surface(self.surface["shape"])
            height = surface_height(self.surface)
            is_changed = checksums_of(self.surface) != before
        except InputError as error:
            raise error.prefixed(source) from error
        if is_changed:
            changed = f"{self.surface.get('file', 'the second face')}: was changed after the study was read"
            raise RoughviscError(f"{source}: surface: {changed}: run the study again", transient=True)
        return height

    def to_json(self) -> str:
        """Return the case as JSON; :meth:`from_json` makes a case with the same key from it."""
        stated = dict(self.tables)
        if self.varied:
            stated["varied"] = dict(self.varied)
        if self.origin:
            stated["origin"] = str(self.origin.absolute())
        return json.dumps(stated)

    @classmethod
    def from_json(cls, text: str) -> Case:
        """Make a case from the JSON of :meth:`to_json`, which is also the attribute ``case`` of a result."""
        try:
            data = dict(json.loads(text))
        except (TypeError, ValueError, RecursionError) as error:
            raise InputError(f"not a case written by to_json: {error}") from error
        origin, varied = data.pop("origin", None), data.pop("varied", {})
        return replace(_case_of(data, origin and Path(origin)), varied=varied)


def read_study(path: str | Path) -> Case:
    """Read the case of a study file.

    Parameters
    ----------
    path : path
        A TOML file; files that it names are sought relative to it.

    Returns
    -------
    Case

    Raises
    ------
    InputError
        If the file cannot be read, if a key or a value is unknown, missing, impossible or in a wrong unit, or if the
        file contains a sweep: see :func:`read_cases`.
    """
    cases = read_cases(path)
    if len(cases) > 1 or cases[0].varied:
        found, expected = f"{len(cases)} cases", "one; read_cases() reads them all"
        raise InputError(key="sweep", found=found, expected=expected).prefixed(str(path))
    return cases[0]


def read_cases(path: str | Path) -> list[Case]:
    """Read all cases of a study file: the product of the lists in ``[sweep]``, or the runs of ``[[sweep]]``.

    A table ``[[sweep]]`` contains lists of equal length, combined entry by entry; several tables give consecutive runs.
    ``realisations = 24`` in a table computes each of its cases for 24 realisations of the surface.
    A pattern such as ``"surface.file" = "scans/*.sur"`` means the list of matching files. Without a sweep there is one
    case.

    Parameters
    ----------
    path : path
        A TOML file; files that it names are sought relative to it.

    In a sweep over programs a case leaves out the times of ``keep.times`` after the end of its own program.

    Returns
    -------
    list of Case
        In the order of the lists, the last key varying fastest.

    Raises
    ------
    InputError
        As :func:`read_study` does, for the first case that is wrong; or if a time is after the end of every program.
    """
    path = path_of(path, "path", "a study file")
    data = read_toml(path, "a study in TOML")
    try:
        changes = sweep_changes(data.pop("sweep"), data, path.parent) if "sweep" in data else [({}, {})]
    except InputError as error:
        raise error.prefixed(str(path)) from error
    cases = []
    for number, (change, drawn) in enumerate(changes):
        try:
            cases.append(_case_of(data, path, path.parent, change, drawn, leaves_out=True))
        except InputError as error:
            values = ", ".join(f"{key} = {short_repr(value)}" for key, value in {**change, **drawn}.items())
            raise error.prefixed(f"{path}: case {number} ({values})" if values else str(path)) from error
    if always_late := set.intersection(*(set(case.late_times) for case in cases)):
        expected = "times up to the end of the longest program"
        raise InputError(key="keep.times", found=max(always_late), expected=expected).prefixed(str(path))
    return cases


def case_given(case: Any) -> Case:
    """Return a case, or the case of the study file at a path; refuse anything else."""
    if isinstance(case, Case):
        return case
    if isinstance(case, str | PathLike):
        return read_study(case)
    raise InputError(key="case", found=case, expected="a Case, such as rv.read_study(...), or the path of a study file")


def cases_given(cases: Any) -> Sequence[Case]:
    """Return a list of cases, or the cases of the study file at a path; refuse anything else."""
    if isinstance(cases, str | PathLike):
        return read_cases(cases)
    if not isinstance(cases, Sequence) or not cases:
        expected = "a list of at least one case, such as rv.read_cases(...), or the path of a study file"
        raise InputError(key="cases", found=cases, expected=expected)
    for number, case in enumerate(cases):
        if not isinstance(case, Case):
            raise InputError(key=f"cases[{number}]", found=case, expected="a Case, such as rv.read_cases(...) lists")
    return cases


def vary(case: Case, changes: Mapping[str, Any]) -> Case:
    """Return a case with some of its values changed.

    Parameters
    ----------
    case : Case
    changes : mapping
        Dotted key -> value as in a study file: ``{"program.0.load": "2 N", "solve.tolerance": 1e-4}``. None removes a
        key.

    Returns
    -------
    Case

    Raises
    ------
    InputError
        If a key does not exist or a value is refused.
    """
    case = case_given(case)
    changes = a_table("changes", changes)
    try:
        changed = _case_of(case.tables, case.origin, case.origin and case.origin.parent, changes)
    except InputError as error:
        raise error.prefixed(str(case.origin or "case")) from error
    return replace(changed, varied={**case.varied, **changed.varied})


def _case_of(
    data: Mapping[str, Any],
    origin: Path | None,
    folder: Path | None = None,
    changes: Mapping[str, Any] = MappingProxyType({}),
    drawn: Mapping[str, int] = MappingProxyType({}),
    *,
    leaves_out: bool = False,
) -> Case:
    """Return the checked case of the tables of a study after changes.

    Parameters
    ----------
    data : mapping
        Tables of the study.
    origin : Path or None
        The study file.
    folder : Path, optional
        Folder of relative paths. Default: paths are not resolved.
    changes : mapping
        Dotted key -> value.
    drawn : mapping
        Number of the realisation, if the case is one.
    leaves_out : bool
        Whether to leave out times after the end of a changed program, instead of refusing them.
    """
    for key, value in changes.items():
        data = place(data, key, value)
    try:
        tables = with_files(data, folder)
        late: tuple[float, ...] = ()
        if leaves_out and any(key.partition(".")[0] == "program" for key in changes):
            tables, late = without_late_times(tables)
        case = Case(tables, origin, late_times=late, **parts_of(tables))
    except InputError as error:
        for key in (error.key, error.key.rpartition(".")[0]):
            file = value_at(data, f"{key}.file", None)
            if file is not None and key.startswith("material"):  # its columns have replaced its name in the table
                raise error.prefixed(str(file)) from error
        text = value_at(data, error.key, None)
        if text == error.found or in_si(text, error.key, data, folder) != error.found:
            raise
        message = str(error).replace(repr(error.found), repr(text))
        raise type(error)(message, key=error.key, found=text, expected=error.expected) from error
    varied: dict[str, Any] = {}
    for key, value in changes.items():
        if not drawn or key != SURROGATE:
            varied[key] = value_at(tables, key, value)
    return replace(case, varied=varied | drawn)


def checksums_of(surface: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return checksums of the scan or recipe of each face and of its surface card, without the origin of the card."""
    found = []
    for face in filter(None, (surface, surface.get("second"))):
        if "file" not in face:
            found.append((_digest(split(face, "second", "missing", "flip", "offset", *STEPS)[1]), ""))
            continue
        path = Path(face["file"])
        card = split(read_card(path)[1], "file")[1] if is_card(path) else {}
        scan = measured_file(path)
        try:
            found.append((_digest(card) if scan is None else sha256(scan), _digest(card) if card else ""))
        except InputError as error:
            raise located(error, "surface.file") from error
    return found


def _digest(stated: Any) -> str:
    """Return the SHA-256 of nested values, with numbers rounded to 15 significant digits and without notes."""

    def rounded(number: str) -> str:
        return f"{float(number) + 0.0:.15g}"  # of -0.0 and 0.0 the same

    def without_note(table: dict[str, Any]) -> dict[str, Any]:
        table.pop("note", None)
        return table

    text, numbers = json.dumps(stated), dict.fromkeys(("parse_int", "parse_float", "parse_constant"), rounded)
    plain = json.loads(text, object_hook=without_note, **numbers)
    return hashlib.sha256(json.dumps(plain, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


# -------------------------------------------------------------------------------------- varied parameters

#: Dimensions, values and attributes of a coordinate.
Label = tuple[tuple[str, ...], NDArray[Any], dict[str, str]]


def parameters_of(cases: Sequence[Mapping[str, Any]]) -> dict[str, NDArray[Any]]:
    """Return the varied parameters of cases in JSON; a case that does not vary one may state it, or lacks it."""
    keys = dict.fromkeys(key for case in cases for key in case.get("varied", {}))
    return {
        key: _column([{key: value_at(case, key, None), **case.get("varied", {})}[key] for case in cases])
        for key in keys
    }


def _column(values: Sequence[Any]) -> NDArray[Any]:
    """Return values as numbers, with NaN for None, or as strings."""
    if all(value is None or (isinstance(value, int | float) and not isinstance(value, bool)) for value in values):
        return np.array([np.nan if value is None else value for value in values])
    return np.array(["" if v is None else v if isinstance(v, str) else json.dumps(v) for v in values])


def labels_of(parameters: Mapping[str, Any], case: Mapping[str, Any], dims: tuple[str, ...] = ()) -> dict[str, Label]:
    """Return varied parameters as coordinates; ``long_name`` is the dotted key.

    Parameters
    ----------
    parameters : mapping
        Dotted key -> values over `dims`: numbers in SI, or strings; for one case, its value.
    case : mapping
        A case in JSON, which determines the units.
    dims : tuple of str
        Dimensions of the values; empty for one case.
    """
    labels: dict[str, Label] = {}
    for key, stated in parameters.items():
        values = stated if dims else _column([stated])[0]
        unit = unit_of(key, case) if values.dtype.kind in "if" else ""
        labels[identifier(key)] = (dims, values, {"long_name": key} | ({"units": unit} if unit else {}))
    return labels


def identifier(key: str) -> str:
    """Return a name of a varied parameter that Python and pandas accept: its dotted key with underscores.

    Examples
    --------
    >>> identifier("program.0.load")
    'program_0_load'
    """
    return key.replace(".", "_")
