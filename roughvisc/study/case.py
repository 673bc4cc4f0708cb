"""Cases: read from study files, varied, and identified by a key."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cache, cached_property
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roughvisc.arguments import split
from roughvisc.errors import InputError, RoughviscError, short_repr
from roughvisc.study import study_file
from roughvisc.study.si_tables import in_si, si_tables
from roughvisc.study.sweep_table import REALISATION, SURROGATE, place, sweep_changes, value_at
from roughvisc.topography.conditioning import STEPS
from roughvisc.topography.readers import sha256
from roughvisc.topography.scans import check_surface, is_card, measured_file, read_card, read_toml, surface_height

if TYPE_CHECKING:
    import xarray as xr

    from roughvisc.experiment.base import Experiment
    from roughvisc.mechanics.body import Body
    from roughvisc.mechanics.materials.creep import Material
    from roughvisc.mechanics.program import Program
    from roughvisc.settings import Settings

__all__ = ["Case", "read_cases", "read_study", "vary"]

#: Raised with each change of the numbers that an unchanged case gives.
NUMERICS_REVISION = 37


@cache
def program() -> str:
    """Return name and version of this program, as the source of results."""
    return f"roughvisc {metadata.version('roughvisc')}"


def program_version() -> str:
    """Return name and version of this program, and the revision of its numbers.

    Examples
    --------
    >>> program_version()  # doctest: +SKIP
    'roughvisc 0.1.dev493+g9bdb14a83 (numerics 15)'
    """
    return f"{program()} (numerics {NUMERICS_REVISION})"


@dataclass(frozen=True)
class Case:
    """One simulation: a surface, a material, a program or a friction curve, and the settings of the solve.

    :func:`read_study`, :func:`read_cases` and :meth:`from_json` make and check it; :func:`vary` changes it.

    Parameters
    ----------
    tables : mapping
        The tables of the study file in SI, with absolute paths and the content of CSV files.
    origin : Path or None
        The study file.
    varied : mapping
        Values that a sweep or :func:`vary` set: dotted key -> value in SI.
    written : mapping
        Quantities among them as written in the study file: dotted key -> text with a unit.
    """

    tables: Mapping[str, Any]
    origin: Path | None = None
    varied: Mapping[str, Any] = field(default_factory=dict)
    written: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Return title, surface, material and experiment in one line, and what a sweep has set."""
        surface = self.surface
        name = Path(surface["file"]).name if "file" in surface else surface.get("generate", "")
        parts = [f"{self.title!r}, {name} on {self.tables['material'].get('model')}", repr(self._experiment)]
        parts += [f"{key} = {self.written.get(key, value)}" for key, value in self.varied.items()]
        return f"Case {'; '.join(parts)}"

    @property
    def title(self) -> str:
        """Title of the study."""
        return self.tables.get("title", "untitled")

    @property
    def surface(self) -> Mapping[str, Any]:
        """Table ``[surface]``."""
        return self.tables["surface"]

    @cached_property
    def key(self) -> str:
        """Sixteen hexadecimal digits that identify everything that determines the numbers.

        They are a digest of the tables in SI, of the checksums of the scans, and of :data:`NUMERICS_REVISION`. The
        title, the paths, and the tables ``[observe]`` and ``[audit]`` do not count.
        """
        values = {one.name: (getattr(self.settings, one.name), one.default) for one in fields(self.settings)}
        settings = {name: value for name, (value, default) in values.items() if value != default}
        settings["fields"] = sorted(self.settings.fields)
        tables = {name: self.tables.get(name) for name in ("material", "program", "friction")}
        surface = [
            {key: value for key, value in face.items() if key not in ("file", "second") and value is not False}
            for face in self._faces
        ]
        return _digest([tables, surface, settings, self.precision, self._checksums, NUMERICS_REVISION])[:16]

    @property
    def surface_sha256(self) -> str:
        """SHA-256 of the scan's file; of a generated surface: of its recipe."""
        return self._checksums[0][0]

    @property
    def _faces(self) -> list[Mapping[str, Any]]:
        return [self.surface, *([self.surface["second"]] if "second" in self.surface else [])]

    @cached_property
    def _checksums(self) -> list[tuple[str, str]]:
        """Checksums of the scan and of the surface card of each face."""
        return [_checksums(face) for face in self._faces]

    def height(self) -> xr.DataArray:
        """Return the heights of the surface as conditioned, peaks up. [m]

        Raises
        ------
        InputError
            If the scan cannot be read, or its conditioning or its recipe is impossible.
        RoughviscError
            If a file has changed since the key was computed.
        """
        from roughvisc.experiment.resources import require_surface  # slow to import

        before = self._checksums
        try:
            if self.made_shape is not None:
                require_surface(self.made_shape)
            height = surface_height(self.surface)
        except InputError as error:
            self._refuse_changed(before, error)
            raise error.prefixed(str(self.origin) if self.origin else "case") from error
        self._refuse_changed(before)
        return height

    def _refuse_changed(self, before: list[tuple[str, str]], cause: InputError | None = None) -> None:
        try:
            now = [_checksums(face) for face in self._faces]
        except InputError:  # gone
            now = []
        if now != before:
            file = self.surface.get("file", "the second face")
            where = f"{self.origin}: surface" if self.origin else "surface"
            expected = "the heights that the case's key stands for; run the study again for the new ones"
            message = f"{where}: {file}: was changed after the study was read: expected {expected}"
            raise RoughviscError(message, transient=True) from cause

    @property
    def made_shape(self) -> tuple[int, int] | None:
        """Cells of a surface that a recipe makes, before it is made; None of any other."""
        shape = self.surface.get("shape")
        return None if shape is None else study_file.cells(shape)

    def material(self) -> Material:
        """Return the material."""
        return self.body().material

    def materials(self) -> list[Material]:
        """Return the materials of both bodies of a pair, otherwise the material."""
        table = self.tables["material"]
        parts = ("a", "b") if table["model"] == "pair" else ()
        return [study_file.body_of(table[part]).material for part in parts] or [self.material()]

    def body(self) -> Body:
        """Return the body: a half-space of the material, a sheet, or layers."""
        return self._body

    @cached_property
    def _body(self) -> Body:
        return study_file.body_of(self.tables["material"])  # a table of measurements takes a fit

    @property
    def shift_factor(self) -> float:
        """Factor of all times of the material at its temperature. [-]"""
        return study_file.shift_factor(self.tables["material"])

    def program(self) -> Program:
        """Return the loading program.

        Raises
        ------
        InputError
            If the study states friction, which has no program.
        """
        if "program" not in self.tables:
            error = InputError(key="friction", found="steady sliding", expected="[[program]] tables")
            raise error.prefixed(str(self.origin)) if self.origin else error
        return study_file.program_of(self.tables["program"])

    def experiment(self) -> Experiment:
        """Return the experiment: a loading program or steady sliding."""
        return self._experiment

    @cached_property
    def _experiment(self) -> Experiment:
        return study_file.experiment_of(self.tables)

    @cached_property
    def settings(self) -> Settings:
        """Settings of the solve, with the boundary that ``auto`` resolves to."""
        return study_file.settings_of(self.tables, self._experiment)

    def late_times(self) -> tuple[float, ...]:
        """Return the listed times after the end of the program, which are not kept. [s]"""
        return study_file.late_times(study_file.stated_settings(self.tables), self._experiment)

    @property
    def precision(self) -> float | None:
        """Relative precision of the fields in the file; None if they are exact."""
        return study_file.precision_of(self.tables)

    def observed(self) -> dict[str, dict[str, Any]]:
        """Return the arguments of each observable that the study requests."""
        return study_file.observed(self.tables, self.settings)

    def audit_inputs(self) -> dict[str, Any]:
        """Return the quantities that the study states for an audit, in SI."""
        return study_file.audit_inputs(self.tables).stated()

    def at(self, done: float, end: float) -> str:
        """Return the progress of a run in words."""
        return self._experiment.progress(done, end)

    def check(self) -> None:
        """Check everything that can be checked without the heights.

        Raises
        ------
        InputError
            For the first problem.
        """
        if not isinstance(self.title, str) or not self.title.strip():
            raise InputError(key="title", found=self.tables["title"], expected="a text")
        check_surface(self.surface)
        _ = self._body, self._experiment, self.settings, self.precision
        self.observed()
        self.audit_inputs()

    def to_json(self) -> str:
        """Return the case as JSON, from which :meth:`from_json` makes it again, with the same key."""
        stated = dict(self.tables)
        if self.varied:
            stated["varied"] = dict(self.varied)
        if self.written:
            stated["written"] = dict(self.written)
        if self.origin is not None:
            stated["origin"] = str(self.origin.absolute())
        return json.dumps(stated)

    @classmethod
    def of_result(cls, dataset: xr.Dataset) -> Case:
        """Return the case of a result, as its attribute ``case`` states it."""
        if "case" not in dataset.attrs:
            raise InputError("the result does not record its case: expected a result of a study", key="case")
        return cls.from_json(dataset.attrs["case"])

    @classmethod
    def from_json(cls, text: str) -> Case:
        """Make a case from :meth:`to_json`, as the attribute ``case`` of a result contains it."""
        try:
            data = json.loads(text)
            if not isinstance(data, dict):
                raise InputError("found no JSON object")
        except (ValueError, RecursionError) as error:
            raise InputError(f"not a case written by to_json: {error}") from error
        origin, varied, written = (data.pop(name, None) for name in ("origin", "varied", "written"))
        case = cls(si_tables(data, None), Path(origin) if origin else None, varied or {}, written or {})
        case.check()
        return case


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
        If the file cannot be read, if anything in it is unknown, missing, impossible or in a wrong unit, or if it
        contains a sweep: see :func:`read_cases`.
    """
    cases = read_cases(path)
    if len(cases) > 1 or cases[0].varied:
        raise InputError(f"{path}: sweep: found {len(cases)} cases: expected one; read_cases() reads them all")
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

    Returns
    -------
    list of Case
        In the order of the lists, the last key varying fastest.

    Raises
    ------
    InputError
        As :func:`read_study` does, for the first case that is wrong.
    """
    path = Path(path)
    if not path.exists():
        raise InputError(f"{path}: does not exist: expected a study file (TOML)")
    data = read_toml(path, "valid TOML")
    try:
        changes = sweep_changes(data.pop("sweep", {}), data, path.parent)
    except InputError as error:
        raise error.prefixed(str(path)) from error
    cases = []
    for number, (change, drawn) in enumerate(changes):
        varied = change if drawn is None else change | {REALISATION: drawn}
        try:
            for key in change:
                if key.partition(".")[0] in ("observe", "audit"):
                    expected = "a value in its own table, since it changes no result"
                    raise InputError(key=key, found=change[key], expected=expected)
            case = _changed(data, change, path)
        except InputError as error:
            values = ", ".join(f"{key} = {short_repr(value)}" for key, value in varied.items())
            raise error.prefixed(f"{path}: case {number} ({values})" if varied else str(path)) from error
        cases.append(case if drawn is None else as_realisation(case, drawn))
    return cases


