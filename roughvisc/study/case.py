"""Cases: read from study files, varied, and identified by a key."""

from __future__ import annotations

import builtins
import dataclasses
import itertools
import json
import math
import os
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from roughvisc.arguments import a_table, refuse_unknown, split
from roughvisc.errors import InputError, RoughviscError, short_repr
from roughvisc.experiment.base import Experiment
from roughvisc.experiment.loading import Loading
from roughvisc.experiment.sliding import SteadySliding
from roughvisc.mechanics.adhesion import Adhesion
from roughvisc.mechanics.body import Body
from roughvisc.mechanics.materials.material import Creep, Material, Prony, ThermalLaw
from roughvisc.mechanics.materials.models import creep_series
from roughvisc.mechanics.program import Program
from roughvisc.paths import atomic_write, path_of
from roughvisc.settings import Boundary, Edge, Missing, Numerics, Settings
from roughvisc.study.case_text import case_html, study_text, value_text
from roughvisc.study.identity import (
    area_of,
    body_identity,
    checksums_of,
    digest,
    experiment_identity,
    settings_identity,
    surface_identity,
)
from roughvisc.study.material_file import with_line
from roughvisc.study.objects import (
    adhesion_table,
    experiment_of,
    experiment_table,
    material_table,
    surface_table,
    tables_of,
)
from roughvisc.study.study_file import (
    TABLE_OF,
    TABLES,
    in_si,
    parts_of,
    shift_factor,
    unit_of,
    with_files,
    without_late_times,
)
from roughvisc.study.sweep_table import MOST_CASES, SURROGATE, place, sweep_changes, value_at
from roughvisc.topography.heights import digest_in, file_name, write_heights
from roughvisc.topography.scans import read_toml, surface_height
from roughvisc.units import format_quantity
from roughvisc.version import NUMERICS_REVISION

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Case", "read_cases", "read_study", "vary"]

#: Keys whose value may be a list, so that only a list of lists contains several values.
_LISTS = ("program", "fields", "times", "speeds", "shape", "size", "spacing", "resample", "x", "y", "offset")
_LISTS += ("moduli", "ratios", "compliances", "frequencies", "storage", "loss", "shift_factors", "values")
#: Arguments of a case that objects of Python state.
_OBJECTS = ("surface", "material", "program", "adhesion")


