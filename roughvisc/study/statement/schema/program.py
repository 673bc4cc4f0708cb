"""``[[program]]``: the segments of a loading program, each known by the key that it must have."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from operator import or_
from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    Field,
    ValidationError,
    ValidationInfo,
    WithJsonSchema,
    WrapValidator,
    model_validator,
)

from roughvisc.errors import InputError
from roughvisc.mechanics.stepping.program import INSTEAD, Control, Program
from roughvisc.study.statement.histories import NOISE, THIN, part_or_value, read_history
from roughvisc.study.statement.schema.entries import (
    FilePath,
    Text,
    choice,
    listed,
    literal_or,
    located,
    measured,
    shown,
)
from roughvisc.study.statement.schema.section import Section, close, of_file
from roughvisc.tables import Wanted, read_table

LOAD = measured("N", least=0, instead=INSTEAD["load"])
APPROACH = measured("m", instead=INSTEAD["approach"])
PRESSURE = measured("Pa", least=0, instead=INSTEAD["pressure"])
DURATION = measured("s", least=0)
PERIOD = measured("s", above=0)
DISTANCE = measured("m", above=0)
SPEED = measured("m/s", above=0)
INSTANTS = listed(measured("s", least=0), "times [s]")


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


class PressureSegment(SegmentSection):
    """Go to a nominal pressure, the load over the scan's area, linearly; ``over = 0`` is a jump."""

    pressure: PRESSURE
    over: DURATION

    def extend(self, program: Program) -> Program:
        return program.pressure(self.pressure, over=self.over)


class HoldSegment(SegmentSection):
    """Keep what is controlled, or what ``control`` names, at the value it has."""

    hold: DURATION
    control: Control | None = None

    def extend(self, program: Program) -> Program:
        return program.hold(self.hold, self.control)


class SlideSegment(SegmentSection):
    """Slide the profile along the surface at constant speed; what is controlled keeps the value it has."""

    slide: DISTANCE
    speed: SPEED | None = None
    over: PERIOD | None = None
    direction: choice("x", "-x", "y", "-y") = "x"

    def extend(self, program: Program) -> Program:
        if (self.speed is None) == (self.over is None):
            found = "neither" if self.speed is None else "both"
            raise InputError(f"a slide has either a speed or a duration: found {found}, expected one of them")
        return program.slide(self.slide, speed=self.speed, over=self.over, direction=self.direction)


class LoadWave(Section):
    """A sine wave of the load about a mean."""

    mean: LOAD
    amplitude: LOAD
    period: PERIOD
    cycles: measured("1", above=0, most=1e6)


class ApproachWave(Section):
    """A sine wave of the approach about a mean."""

    mean: APPROACH
    amplitude: APPROACH
    period: PERIOD
    cycles: measured("1", above=0, most=1e6)


class PressureWave(Section):
    """A sine wave of the nominal pressure about a mean."""

    mean: PRESSURE
    amplitude: PRESSURE
    period: PERIOD
    cycles: measured("1", above=0, most=1e6)


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


class PressureCycle(_Cycle):
    """Cycles of the nominal pressure, after a jump to their mean."""

    cycle: PressureWave
    control: Literal["pressure"]


#: For editors: a path, times and values, or a file with the names of its columns.
_ANY_TABLE = WithJsonSchema({"type": ["object", "string"]})


def _share(unit: str) -> Any:
    """Kind: a quantity, or a part of the largest value as a text such as ``"0.1 %"``."""
    wanted = f"a number in {unit}, or a string with a unit of its kind, at least 0, or a part such as '0.1 %'"

    def check(value: Any) -> Any:
        part_or_value(value, unit)
        return value

    schema = WithJsonSchema({"type": ["number", "string"]})
    return Annotated[Any, BeforeValidator(check), schema, Field(description=wanted)]


class _Recording(Section):
    """A table that a test machine wrote: which columns, which rows, how far they are thinned."""

    file: FilePath
    time: Text = "time"
    start: literal_or("first", measured("s"), "'first', or a time in s") = "first"
    end: measured("s") | None = None
    factor: measured("1") = 1.0
    decimal: choice(".", ",") | None = None


class LoadRecording(_Recording):
    """Of the load."""

    load: Text = "load"
    zero: measured("N") = 0.0
    noise: _share("N") = NOISE
    thin: _share("N") = THIN


class ApproachRecording(_Recording):
    """Of the approach."""

    approach: Text = "approach"
    zero: measured("m") = 0.0
    thin: _share("m") = THIN


class PressureRecording(_Recording):
    """Of the nominal pressure."""

    pressure: Text = "pressure"
    zero: measured("Pa") = 0.0
    noise: _share("Pa") = NOISE
    thin: _share("Pa") = THIN