def as_realisation(case: Case, number: int) -> Case:
    """Return the case with the number of its realisation among the values varied; the key does not change."""
    varied = {key: value for key, value in case.varied.items() if key != SURROGATE}
    return replace(case, varied={**varied, REALISATION: number})


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
    try:
        changed = _changed(case.tables, changes, case.origin)
    except InputError as error:
        raise error.prefixed(str(case.origin) if case.origin else "case") from error
    written = {key: text for key, text in case.written.items() if key not in changes}
    return replace(changed, varied={**case.varied, **changed.varied}, written={**written, **changed.written})


def _changed(data: Mapping[str, Any], changes: Mapping[str, Any], origin: Path | None) -> Case:
    """Return the case of some tables with values changed, checked."""
    for key, value in changes.items():
        data = place(data, key, value)
    tables = si_tables(data, origin.parent if origin else None)
    varied = {key: value_at(tables, key, value) for key, value in changes.items()}
    written = {k: v.strip() for k, v in changes.items() if isinstance(v, str) and isinstance(varied[k], float)}
    case = Case(tables, origin, varied, written)
    try:
        case.check()
    except InputError as error:
        raise _as_stated(error, data) from error
    return case


def _as_stated(error: InputError, data: Mapping[str, Any]) -> InputError:
    """Return an error about tables in SI with the text of the study and the CSV file of the table."""
    table, _, _ = error.key.rpartition(".")
    for where in (error.key, table):
        file = value_at(data, f"{where}.file", None)
        if where.partition(".")[0] == "material" and file is not None:
            return error.prefixed(str(file))
    stated = value_at(data, error.key, None)
    if stated == error.found or in_si(stated, error.key, data) != error.found:
        return error
    message = str(error).replace(repr(error.found), repr(stated))
    return type(error)(message, key=error.key, found=stated, expected=error.expected)


