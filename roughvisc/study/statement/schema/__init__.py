"""The shape of a study file: what each table may hold. Imports pydantic, and nothing heavier until it must."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, WithJsonSchema, model_validator

from roughvisc.errors import InputError
from roughvisc.experiment.base import Experiment
from roughvisc.experiment.loading import Loading
from roughvisc.mechanics.program import Program
from roughvisc.settings import OPEN_BOUNDARY, Settings, known_boundary
from roughvisc.study.statement.schema.evaluation import AuditSection, ObserveSection
from roughvisc.study.statement.schema.experiments import FrictionSection
from roughvisc.study.statement.schema.material import AnyMaterial
from roughvisc.study.statement.schema.program import AnySegment
from roughvisc.study.statement.schema.section import Section, Text, a_list, nullable, refuse, shown
from roughvisc.study.statement.schema.settings import KeepSection, SolveSection
from roughvisc.study.statement.schema.surface import AnySurface

#: Part of a program's duration by which a kept time may exceed it.
_ROUNDING = 1e-12
#: Tables of the settings that are not in ``[solve]``.
_TABLES = {"times": "keep", "fields": "keep", "missing": "surface"}
_SEGMENTS = "a list of [[program]] tables, at least one"


def _segments(value: Any, info: ValidationInfo) -> Any:
    """Segments, or none where another table states an experiment; a study whose other table is wrong hears of that."""
    if value is not None:
        if info.data.get("friction") is not None:
            raise InputError("found together with [friction]: expected one of them: a study states one experiment")
        return tuple(a_list(value, _SEGMENTS) or a_list(None, _SEGMENTS))
    if info.data.get("friction", ...) is None:
        raise InputError(f"missing: expected {_SEGMENTS}, or a table [friction]")
    return value


def _with_boundary(solve: SolveSection, info: ValidationInfo) -> SolveSection:
    """How it is computed, with the boundary that ``auto`` stands for, which the study then does not state itself."""
    if not {"surface", "friction"} <= set(info.data):  # what is wrong there is said first
        return solve
    friction = info.data["friction"]
    found = known_boundary(solve, friction.experiment().boundary if friction else None, info.data["surface"].boundary)
    if found is None:
        raise refuse("boundary", OPEN_BOUNDARY)
    if found == solve.boundary:
        return solve
    return SolveSection.model_construct(solve.model_fields_set - {"boundary"}, **dict(solve) | {"boundary": found})


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
    solve: Annotated[SolveSection, AfterValidator(_with_boundary), Field(validate_default=True)] = SolveSection()
    keep: KeepSection = KeepSection()
    observe: nullable(ObserveSection) = Field(None, description="a table")
    audit: nullable(AuditSection) = None

    def loading(self) -> Program:
        """The program as the solver takes it.

        Raises
        ------
        InputError
            If the study states another experiment.
        """
        if self.program is None:
            other = self.experiment()
            raise InputError(key=other.table, found="steady sliding", expected="[[program]] tables")
        program = Program()
        for segment in self.program:
            program = segment.extend(program)
        return program

    def experiment(self) -> Experiment:
        """What is done with the surface."""
        return self.friction.experiment() if self.friction is not None else Loading(self.loading())

    def late_times(self) -> tuple[float, ...]:
        """Return the listed times after the end of the program, which are not kept. [s]"""
        if self.program is None or not isinstance(self.keep.times, tuple):
            return ()
        end = self.loading().duration * (1 + _ROUNDING)
        return tuple(time for time in self.keep.times if time > end)

    def solving(self) -> Settings:
        """How it is computed and what is kept, as the solver takes it."""
        times = None if self.keep.times == "all" else self.keep.times
        if late := self.late_times():
            times = self.keep.times[: -len(late)]
        return Settings(**dict(self.solve), fields=self.keep.fields, times=times, missing=self.surface.missing)

    @model_validator(mode="after")
    def _check_consistency(self) -> Study:
        late = self.late_times()
        if late and late == self.keep.times:
            end = self.loading().duration
            problem = f"found {late[0]:g} s: expected at least one time up to the end of the program, {end:g} s"
            raise refuse("keep.times", problem)
        for name, found, why in self.experiment().unsupported(self.solving()):
            raise refuse(f"{_TABLES.get(name, 'solve')}.{name}", f"found {shown(found)}: {why}")
        found = self.observe.problem(self.keep.fields, self.solve.boundary) if self.observe else None
        if found:
            raise refuse(f"observe.{found[0]}", found[1])
        return self


#: Table of a sweep: lists of values, and how many realisations of the surface.
_VARIED = {
    "type": "object",
    "properties": {
        "realisations": {"type": "integer", "minimum": 2, "description": "how many other patches of the same roughness"}
    },
    "additionalProperties": {"type": "array"},
}


class StudyFile(Study):
    """A study file: one case, and what is varied in it."""

    sweep: Annotated[
        dict[str, list[Any]] | list[dict[str, Any]] | None,
        WithJsonSchema({"anyOf": [_VARIED, {"type": "array", "items": {"type": "object"}}]}),
    ] = None