RECORDINGS: dict[Control, type[_Recording]] = {
    "load": LoadRecording,
    "approach": ApproachRecording,
    "pressure": PressureRecording,
}


def _recorded(value: Any, control: Control, info: ValidationInfo) -> dict[str, Any]:
    """Times and values of a recording, and what was done to have them."""
    asked = dict(RECORDINGS[control].model_validate(value, context=info.context))
    path, column = asked.pop("file"), asked.pop(control)
    found = read_history(path, control, column=column, **{"noise": NOISE} | asked)
    return {"times": found.times, "values": found.values, "note": found.note}


def _rows(quantity: Control, unit: str) -> Any:
    """Check of a ``table``: the name of a file becomes its times and values, so that a case is whole in itself."""

    def read(value: Any, check: Callable[[Any], Any], info: ValidationInfo) -> Any:
        if isinstance(value, dict) and "file" in value:
            return check(_recorded(value, quantity, info))
        if isinstance(value, str):
            path = located(value, info)
            columns, _ = read_table(path, {"time": Wanted("time", "s"), quantity: Wanted(quantity, unit)})
            times, values = columns["time"].tolist(), columns[quantity].tolist()
            try:
                rows = check({"times": times, "values": values})
                Program.table(times, values, quantity)
            except ValidationError as error:
                raise of_file(path, {"times": "time", "values": quantity}, error) from None
            except InputError as error:
                raise InputError(f"{path}: {error}") from None
            return rows
        if not isinstance(value, dict | Section):
            raise InputError(f"found {shown(value)}: expected the path of a CSV file, or a table with times and values")
        return check(value)

    return WrapValidator(read)


class LoadRows(Section):
    """Load against time, linear between the rows."""

    times: INSTANTS
    values: listed(LOAD, "loads [N]")
    note: Text | None = None


class ApproachRows(Section):
    """Approach against time, linear between the rows."""

    times: INSTANTS
    values: listed(APPROACH, "approaches [m]")
    note: Text | None = None


class PressureRows(Section):
    """Nominal pressure against time, linear between the rows."""

    times: INSTANTS
    values: listed(PRESSURE, "nominal pressures [Pa]")
    note: Text | None = None


class _Table(SegmentSection):
    def extend(self, program: Program) -> Program:
        rows = self.table
        tabulated = Program.table(rows.times, rows.values, self.control, rows.note or "")
        before = program.segments[-1] if program.segments else None
        if before is not None and rows.values[0] == 0 and (before.control, before.end) != (self.control, 0.0):
            # a table that begins at zero after something else begins with a jump to zero
            tabulated = getattr(Program(), self.control)(0.0, over=0.0) + tabulated
        return program + tabulated


class LoadTable(_Table):
    """A history of the load, its time counted from the end of the segment before."""

    table: Annotated[LoadRows, _rows("load", "N"), _ANY_TABLE]
    control: Literal["load"] = "load"


class ApproachTable(_Table):
    """A history of the approach, its time counted from the end of the segment before."""

    table: Annotated[ApproachRows, _rows("approach", "m"), _ANY_TABLE]
    control: Literal["approach"]


class PressureTable(_Table):
    """A history of the nominal pressure, its time counted from the end of the segment before."""

    table: Annotated[PressureRows, _rows("pressure", "Pa"), _ANY_TABLE]
    control: Literal["pressure"]


#: the key that a segment is known by -> its class, by what is controlled where that matters
KINDS: dict[str, dict[str, type[SegmentSection]]] = {
    "load": {"load": LoadSegment},
    "approach": {"load": ApproachSegment},
    "pressure": {"load": PressureSegment},
    "hold": {"load": HoldSegment},
    "slide": {"load": SlideSegment},
    "cycle": {"load": LoadCycle, "approach": ApproachCycle, "pressure": PressureCycle},
    "table": {"load": LoadTable, "approach": ApproachTable, "pressure": PressureTable},
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
        hints = [close(key, KINDS) for key in data if key not in (*KINDS, "over", "control", "speed", "direction")]
        hint = "" if kinds else next(filter(None, hints), "")
        raise InputError(f"found {shown(data)}: expected exactly one of {', '.join(KINDS)}{hint}")
    choice = KINDS[kinds[0]]
    if isinstance(data.get("table"), dict) and "control" not in data:  # the column that is chosen tells
        named = next((one for one in ("approach", "pressure") if one in data["table"]), None)
        data = data | {"control": named} if named else data
    control = data.get("control", "load")
    return choice.get(control if isinstance(control, str) else "", choice["load"]).model_validate(
        data, context=info.context
    )


AnySegment = Annotated[reduce(or_, SECTIONS), WrapValidator(_pick), Field(description="a [[program]] table")]