@dataclass(frozen=True, init=False, repr=False)
class Case:
    """One simulation: a surface, a material, a program or steady sliding, and the settings of the solve.

    :func:`read_study` and :func:`read_cases` return cases of a study file; :func:`vary` changes a case. All functions
    that take a study file take a case.

    Parameters
    ----------
    surface : xarray.DataArray, dims (x, y)
        Heights, as in :func:`roughvisc.simulate`. [m]
    material : Material or Body
        Material of a half-space, or a body, as in :func:`roughvisc.simulate`. The series that a
        run uses replaces a function from :func:`roughvisc.creep`.
    program : Program or SteadySliding
        Load, nominal pressure or approach against time, or steady sliding, with its speeds in increasing order.
    title : str
        Title of the results. It names the default folder, ``results/`` and the title.
    boundary, tolerance, times, fields, missing, edge, grid_error, adhesion, numerics
        As in :func:`roughvisc.simulate`.
    observe, audit : mapping, optional
        The tables of a study file: quantities to add to the result, such as ``{"leakage": {"viscosity": "2 mPa s"}}``,
        and properties for :func:`roughvisc.audit`.

    Attributes
    ----------
    tables : mapping
        The tables of the study file in SI, with absolute paths and the content of CSV files.
    origin : Path or None
        The study file.
    varied : mapping
        Values that a sweep or :func:`vary` set: dotted key -> value in SI, or the name of an object.
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
    heights : xarray.DataArray or None
        Heights of the file that the surface names, if they come from Python. [m]
    function : Body or None
        Body with a creep function, for which the case has a series.

    Raises
    ------
    InputError
        If an argument is invalid, or cannot be stated in a study file: a kernel of your own, and a creep function in a
        pair or in steady sliding.

    See Also
    --------
    roughvisc.run, roughvisc.sweep, roughvisc.plan, roughvisc.trade, roughvisc.budget, roughvisc.audit

    Examples
    --------
    >>> import roughvisc as rv
    >>> ball = rv.sphere(radius=1e-3, size=2e-4, shape=45)
    >>> case = rv.Case(ball, rv.zener(3e6, 1e6, 1e5), rv.Program().load(1e-4, over=0).hold(0.5), tolerance=1e-2)
    >>> case
    Case 'untitled', sphere on zener; Program: load to 100 µN at once, hold 500 ms
    >>> case.key == rv.vary(case, {"tolerance": "1 %"}).key
    True
    """

    tables: Mapping[str, Any]
    origin: Path | None
    varied: Mapping[str, Any]
    late_times: tuple[float, ...] = field(compare=False)
    title: str = field(compare=False)
    body: Body = field(compare=False)
    experiment: Experiment = field(compare=False)
    settings: Settings = field(compare=False)
    heights: xr.DataArray | None = field(compare=False)
    function: Body | None = field(compare=False)

    def __init__(
        self,
        surface: xr.DataArray,
        material: Material | Body,
        program: Program | SteadySliding,
        *,
        title: str = "untitled",
        boundary: Boundary = Settings.boundary,
        tolerance: float = Settings.tolerance,
        times: int | Sequence[float | str] | str | None = Settings.times,
        fields: Sequence[str] | str = Settings.fields,
        missing: Missing = Settings.missing,
        edge: Edge = Settings.edge,
        grid_error: bool | Literal["auto"] = Settings.grid_error,
        adhesion: Adhesion | None = None,
        numerics: Numerics = Numerics(),
        observe: Mapping[str, Any] | None = None,
        audit: Mapping[str, Any] | None = None,
    ) -> None:
        if not isinstance(numerics, Numerics):
            raise InputError(key="numerics", found=numerics, expected="rv.Numerics(...)")
        settings = Settings(
            boundary=boundary,
            tolerance=tolerance,
            times=times,
            fields=fields,
            missing=missing,
            edge=edge,
            grid_error=grid_error,
            adhesion=adhesion,
            **vars(numerics),
        )
        further = {"title": title, "observe": observe, "audit": audit}
        tables, heights = tables_of(surface, material, program, settings, **further)
        try:
            made = _case_of(tables, None, heights=heights)
        except InputError as error:
            raise as_written(error, TABLE_OF) from error
        function = material if made.tables["material"]["model"] == creep_series.__name__ else None
        vars(self).update(vars(made.with_fields(function=function)))

    def __getstate__(self) -> dict[str, Any]:
        """Return the state for pickle, without a creep function."""
        return vars(self) | {"function": None}

    def with_fields(self, **changes: Any) -> Case:
        """Return the case with other values of some attributes, which are not checked."""
        return _made(
            {attribute.name: getattr(self, attribute.name) for attribute in dataclasses.fields(self)} | changes
        )

    def __repr__(self) -> str:
        """Return title, surface, material, experiment and varied values in one line."""
        name = Path(self.surface["file"]).name if "file" in self.surface else self.surface["generate"]
        parts = [f"{self.title!r}, {name} on {self.tables['material']['model']}", repr(self.experiment)]
        parts += [f"{key} = {value_text(key, value)}" for key, value in self.varied.items()]
        return f"Case {'; '.join(parts)}"

    def _repr_html_(self) -> str:
        """Return the case as a table, for a notebook."""
        named = ("title", "surface", "material", "program", "friction")
        others = {name: table for name, table in self.tables.items() if name not in named}
        rows = {"surface": self.surface, "material": self.tables["material"], "experiment": repr(self.experiment)}
        rows |= others | {"key": self.key}
        if self.varied:
            rows["varied"] = ", ".join(f"{key} = {value_text(key, value)}" for key, value in self.varied.items())
        return case_html(f"Case {self.title!r}", rows)

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
        factor = shift_factor(self.tables["material"])
        law = self.material.thermal
        is_measured = "temperatures" in self.tables["material"] and isinstance(law, ThermalLaw)
        return factor * law.shift(law.temperature) if is_measured else factor

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

        The key is a digest of the checksum of the heights or of the scan with its steps, the series of the body, the
        segments of the program, the settings, and :data:`roughvisc.version.NUMERICS_REVISION`. It does not depend on
        how these are written. The title, the paths, and the tables ``[observe]`` and ``[audit]`` do not count.
        """
        stated = [
            surface_identity(self.surface, self.checksums),
            body_identity(self.body),
            experiment_identity(self.experiment, area_of(self.surface, self.heights)),
            settings_identity(self.settings),
            NUMERICS_REVISION,
        ]
        return digest(stated)[:16]

    def height(self) -> xr.DataArray:
        """Return the conditioned heights of the surface, peaks up. [m]

        Raises
        ------
        InputError
            If the scan cannot be read, or its conditioning or its recipe is impossible.
        RoughviscError
            If a file has changed since the key was computed.
        """
        from roughvisc.experiment.memory_limit import require_surface  # slow to import

        before = self.checksums
        source = str(self.origin or "case")
        try:
            if "shape" in self.surface:
                require_surface(self.surface["shape"])
            height = surface_height(self.surface, self.heights)
            is_changed = checksums_of(self.surface) != before
        except InputError as error:
            raise error.prefixed(source) from error
        if is_changed:
            changed = f"{self.surface.get('file', 'the second face')}: was changed after the study was read"
            raise RoughviscError(f"{source}: surface: {changed}: run the study again", transient=True)
        return height

    def to_json(self, folder: Path | None = None) -> str:
        """Return the case as JSON; :meth:`from_json` makes a case with the same key from it.

        Parameters
        ----------
        folder : Path, optional
            Folder to which the paths of files are relative. Default: the paths are absolute.
        """
        stated = dict(self.tables)
        if self.varied:
            stated["varied"] = dict(self.varied)
        if self.origin:
            stated["origin"] = str(self.origin.absolute())
        return json.dumps(_with_paths(stated, partial(_relative, folder.absolute())) if folder else stated)

    @classmethod
    def from_json(cls, text: str, folder: Path | None = None) -> Case:
        """Make a case from the JSON of :meth:`to_json`, which is also the attribute ``case`` of a result.

        Parameters
        ----------
        text : str
            The JSON.
        folder : Path, optional
            Folder of the result, to which paths are relative.
        """
        try:
            data = dict(json.loads(text))
        except (TypeError, ValueError, RecursionError) as error:
            raise InputError(f"not a case written by to_json: {error}") from error
        if folder:
            data = _with_paths(data, lambda path: os.path.normpath(folder.absolute() / path))
        origin = data.pop("origin", None)
        varied = data.pop("varied", {})
        return _case_of(data, origin and Path(origin)).with_fields(varied=varied)

    def stored(self, folder: Path) -> Case:
        """Return the case with its heights in a file of a folder, which is written unless it exists."""
        if self.heights is None or Path(self.surface["file"]).is_absolute():
            return self
        written = str(write_heights(self.heights, folder))
        return self.with_fields(tables={**self.tables, "surface": {**self.surface, "file": written}})

    def to_toml(self, path: str | Path) -> Path:
        """Write the study file of the case; heights from Python are written to a NetCDF file next to it.

        Parameters
        ----------
        path : path
            The study file, such as ``"hold.toml"``. An existing file is replaced.

        Returns
        -------
        Path
            The study file. :func:`read_study` reads a case with the same key from it.

        Raises
        ------
        InputError
            If the file cannot be written.

        See Also
        --------
        roughvisc.read_study
        """
        path = path_of(path, "path", "a study file").expanduser()
        if path.suffix.lower() != ".toml":
            raise InputError(key="path", found=str(path), expected="a name that ends in .toml")
        with atomic_write(path) as temporary:  # checks the folder before the heights are written
            stated = json.loads(self.stored(path.absolute().parent).to_json(path.parent))
            temporary.write_text(study_text(stated), encoding="utf-8")
        return path


def _made(values: Mapping[str, Any]) -> Case:
    """Return the case of the values of its attributes."""
    case = object.__new__(Case)
    vars(case).update(values)
    return case


def _with_paths(stated: Any, change: Callable[[str], str], key: str = "") -> Any:
    """Return tables in which the paths of files are changed."""
    if isinstance(stated, Mapping):
        return {name: _with_paths(inner, change, name) for name, inner in stated.items()}
    is_path = key == "origin" or key.rpartition(".")[2] == "file"
    return change(stated) if is_path and isinstance(stated, str) else stated


def _relative(folder: Path, path: str) -> str:
    """Return a path relative to a folder; the name of a file on another drive."""
    if not os.path.isabs(path):
        return path
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:
        return Path(path).name


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

    See Also
    --------
    roughvisc.read_cases, roughvisc.Case

    Examples
    --------
    >>> import tempfile
    >>> import roughvisc as rv
    >>> ball, press = rv.sphere(radius=1e-3, size=2e-4, shape=15), rv.Program().load(1e-5, over="1 s")
    >>> case = rv.Case(ball, rv.zener(3e6, 1e6, 1e5), press, tolerance=1e-2, times=3)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     again = rv.read_study(case.to_toml(f"{folder}/ball.toml"))
    >>> again.key == case.key
    True
    """
    cases = read_cases(path)
    if len(cases) > 1 or cases[0].varied:
        found = f"{len(cases)} cases"
        expected = "one; read_cases() reads them all"
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

    In a sweep over programs a case leaves out the times of ``keep.times`` after the end of its program.

    Returns
    -------
    list of Case
        In the order of the lists, the last key varying fastest.

    Raises
    ------
    InputError
        As :func:`read_study` does, for the first case that is wrong; or if a time is after the end of every program.

    See Also
    --------
    roughvisc.read_study, roughvisc.vary, roughvisc.sweep

    Examples
    --------
    >>> import tempfile
    >>> import roughvisc as rv
    >>> ball, press = rv.sphere(radius=1e-3, size=2e-4, shape=15), rv.Program().load(1e-5, over="1 s")
    >>> case = rv.Case(ball, rv.zener(3e6, 1e6, 1e5), press, tolerance=1e-2, times=3)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     study = case.to_toml(f"{folder}/ball.toml")
    ...     with study.open("a") as file:
    ...         _ = file.write('[sweep]\\n"program.0.load" = ["5 uN", "10 uN"]\\n')
    ...     cases = rv.read_cases(study)
    >>> [one.varied for one in cases]
    [{'program.0.load': 5e-06}, {'program.0.load': 1e-05}]
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
    try:
        _refuse_late(cases, "keep.times")
    except InputError as error:
        raise error.prefixed(str(path)) from error
    return cases


