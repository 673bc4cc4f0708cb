"""``[[program]]``: the segments of a loading program, each known by the key that it must have."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

from pydantic import (
    ValidationError,
    ValidationInfo,
    WithJsonSchema,
    WrapValidator,
    create_model,
    model_validator,
)

from roughvisc.errors import InputError
from roughvisc.mechanics.program import INSTEAD, PUSHING, UNITS, Control, Program
from roughvisc.study.statement.histories import NOISE, THIN, part_or_value, read_history
from roughvisc.study.statement.schema.section import (
    FilePath,
    Section,
    Text,
    choice,
    close,
    kind,
    listed,
    literal_or,
    located,
    measured,
    of_file,
    one_of,
    shown,
)
from roughvisc.tables import Wanted, read_table

DURATION = measured("s", least=0)
PERIOD = measured("s", above=0)
DISTANCE = measured("m", above=0)
SPEED = measured("m/s", above=0)
INSTANTS = listed(measured("s", least=0), "times [s]")


class _Controlled(NamedTuple):
    """What segments prescribe.

    Attributes
    ----------
    noun, target : str
        What it is called, and what a segment goes to.
    plural : str
        Values of a table, with their unit.
    kind : type
        Kind of a value.
    """

    noun: str
    target: str
    plural: str
    kind: Any


#: What a program may control: each has a segment, cycles, tables and recordings of its own.
CONTROLLED: dict[Control, _Controlled] = {
    "load": _Controlled("load", "a load", "loads [N]", measured("N", least=0, instead=INSTEAD["load"])),
    "approach": _Controlled("approach", "an approach", "approaches [m]", measured("m", instead=INSTEAD["approach"])),
    "pressure": _Controlled(
        "nominal pressure",
        "a nominal pressure, the load over the scan's area",
        "nominal pressures [Pa]",
        measured("Pa", least=0, instead=INSTEAD["pressure"]),
    ),
}


class SegmentSection(Section):
    """One ``[[program]]`` table."""

    def extend(self, program: Program) -> Program:
        """The program with this segment behind it."""
        raise NotImplementedError

    @model_validator(mode="after")
    def _builds(self) -> SegmentSection:
        self.extend(Program())
        return self


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


class _Ramp(SegmentSection):
    control: ClassVar[Control]

    def extend(self, program: Program) -> Program:
        return getattr(program, self.control)(getattr(self, self.control), over=self.over)


class _Cycle(SegmentSection):
    def extend(self, program: Program) -> Program:
        wave = self.cycle
        return program + Program.cycle(wave.mean, wave.amplitude, wave.period, wave.cycles, self.control)


class _Table(SegmentSection):
    def extend(self, program: Program) -> Program:
        rows = self.table
        tabulated = Program.table(rows.times, rows.values, self.control, rows.note or "")
        before = program.segments[-1] if program.segments else None
        if before is not None and rows.values[0] == 0 and (before.control, before.end) != (self.control, 0.0):
            # a table that begins at zero after something else begins with a jump to zero
            tabulated = getattr(Program(), self.control)(0.0, over=0.0) + tabulated
        return program + tabulated


class _Recording(Section):
    """A table that a test machine wrote: which columns, which rows, how far they are thinned."""

    file: FilePath
    time: Text = "time"
    start: literal_or("first", measured("s"), "'first', or a time in s") = "first"
    end: measured("s") | None = None
    factor: measured("1") = 1.0
    decimal: choice(".", ",") | None = None


def _share(unit: str) -> Any:
    """Kind: a quantity, or a part of the largest value as a text such as ``"0.1 %"``."""

    def check(value: Any) -> Any:
        part_or_value(value, unit)
        return value

    wanted = f"a number [{unit}], or text with a unit, at least 0, or a part such as '0.1 %'"
    return kind(Any, check, wanted, {"type": ["number", "string"]})


def _read_rows(control: Control) -> Any:
    """Check of a ``table``: the name of a file becomes its times and values, so that a case is whole in itself."""

    def read(value: Any, check: Callable[[Any], Any], info: ValidationInfo) -> Any:
        if isinstance(value, dict) and "file" in value:
            asked = dict(TABLES[control].recording.model_validate(value, context=info.context))
            path, column = asked.pop("file"), asked.pop(control)
            found = read_history(path, control, column=column, **{"noise": NOISE} | asked)
            return check({"times": found.times, "values": found.values, "note": found.note})
        if isinstance(value, str):
            path = located(value, info)
            columns, _ = read_table(path, {"time": Wanted("time", "s"), control: Wanted(control, UNITS[control])})
            times, values = columns["time"].tolist(), columns[control].tolist()
            try:
                rows = check({"times": times, "values": values})
                Program.table(times, values, control)
            except ValidationError as error:
                raise of_file(path, {"times": "time", "values": control}, error) from None
            except InputError as error:
                raise error.prefixed(str(path)) from None
            return rows
        if not isinstance(value, dict | Section):
            raise InputError(f"found {shown(value)}: expected the path of a CSV file, or a table with times and values")
        return check(value)

    return WrapValidator(read)


class _Tables(NamedTuple):
    """The tables of a study that prescribe one quantity: their classes."""

    ramp: type[SegmentSection]
    wave: type[Section]
    cycle: type[SegmentSection]
    rows: type[Section]
    table: type[SegmentSection]
    recording: type[Section]


def _tables_of(control: Control) -> _Tables:
    one, unit, name = CONTROLLED[control], UNITS[control], control.capitalize()
    stated = (Literal[control], "load" if control == "load" else ...)  # the load, unless it says something else

    def section(suffix: str, base: type[Section], about: str, **fields: Any) -> type[Any]:
        return create_model(f"{name}{suffix}", __base__=base, __doc__=about, **fields)

    about = f"Go to {one.target}, linearly; ``over = 0`` is a jump."
    ramp = section("Segment", _Ramp, about, **{control: (one.kind, ...)}, over=(DURATION, ...))
    ramp.control = control
    wave = section(
        "Wave",
        Section,
        f"A sine wave of the {one.noun} about a mean.",
        mean=(one.kind, ...),
        amplitude=(one.kind, ...),
        period=(PERIOD, ...),
        cycles=(measured("1", above=0, most=1e6), ...),
    )
    about = f"Cycles of the {one.noun}, after a jump to their mean."
    cycle = section("Cycle", _Cycle, about, cycle=(wave, ...), control=stated)
    rows = section(
        "Rows",
        Section,
        f"{one.noun.capitalize()} against time, linear between the rows.",
        times=(INSTANTS, ...),
        values=(listed(one.kind, one.plural), ...),
        note=(Text | None, None),
    )
    about = f"A history of the {one.noun}, its time counted from the end of the segment before."
    # for editors: a path, times and values, or a file with the names of its columns
    read = Annotated[rows, _read_rows(control), WithJsonSchema({"type": ["object", "string"]})]
    table = section("Table", _Table, about, table=(read, ...), control=stated)
    noise = {"noise": (_share(unit), NOISE)} if control in PUSHING else {}
    recorded = {control: (Text, control), "zero": (measured(unit), 0.0), **noise, "thin": (_share(unit), THIN)}
    return _Tables(ramp, wave, cycle, rows, table, section("Recording", _Recording, f"Of the {one.noun}.", **recorded))


TABLES = {control: _tables_of(control) for control in CONTROLLED}

#: the key that a segment is known by -> its class, by what is controlled where that matters
KINDS: dict[str, dict[str, type[SegmentSection]]] = {
    **{control: {"load": one.ramp} for control, one in TABLES.items()},
    "hold": {"load": HoldSegment},
    "slide": {"load": SlideSegment},
    "cycle": {control: one.cycle for control, one in TABLES.items()},
    "table": {control: one.table for control, one in TABLES.items()},
}
SECTIONS = tuple(section for kind in KINDS.values() for section in kind.values())


def _segment(data: dict[str, Any], info: ValidationInfo) -> SegmentSection:
    """The table as the class of the segment that it is."""
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


AnySegment = one_of(SegmentSection, SECTIONS, _segment, "a table", "a [[program]] table")
