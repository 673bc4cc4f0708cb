"""The shape of a study file: what each table may hold. Imports pydantic, and nothing heavier until it must."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, WithJsonSchema, model_validator
from pydantic.fields import FieldInfo

from roughvisc.errors import InputError
from roughvisc.experiment.loading import Loading
from roughvisc.experiment.protocol import Experiment
from roughvisc.mechanics.stepping.program import Program
from roughvisc.settings import ENTRIES, OPEN_BOUNDARY, Settings, known_boundary
from roughvisc.study.statement.schema.evaluation import AuditSection, ObserveSection
from roughvisc.study.statement.schema.experiments import ExperimentSection, FrictionSection
from roughvisc.study.statement.schema.material import AnyMaterial
from roughvisc.study.statement.schema.program import AnySegment
from roughvisc.study.statement.schema.section import Section, Text, a_list, nullable, refuse, shown
from roughvisc.study.statement.schema.settings import KeepSection, SolveSection
from roughvisc.study.statement.schema.surface import AnySurface

#: Tables that state an experiment other than a program.
EXPERIMENTS = ["friction"]
#: Part of a program's duration by which a kept time may exceed it.
_ROUNDING = 1e-12
_SEGMENTS = "a list of [[program]] tables, at least one"


def _segments(value: Any, info: ValidationInfo) -> Any:
    """Segments, or none where another table states an experiment; a study whose other table is wrong hears of that."""
    others = [name for name in EXPERIMENTS if info.data.get(name) is not None]
    if value is not None:
        if others:
            raise InputError(f"found together with [{others[0]}]: expected one of them: a study states one experiment")
        return tuple(a_list(value, _SEGMENTS) or a_list(None, _SEGMENTS))
    if not others and all(name in info.data for name in EXPERIMENTS):
        raise InputError(
            f"missing: expected {_SEGMENTS}, or a table {' or '.join(f'[{name}]' for name in EXPERIMENTS)}"
        )
    return value


def _with_boundary(solve: SolveSection, info: ValidationInfo) -> SolveSection:
    """How it is computed, with the boundary that ``auto`` stands for, which the study then does not state itself."""
    if not {"surface", *EXPERIMENTS} <= set(info.data):  # what is wrong there is said first
        return solve
    stated = [section for name in EXPERIMENTS if (section := info.data[name]) is not None]
    found = known_boundary(solve, stated[0].experiment().boundary if stated else None, info.data["surface"].boundary)
    if found is None:
        raise refuse("boundary", OPEN_BOUNDARY.format(mirror="mirror = true in [surface]"))
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
            raise InputError(f"{other.table}: found {other.called}, which has no program: expected [[program]] tables")
        program = Program()
        for segment in self.program:
            program = segment.extend(program)
        return program

    def experiment(self) -> Experiment:
        """What is done with the surface."""
        stated = [section for name in EXPERIMENTS if (section := getattr(self, name)) is not None]
        return stated[0].experiment() if stated else Loading(self.loading())

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
            raise refuse(f"{ENTRIES[name].table}.{name}", f"found {shown(found)}: {why}")
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


def add_experiment(section: type[ExperimentSection], table: str) -> None:
    """Let studies state another experiment.

    Parameters
    ----------
    section : type of ExperimentSection
        Its keys, as fields of a pydantic model, and the experiment that they stand for.
    table : str
        Name of its table in a study file.

    Raises
    ------
    InputError
        If studies have a table of that name.
    """
    if table in Study.model_fields:
        raise InputError(f"a study has a table [{table}] already: expected another name")
    EXPERIMENTS.append(table)
    for study in (Study, StudyFile):
        fields = study.model_fields
        known = dict(fields)
        fields.clear()
        for name, one in known.items():
            if name == "program":  # whose check looks at the tables before it
                fields[table] = FieldInfo.from_annotated_attribute(nullable(section), None)
            fields[name] = one
        study.model_rebuild(force=True)