def case_given(case: Any, key: str = "case") -> Case:
    """Return a case, or the case of the study file at a path; refuse anything else."""
    if isinstance(case, Case):
        return case
    if isinstance(case, str | PathLike):
        return read_study(case)
    raise InputError(key=key, found=case, expected="a Case, such as rv.read_study(...), or the path of a study file")


def cases_given(cases: Any) -> Sequence[Case]:
    """Return a list of cases, a single case as a list, or the cases of a study file; refuse anything else."""
    if isinstance(cases, Case):
        return [cases]
    if isinstance(cases, str | PathLike):
        return read_cases(cases)
    if not isinstance(cases, Sequence) or not cases:
        expected = "a list of at least one case, such as rv.read_cases(...), or the path of a study file"
        raise InputError(key="cases", found=cases, expected=expected)
    for number, case in enumerate(cases):
        if not isinstance(case, Case):
            raise InputError(key=f"cases[{number}]", found=case, expected="a Case, such as rv.read_cases(...) lists")
    return cases


def vary(case: Case, changes: Mapping[str, Any], *, zip: bool = False) -> Any:
    """Return a case with some of its values changed, or the cases of lists of values, as ``[sweep]`` lists them.

    Parameters
    ----------
    case : Case or path
        A case, or its study file.
    changes : mapping
        Argument of :class:`Case`, or dotted key of a study file -> value, list of values, or dictionary of name ->
        value: ``{"tolerance": [1e-2, 1e-3], "program": {"ramp": ramp, "hold": hold}, "material.poisson": 0.45}``. A
        tuple or an array is one value, and so is a list of numbers or texts for a key that takes one, such as
        ``times``, ``fields`` and ``surface.shape``. None removes a key. Values of ``surface``, ``material`` and
        ``program`` are objects of Python or tables of a study file. A name is the value of the varied parameter in
        results.
    zip : bool
        Combine the lists entry by entry. Default: their product, the last one varying fastest.

    Returns
    -------
    Case or list of Case
        A list if any value is a list or a dictionary of names. A case in this list omits the times after the end
        of its program.

    Raises
    ------
    InputError
        If a key does not exist or a value is refused; if a list is empty, names are equal, or the lists for `zip` have
        different lengths. The key is the argument as in `changes`.

    See Also
    --------
    roughvisc.sweep

    Examples
    --------
    >>> import roughvisc as rv
    >>> press = rv.Program().load(1e-4, over=0)
    >>> case = rv.Case(rv.sphere(1e-3, 2e-4, 45), rv.zener(3e6, 1e6, 1e5), press)
    >>> programs = {"press": press, "hold": press.hold("1 s")}
    >>> [one.varied for one in rv.vary(case, {"program": programs, "tolerance": 1e-2})]
    [{'program': 'press', 'tolerance': 0.01}, {'program': 'hold', 'tolerance': 0.01}]
    """
    case = case_given(case)
    choices = {key: _choices(key, value) for key, value in a_table("changes", changes).items()}
    lengths = {key: len(options) for key, options in choices.items() if options is not None}
    if not lengths:
        return changed(case, changes)
    if zip and len(set(lengths.values())) > 1:
        raise InputError(key="changes", found=lengths, expected="lists of one length")
    if (count := max(lengths.values()) if zip else math.prod(lengths.values())) > MOST_CASES:
        raise InputError(key="changes", found=f"{count} cases", expected=f"at most {MOST_CASES}")
    lists = [options or [("", changes[key])] * (count if zip else 1) for key, options in choices.items()]
    chosen = builtins.zip(*lists, strict=True) if zip else itertools.product(*lists)
    cases = []
    for values in chosen:
        change = {key: value for key, (_, value) in builtins.zip(choices, values, strict=True)}
        names = {key: name for key, (name, _) in builtins.zip(choices, values, strict=True) if name}
        cases.append(changed(case, change, names=names, leaves_out=True))
    _refuse_late(cases, next(filter(changes.__contains__, ("times", "keep.times")), "times"))
    return cases


