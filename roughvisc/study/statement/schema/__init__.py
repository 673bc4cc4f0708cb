"""The shape of a study file: what each table may hold. Imports pydantic, and nothing heavier until it must."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, model_validator

from roughvisc.mechanics.stepping.program import Program
from roughvisc.study.statement.schema.entries import Text, a_list
from roughvisc.study.statement.schema.material import AnyMaterial
from roughvisc.study.statement.schema.meanings import with_meanings
from roughvisc.study.statement.schema.program import AnySegment
from roughvisc.study.statement.schema.section import Section, refuse
from roughvisc.study.statement.schema.settings import KeepSection, SolveSection
from roughvisc.study.statement.schema.surface import AnySurface
from roughvisc.study.statement.settings import Settings

_SEGMENTS = "a list of [[program]] tables, at least one"


def _segments(value: Any) -> Any:
    return a_list(value, _SEGMENTS) or a_list(None, _SEGMENTS)


class Study(Section):
    """One case as a study file states it, checked, in SI."""

    title: Text = "untitled"
    surface: AnySurface
    material: AnyMaterial
    program: Annotated[tuple[AnySegment, ...], BeforeValidator(_segments), Field(description=_SEGMENTS)]
    solve: SolveSection = SolveSection()
    keep: KeepSection = KeepSection()

    def loading(self) -> Program:
        """The program as the solver takes it."""
        program = Program()
        for segment in self.program:
            program = segment.extend(program)
        return program

    def solving(self) -> Settings:
        """How it is computed and what is kept, as the solver takes it."""
        times = None if self.keep.times == "all" else self.keep.times
        return Settings(**dict(self.solve), fields=self.keep.fields, times=times, missing=self.surface.missing)

    @model_validator(mode="after")
    def _keeps_times_of_the_program(self) -> Study:
        end = self.loading().duration
        if isinstance(self.keep.times, tuple) and self.keep.times[-1] > end * (1 + 1e-12):
            late = self.keep.times[-1]
            raise refuse("keep.times", f"found {late:g} s: expected times up to the end of the program, {end:g} s")
        return self


class StudyFile(Study):
    """A study file: one case, and what is varied in it."""

    sweep: dict[str, list[Any]] | list[dict[str, Any]] | None = None


def study_schema() -> dict[str, Any]:
    """JSON schema of a study file, for editors that check TOML while it is written.

    Examples
    --------
    >>> sorted(study_schema()["properties"])
    ['keep', 'material', 'program', 'solve', 'surface', 'sweep', 'title']
    >>> study_schema()["$defs"]["SolveSection"]["properties"]["edge"]["description"].partition(";")[0]
    'whether contact may reach the border in free space: the scan is then a punch of that outline'
    """
    schema = StudyFile.model_json_schema()
    schema["title"] = "roughvisc study"
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **with_meanings(schema)}
