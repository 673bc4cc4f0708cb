"""Cases: read from study files, varied, and identified by what determines their numbers."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from textwrap import indent
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from roughvisc.errors import InputError, RoughviscError
from roughvisc.notebook import table
from roughvisc.study.statement.identity import identity
from roughvisc.study.statement.schema import Study
from roughvisc.study.statement.schema.keys import study_schema
from roughvisc.study.statement.variation import REALISATION, SURROGATE, expand, place, with_files, with_realisations
from roughvisc.topography.cards import read_toml
from roughvisc.units import shown

if TYPE_CHECKING:
    import xarray as xr

    from roughvisc.experiment.base import Experiment
    from roughvisc.mechanics.body import Body
    from roughvisc.mechanics.materials.creep import Material
    from roughvisc.mechanics.program import Program
    from roughvisc.settings import Settings


class Problems(InputError):
    """All problems of one case, one line each; `key` and `found` are those of the first."""

    def __init__(self, lines: Sequence[str], *, key: str = "", found: object = None) -> None:
        super().__init__("\n".join(lines), key=key, found=found)
        self.lines = list(lines)


def in_sweep(problem: str, where: Sequence[int], changes: Sequence[Mapping[str, Any]]) -> str:
    """The problem, and the first case that has it where not all do."""
    if len(where) == len(changes):
        return problem
    values = ", ".join(f"{key} = {shown(value)}" for key, value in changes[where[0]].items())
    head, *rows = problem.split("\n")
    return "\n".join([f"{head} (case {where[0]}: {values})", *rows])


def line(path: Path | None, key: str, problem: str) -> str:
    """One line: the file, the key, what is wrong."""
    return f"{path}: {key}: {problem}" if path else f"{key}: {problem}"


def report(path: Path | None, lines: Sequence[str]) -> str:
    """One message: a single line, or a line for each problem below the name of the file."""
    name = str(path) if path else "case"
    if len(lines) == 1:
        return f"{name}: {lines[0]}"
    return "\n".join([f"{name}: {len(lines)} problems", *(indent(one, "  ") for one in lines)])


__all__ = ["Case", "read_cases", "read_study", "study_schema", "vary"]


@dataclass(frozen=True)
class Case:
    """One simulation: a surface, a material, a program or a friction curve, and the settings of the solve.

    :func:`read_study`, :func:`read_cases` and :meth:`from_json` make and check it; :func:`vary` changes it.

    Parameters
    ----------
    settings : Study
        The tables of the study file, checked, in SI.
    origin : Path or None
        The study file from which it was read.
    varied : mapping
        Values that a sweep set for this case: dotted key -> value in SI.
    written : mapping
        Those that are quantities with a unit, as written in the study: dotted key -> text.
    """

    settings: Study
    origin: Path | None = None
    varied: Mapping[str, Any] = field(default_factory=dict)
    written: Mapping[str, str] = field(default_factory=dict)

    @property
    def title(self) -> str:
        """Title of the study."""
        return self.settings.title

    @property
    def key(self) -> str:
        """Sixteen hexadecimal digits that stand for all that determines the numbers, and for nothing else."""
        return self._identity[0]

    @property
    def surface_sha256(self) -> str:
        """SHA-256 of the scan's file; of a generated surface: of its recipe."""
        return self._identity[1]

    @cached_property
    def _identity(self) -> tuple[str, str]:
        return identity(self.settings)

    def height(self) -> xr.DataArray:
        """Heights of the surface as conditioned, peaks up. [m]

        Raises
        ------
        InputError
            If the scan cannot be read, or its conditioning or its recipe is impossible.
        RoughviscError
            If its files are no longer those that the key stands for.
        """
        from roughvisc.experiment.resources import require_surface  # slow to import

        _ = self._identity  # of the files as they are before they are read
        try:
            if self.made_shape is not None:
                require_surface(self.made_shape)
            height = self.settings.surface.height()
        except InputError as error:
            if self._changed():
                raise self._change() from error
            raise error.prefixed("surface" if self.origin is None else f"{self.origin}: surface") from error
        if self._changed():
            raise self._change()
        return height

    def _changed(self) -> bool:
        """Whether the files are no longer those that the key stands for."""
        try:
            return identity(self.settings) != self._identity
        except InputError:  # gone, or another file by now
            return True

    def _change(self) -> RoughviscError:
        named = getattr(self.settings.surface, "file", None) or "the second face"
        problem = f"{named}: was changed after the study was read: expected the heights that the case's key stands for"
        text = line(self.origin, "surface", f"{problem}; run the study again for the new ones")
        return RoughviscError(text, transient=True)

    @property
    def made_shape(self) -> tuple[int, int] | None:
        """Cells of a surface that a recipe makes, before it is made; None of any other."""
        shape = getattr(self.settings.surface, "shape", None)
        return None if shape is None else (int(shape[0]), int(shape[1]))

    def material(self) -> Material:
        """The material."""
        return self.body().material

    def body(self) -> Body:
        """What the surface is pressed on: a half-space of the material, or a sheet."""
        return self._body

    @cached_property
    def _body(self) -> Body:
        """Built once: a table of a material takes a fit."""
        return self.settings.material.body()

    def program(self) -> Program:
        """The loading program.

        Raises
        ------
        InputError
            If the case asks for friction, which has none.
        """
        try:
            return self.settings.loading()
        except InputError as error:
            raise (error.prefixed(str(self.origin)) if self.origin else error) from None

    def experiment(self) -> Experiment:
        """What is done with the surface."""
        return self.settings.experiment()

    def at(self, done: float, end: float) -> str:
        """How far a run is of how much, as one reads it."""
        return self.experiment().progress(done, end)

    def solving(self) -> Settings:
        """How it is computed and what is kept, as the solver takes it."""
        return self.settings.solving()

    def _repr_html_(self) -> str:
        stated = _dump(self.settings)
        surface = stated["surface"]
        rows = [
            ("key", _text_or_error(lambda: self.key)),
            ("study", self.origin.name if self.origin else ""),
            *((name, self.written.get(name) or str(value)) for name, value in self.varied.items()),
            ("surface", Path(surface["file"]).name if "file" in surface else str(surface.get("generate", ""))),
            ("material", _text_or_error(lambda: repr(self.material()))),
            _experiment(self.settings),
            *((name, str(value)) for name, value in stated.get("solve", {}).items()),
        ]
        return table(self.title or "untitled", [row for row in rows if row[1]])

    def __reduce__(self) -> tuple[Any, ...]:
        # the classes of the tables are made at run time, so a case travels to another process as its text
        return Case.from_json, (self.to_json(),)

    def to_json(self) -> str:
        """The case as JSON, whole: :meth:`from_json` gives it back, with the same key."""
        stated = _dump(self.settings)
        if self.varied:
            stated["varied"] = dict(self.varied)
        if self.written:
            stated["written"] = dict(self.written)
        if self.origin is not None:
            stated["origin"] = str(self.origin.absolute())
        return json.dumps(stated)

    @classmethod
    def from_json(cls, text: str) -> Case:
        """A case from :meth:`to_json`, as the attribute ``case`` of a result holds it."""
        try:
            data = json.loads(text)
            if not isinstance(data, dict):
                raise InputError("found no JSON object")
        except (ValueError, RecursionError) as error:
            raise InputError(f"not a case written by to_json: {error}") from error
        origin, varied, written = (data.pop(name, None) for name in ("origin", "varied", "written"))
        return cls(_checked(data, None, "case"), Path(origin) if origin else None, varied or {}, written or {})


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
        If the file cannot be read, if anything in it is unknown, missing, impossible or in a wrong unit (all problems
        are listed, one per line), or if it contains a sweep: see :func:`read_cases`.
    """
    cases = read_cases(path)
    if len(cases) > 1 or cases[0].varied:
        raise InputError(f"{path}: sweep: found {len(cases)} cases: expected one; read_cases() reads them all")
    return cases[0]


def read_cases(path: str | Path) -> list[Case]:
    """Read all cases of a study file: the product of the lists in ``[sweep]``, or the runs of ``[[sweep]]``.

    A table ``[[sweep]]`` contains lists of equal length, combined entry by entry; several tables give consecutive runs.
    ``realisations = 24`` in a table computes each of its cases for 24 realisations of the surface.
    A pattern such as ``"surface.file" = "scans/*.sur"`` stands for the list of matching files. Without a sweep there is
    one case.

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
        As :func:`read_study` does, for any of the cases.
    """
    path = Path(path)
    if not path.exists():
        raise InputError(f"{path}: does not exist: expected a study file (TOML)")
    data = read_toml(path, "valid TOML")

    try:
        changes = with_realisations(expand(with_files(data.pop("sweep", {}), path.parent)), data, path.parent)
        for key in dict.fromkeys(key for change, _ in changes for key in change):
            if key.startswith("observe"):
                found = "what is observed changes no result: expected one value, in [observe]"
                raise InputError(f"sweep: {key}: cannot be varied: {found}")
    except InputError as error:
        raise error.prefixed(str(path)) from error
    cases: list[Case] = []
    problems: dict[str, list[int]] = {}
    first: Problems | None = None
    for number, (change, drawn) in enumerate(changes):
        try:
            case = _varied(data, change, path)
        except Problems as error:
            first = first or error
            for problem in error.lines:
                problems.setdefault(problem, []).append(number)
        else:
            cases.append(case if drawn is None else as_realisation(case, drawn))
    if first is not None:
        told = [change if drawn is None else change | {REALISATION: drawn} for change, drawn in changes]
        message = report(path, [in_sweep(problem, where, told) for problem, where in problems.items()])
        raise InputError(message, key=first.key, found=first.found)
    return cases


def as_realisation(case: Case, number: int) -> Case:
    """The same case, which says of itself which realisation of its surface it is; its key stays."""
    varied = {key: value for key, value in case.varied.items() if key != SURROGATE}
    return replace(case, varied={**varied, REALISATION: number})


def vary(case: Case, changes: Mapping[str, Any]) -> Case:
    """Return a case with some of its values changed.

    Parameters
    ----------
    case : Case
    changes : mapping
        Dotted key -> value as in a study file: ``{"program.0.load": "2 N", "solve.tolerance": 1e-4}``.

    Returns
    -------
    Case

    Raises
    ------
    InputError
        If a key does not exist or a value is refused.
    """
    data = json.loads(case.to_json())
    for name in ("origin", "varied", "written"):
        data.pop(name, None)
    if "boundary" not in case.settings.solve.model_fields_set:  # another surface may have another one
        data["solve"].pop("boundary")
    try:
        changed = _varied(data, changes, case.origin)
    except Problems as error:
        raise InputError(report(case.origin, error.lines), key=error.key, found=error.found) from error
    written = {key: text for key, text in case.written.items() if key not in changes}
    return replace(changed, varied={**case.varied, **changed.varied}, written={**written, **changed.written})


def _varied(data: Mapping[str, Any], changes: Mapping[str, Any], origin: Path | None) -> Case:
    for key, value in changes.items():
        try:
            data = place(data, key, value)
        except InputError as error:
            raise Problems([f"{key}: {error}"], key=key, found=value) from error
    settings = _checked(data, origin.parent if origin else None)
    stated = _dump(settings)
    varied = {key: _at(stated, key, value) for key, value in changes.items()}
    written = {k: v.strip() for k, v in changes.items() if isinstance(v, str) and isinstance(varied[k], float)}
    return Case(settings, origin, varied, written)


def _checked(data: Mapping[str, Any], folder: Path | None, name: str = "") -> Study:
    try:
        return Study.model_validate(data, context={"folder": folder})
    except ValidationError as error:
        lines = [f"{'.'.join(map(str, e['loc'])) or 'study'}: {e['msg']}" for e in error.errors()]
        first = error.errors()[0]
        key = ".".join(map(str, first["loc"])) or "study"
        raise Problems([f"{name}: {one}" if name else one for one in lines], key=key, found=first["input"]) from None


def _text_or_error(what: Callable[[], str]) -> str:
    """A text, or why it cannot be had: a table that shows a case refuses none."""
    try:
        return what()
    except InputError as error:
        return str(error)


def _experiment(settings: Study) -> tuple[str, str]:
    """The table that states what is done, and that in words."""
    experiment = settings.experiment()
    words = _text_or_error(lambda: repr(experiment))
    return experiment.table, words.partition(": ")[2] or words


def _dump(settings: Study) -> dict[str, Any]:
    return settings.model_dump(mode="json", exclude_none=True, serialize_as_any=True)


def _at(stated: Any, key: str, otherwise: Any) -> Any:
    """Value at a dotted key, in SI as the checked study has it."""
    for part in key.split("."):
        if isinstance(stated, list):
            stated = stated[int(part)]
        elif part in stated:
            stated = stated[part]
        else:
            return otherwise
    return stated