def _choices(key: str, value: Any) -> list[tuple[str, Any]] | None:
    """Return the names and values to choose from; None for a single value."""
    if isinstance(value, Mapping):
        parts = list(value.values())
        of_objects = key in _OBJECTS and all(isinstance(choice, Mapping) or _is_object(key, choice) for choice in parts)
        if not value or not (of_objects or key.rpartition(".")[2] in TABLE_OF):
            return None
        return [(str(name), choice) for name, choice in value.items()]
    if not isinstance(value, list):
        return None
    several = [isinstance(choice, list | tuple) or _is_object(key, choice) for choice in value]
    if key.rpartition(".")[2] in _LISTS and not (value and all(several)):
        return None
    if not value:
        raise InputError(key=key, found=value, expected="at least one value; a tuple is one value")
    names = ["" for _ in value]
    if key in _OBJECTS and all(_is_object(key, choice) for choice in value):
        names = [str(place) if key == "surface" else short_repr(choice) for place, choice in enumerate(value)]
        for name, count in Counter(names).items():
            if count > 1:
                raise InputError(key=key, found=name, expected=f"different names, not {count} equal ones: a dictionary")
    return list(builtins.zip(names, value, strict=True))


def _is_object(key: str, value: Any) -> bool:
    """Return whether a value of a changed argument is an object of Python."""
    return key in _OBJECTS and not isinstance(value, Mapping | str | list | tuple | None)


