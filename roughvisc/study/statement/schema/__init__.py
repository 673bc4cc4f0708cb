"""The shape of a study file: what each table may hold. Imports pydantic, and nothing heavier until it must."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, ValidationInfo, model_validator

from roughvisc.errors import InputError
from roughvisc.mechanics.stepping.program import Program
from roughvisc.study.statement.curve import SteadySliding
from roughvisc.study.statement.schema.audit import AuditSection
from roughvisc.study.statement.schema.entries import Text, a_list, nullable
from roughvisc.study.statement.schema.friction import FrictionSection, refuse_beside_friction
from roughvisc.study.statement.schema.material import AnyMaterial
from roughvisc.study.statement.schema.meanings import with_meanings
from roughvisc.study.statement.schema.observe import ObserveSection
from roughvisc.study.statement.schema.program import AnySegment
from roughvisc.study.statement.schema.section import Section, refuse
from roughvisc.study.statement.schema.settings import KeepSection, SolveSection
from roughvisc.study.statement.schema.surface import AnySurface
from roughvisc.study.statement.settings import Settings
from roughvisc.units import unit_for

_SEGMENTS = "a list of [[program]] tables, at least one"


def _segments(value: Any, info: ValidationInfo) -> Any:
    """Segments, or none where friction is asked for; a study whose [friction] is wrong hears of that alone."""
    slides = info.data.get("friction", ...)
    if value is not None:
        if slides not in (None, ...):
            raise InputError("found beside [friction]: expected one of them: a study presses a surface or slides it")
        return tuple(a_list(value, _SEGMENTS) or a_list(None, _SEGMENTS))
    if slides is None:
        raise InputError(f"missing: expected {_SEGMENTS}, or a table [friction]")
    return value


class Study(Section):
    """One case as a study file states it, checked, in SI."""

    title: Text = "untitled"
    surface: AnySurface
    material: AnyMaterial
    friction: nullable(FrictionSection) = None
    program: Annotated[
        tuple[AnySegment, ...] | None,
        BeforeValidator(_segments),
        Field(description=_SEGMENTS, validate_default=True),
    ] = None
    solve: SolveSection = SolveSection()
    keep: KeepSection = KeepSection()
    observe: nullable(ObserveSection) = Field(None, description="a table")
    audit: nullable(AuditSection) = None

    def loading(self) -> Program:
        """The program as the solver takes it.

        Raises
        ------
        InputError
            If the study asks for friction.
        """
        if self.program is None:
            raise InputError("friction: found steady sliding, which has no program: expected [[program]] tables")
        program = Program()
        for segment in self.program:
            program = segment.extend(program)
        return program

    def experiment(self) -> Program | SteadySliding:
        """What is done with the surface: a program that presses it, or a curve of speeds at which it slides."""
        return self.loading() if self.friction is None else self.friction.curve()

    def at(self, now: float, end: float) -> str:
        """How far a run is of how much: of a program the time and its length [s], of a curve the speeds done."""
        if self.friction is not None:
            return self.friction.curve().at(now, end)
        unit = unit_for(end, "s")
        return f"t = {unit(now):.3g} of {unit.text(end)}"

    def solving(self) -> Settings:
        """How it is computed and what is kept, as the solver takes it."""
        times = None if self.keep.times == "all" else self.keep.times
        return Settings(**dict(self.solve), fields=self.keep.fields, times=times, missing=self.surface.missing)

    @model_validator(mode="after")
    def _check_consistency(self) -> Study:
        if self.friction is not None:
            refuse_beside_friction(self.solve, self.keep, self.surface.missing)
            return self
        end = self.loading().duration
        if isinstance(self.keep.times, tuple) and self.keep.times[-1] > end * (1 + 1e-12):
            late = self.keep.times[-1]
            raise refuse("keep.times", f"found {late:g} s: expected times up to the end of the program, {end:g} s")
        return self

    @model_validator(mode="after")
    def _observes_what_is_kept(self) -> Study:
        found = self.observe.problem(self.keep.fields, self.solve.boundary) if self.observe else None
        if found:
            raise refuse(f"observe.{found[0]}", found[1])
        return self


class StudyFile(Study):
    """A study file: one case, and what is varied in it."""

    sweep: dict[str, list[Any]] | list[dict[str, Any]] | None = None


def study_schema() -> dict[str, Any]:
    """JSON schema of a study file, for editors that check TOML while it is written.

    Examples
    --------
    >>> sorted(study_schema()["properties"])
    ['audit', 'friction', 'keep', 'material', 'observe', 'program', 'solve', 'surface', 'sweep', 'title']
    >>> study_schema()["$defs"]["SolveSection"]["properties"]["edge"]["description"].partition(";")[0]
    'whether contact may reach the border in free space: the scan is then a punch of that outline'
    """
    schema = StudyFile.model_json_schema()
    schema["title"] = "roughvisc study"
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **with_meanings(schema)}