def _checksums(face: Mapping[str, Any]) -> tuple[str, str]:
    """Return the checksums of the scan or recipe of a face and of its surface card.

    Title and provenance of a card do not count.
    """
    if "file" not in face:
        steps = ("second", "missing", "flip", "offset", *STEPS)
        return _digest({key: value for key, value in face.items() if key not in steps}), ""
    path, card = Path(face["file"]), {}
    if is_card(path, face.get("format")):
        card = split(read_card(path)[1], "file")[1]
    scan = measured_file(path, face.get("format"))
    try:
        return (_digest(card) if scan is None else sha256(scan)), (_digest(card) if card else "")
    except OSError as error:
        message = f"surface.file: {path}: cannot be read: {error.strerror or error}"
        raise InputError(message, key="surface.file", found=str(path), expected="a scan file") from error


def _digest(stated: Any) -> str:
    """Return the SHA-256 of nested values, equal for numbers that are equal to 15 significant digits."""
    text = json.dumps(_rounded(stated), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def _rounded(value: Any) -> Any:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return f"{value + 0.0:.15g}"
    if isinstance(value, Mapping):
        return {key: _rounded(entry) for key, entry in value.items() if key != "note"}
    if isinstance(value, list | tuple):
        return [_rounded(entry) for entry in value]
    return value