def changed(
    case: Case,
    changes: Mapping[str, Any],
    *,
    names: Mapping[str, str] = MappingProxyType({}),
    leaves_out: bool = False,
) -> Case:
    """Return a case with some values changed; a list is one value here.

    Parameters
    ----------
    case, changes
        As in :func:`vary`.
    names : mapping
        Argument -> name of its value.
    leaves_out : bool
        Whether to leave out times after the end of a changed program, instead of refusing them.
    """
    heights = case.heights
    function = case.function
    placed: dict[str, Any] = {}
    written: dict[str, str] = {}
    refuse_unknown("", {key: value for key, value in changes.items() if "." not in key}, (*TABLES, *TABLE_OF))
    for key, value in changes.items():
        if key == "surface" and _is_object(key, value):
            placed["surface"], heights = surface_table(value)
        elif key == "program" and _is_object(key, value):
            placed |= {"program": None, "friction": None} | experiment_table(experiment_of(value))
        elif key == "adhesion" and _is_object(key, value):
            placed["adhesion"] = adhesion_table(value)
        elif key == "material" and _is_object(key, value):
            function = Body(value) if isinstance(value, Prony | Creep) else value
        else:
            dotted_key = f"{TABLE_OF[key]}.{key}" if key in TABLE_OF else key
            function = None if dotted_key.partition(".")[0] == "material" else function
            placed[dotted_key] = _plain_value(value)
            written[dotted_key] = key
    folder = case.origin and case.origin.parent
    try:
        made = _case_of(case.tables, case.origin, folder, placed, leaves_out=leaves_out, heights=heights)
        if function is not None:
            table = material_table(function, made.experiment, made.settings)
            late = made.late_times
            made = _case_of(made.tables, case.origin, folder, {"material": table}, heights=heights)
            is_series = table["model"] == creep_series.__name__
            made = made.with_fields(late_times=late, function=function if is_series else None)
    except InputError as error:
        stated = as_written(error, {key: key.rpartition(".")[0] for key, own in written.items() if own != key})
        raise (stated.prefixed(str(case.origin)) if case.origin else stated) from error
    varied = {}
    for key in changes:
        stated = f"{TABLE_OF[key]}.{key}" if key in TABLE_OF else key
        varied[key] = names.get(key) or value_at(made.tables, stated, changes[key])
        if _is_object(key, changes[key]):
            varied[key] = names.get(key) or short_repr(changes[key])
    return made.with_fields(varied={**case.varied, **varied})


