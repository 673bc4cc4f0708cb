"""``[[program]]``: the segments of a loading program, each known by the key that it must have."""

from __future__ import annotations

from functools import reduce
from operator import or_
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, WrapValidator, model_validator

from roughvisc.errors import InputError
from roughvisc.mechanics.stepping.program import Program
from roughvisc.study.statement.columns import read_columns
from roughvisc.study.statement.schema.entries import listed, located, measured, shown
from roughvisc.study.statement.schema.section import Section, close

LOAD = measured("N", least=0)
APPROACH = measured("m")
DURATION = measured("s", least=0)
PERIOD = measured("s", above=0)
INSTANTS = listed(measured("s", least=0), "times [s]")

Control = Literal["load", "approach"]


class SegmentSection(Section):
    """One ``[[program]]`` table."""

    def extend(self, program: Program) -> Program:
        """The program with this segment behind it."""
        raise NotImplementedError

    @model_validator(mode="after")
    def _builds(self) -> SegmentSection:
        self.extend(Program())
        return self


class LoadSegment(SegmentSection):
    """Go to a load, linearly; ``over = 0`` is a jump."""

    load: LOAD
    over: DURATION

    def extend(self, program: Program) -> Program:
        return program.load(self.load, over=self.over)


class ApproachSegment(SegmentSection):
    """Go to an approach, linearly; ``over = 0`` is a jump."""

    approach: APPROACH
    over: DURATION

    def extend(self, program: Program) -> Program:
        return program.approach(self.approach, over=self.over)


class HoldSegment(SegmentSection):
    """Keep what is controlled, or what ``control`` names, at the value it has."""

    hold: DURATION
    control: Control | None = None

    def extend(self, program: Program) -> Program:
        return program.hold(self.hold, self.control)


class LoadWave(Section):
    """A sine wave of the load about a mean."""

    mean: LOAD
    amplitude: LOAD
    period: PERIOD
    cycles: measured("1", above=0)


class ApproachWave(Section):
    """A sine wave of the approach about a mean."""

    mean: APPROACH
    amplitude: APPROACH
    period: PERIOD
    cycles: measured("1", above=0)


class _Cycle(SegmentSection):
    def extend(self, program: Program) -> Program:
        wave = self.cycle
        return program + Program.cycle(wave.mean, wave.amplitude, wave.period, wave.cycles, self.control)


class LoadCycle(_Cycle):
    """Cycles of the load, after a jump to their mean."""

    cycle: LoadWave
    control: Literal["load"] = "load"


class ApproachCycle(_Cycle):
    """Cycles of the approach, after a jump to their mean."""

    cycle: ApproachWave
    control: Literal["approach"]


def _rows(quantity: str, unit: str) -> Any:
    """Check of a ``table``: the name of a CSV file becomes its times and values, so that a case is whole in itself."""

    def read(value: Any, info: ValidationInfo) -> Any:
        if isinstance(value, str):
            times, values = read_columns(located(value, info), {"time": "s", quantity: unit})
            return {"times": times, "values": values}
        if not isinstance(value, dict | Section):
            raise InputError(f"found {shown(value)}: expected the path of a CSV file, or a table with times and values")
        return value

    return BeforeValidator(read)


class LoadRows(Section):
    """Load against time, linear between the rows."""

    times: INSTANTS
    values: listed(LOAD, "loads [N]")


class ApproachRows(Section):
    """Approach against time, linear between the rows."""

    times: INSTANTS
    values: listed(APPROACH, "approaches [m]")


class _Table(SegmentSection):
    def extend(self, program: Program) -> Program:
        rows = self.table
        tabulated = Program.table(rows.times, rows.values, self.control)
        before = program.segments[-1] if program.segments else None
        if before is not None and rows.values[0] == 0 and (before.control, before.end) != (self.control, 0.0):
            # a table that begins at zero after something else begins with a jump to zero
            tabulated = getattr(Program(), self.control)(0.0, over=0.0) + tabulated
        return program + tabulated


class LoadTable(_Table):
    """A history of the load, its time counted from the end of the segment before."""

    table: Annotated[LoadRows, _rows("load", "N")]
    control: Literal["load"] = "load"


class ApproachTable(_Table):
    """A history of the approach, its time counted from the end of the segment before."""

    table: Annotated[ApproachRows, _rows("approach", "m")]
    control: Literal["approach"]


#: the key that a segment is known by -> its class, by what is controlled where that matters
KINDS: dict[str, dict[str, type[SegmentSection]]] = {
    "load": {"load": LoadSegment},
    "approach": {"load": ApproachSegment},
    "hold": {"load": HoldSegment},
    "cycle": {"load": LoadCycle, "approach": ApproachCycle},
    "table": {"load": LoadTable, "approach": ApproachTable},
}
SECTIONS = tuple(section for kind in KINDS.values() for section in kind.values())


def _pick(data: Any, _: Any, info: Any) -> Any:
    """The table as the class of the segment that it is."""
    if isinstance(data, SegmentSection):
        return data
    if not isinstance(data, dict):
        raise InputError(f"found {shown(data)}: expected a table")
    kinds = [key for key in KINDS if key in data]
    if len(kinds) != 1:
        hints = [close(key, KINDS) for key in data if key not in (*KINDS, "over", "control")]
        hint = "" if kinds else next(filter(None, hints), "")
        raise InputError(f"found {shown(data)}: expected exactly one of {', '.join(KINDS)}{hint}")
    choice = KINDS[kinds[0]]
    control = data.get("control", "load")
    return choice.get(control if isinstance(control, str) else "", choice["load"]).model_validate(
        data, context=info.context
    )


AnySegment = Annotated[reduce(or_, SECTIONS), WrapValidator(_pick), Field(description="a [[program]] table")]