def _plain_value(value: Any) -> Any:
    """Return a value as a study file states it."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return list(value) if isinstance(value, tuple) else value


def _refuse_late(cases: Sequence[Case], key: str) -> None:
    """Refuse a kept time after the end of every program."""
    if always_late := set.intersection(*(set(case.late_times) for case in cases)):
        expected = "times up to the end of the longest program"
        raise InputError(key=key, found=max(always_late), expected=expected)


def as_written(error: InputError, tables: Mapping[str, str]) -> InputError:
    """Return an error about a key of a table as an error about the argument that the caller wrote.

    Parameters
    ----------
    error : InputError
        The error.
    tables : mapping
        Last part of a key, or the whole key -> table, which the caller has not written.
    """
    table, _, rest = error.key.partition(".")
    name = re.split(r"[.\[]", rest)[0]
    if table not in (tables.get(name), tables.get(f"{table}.{name}")) or not rest:
        return error
    message = str(error)
    start = message.find(error.key)
    message = message[:start] + message[start + len(table) + 1 :] if start >= 0 else f"{rest}: {message}"
    return type(error)(message, key=rest, found=error.found, expected=error.expected, transient=error.transient)


def _case_of(
    data: Mapping[str, Any],
    origin: Path | None,
    folder: Path | None = None,
    changes: Mapping[str, Any] = MappingProxyType({}),
    drawn: Mapping[str, int] = MappingProxyType({}),
    *,
    leaves_out: bool = False,
    heights: xr.DataArray | None = None,
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
    heights : xarray.DataArray, optional
        Heights of the file that the surface names, which need not exist. [m]
    """
    for key, value in changes.items():
        data = place(data, key, value)
    named, surface = split(a_table("surface", data.get("surface", {})), "file")
    if heights is None or digest_in(named.get("file", "")) != digest_in(file_name(heights)):
        named = {}
        surface = data.get("surface")
        heights = None
    try:
        tables = with_files({**data, "surface": surface} if heights is not None else data, folder)
        tables["surface"] |= named
        late: tuple[float, ...] = ()
        if leaves_out and any(key.partition(".")[0] == "program" for key in changes):
            tables, late = without_late_times(tables)
        about = {
            "tables": tables,
            "origin": origin,
            "varied": {},
            "late_times": late,
            "heights": heights,
            "function": None,
        }
        case = _made(about | parts_of(tables))
    except InputError as error:
        named = error
        for key in (error.key, error.key.rpartition(".")[0]):
            if key.startswith("material") and value_at(data, f"{key}.file", None) is not None:
                # its columns have replaced its name in the table
                named = with_line(error, in_si(value_at(data, key, {}), key, data, folder))
                break
        text = value_at(data, error.key, None)
        if text == error.found or in_si(text, error.key, data, folder) != error.found:
            raise named from error
        message = str(named).replace(repr(error.found), repr(text))
        raise type(error)(message, key=error.key, found=text, expected=error.expected) from error
    varied: dict[str, Any] = {}
    for key, value in changes.items():
        if not drawn or key != SURROGATE:
            varied[key] = value_at(tables, key, value)
    return case.with_fields(varied=varied | drawn)


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
