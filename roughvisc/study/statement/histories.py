"""Histories that test machines record, as loading programs: time zero, noise below zero, rows thinned."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.program import PUSHING, UNITS, Control, Program
from roughvisc.tables import Wanted, read_table
from roughvisc.units import is_quantity, number

Array = NDArray[np.float64]

#: Loads below zero that are no lower than this part of the largest count as noise; rows are thinned to this part of it.
NOISE, THIN = "1 %", "0.1 %"
#: Segments of which a note says that there are many, if they are more than a tenth of the rows.
_MANY = 300
#: Rows that a search for the end of a segment looks at first.
_AHEAD = 64


@dataclass(frozen=True)
class History:
    """A recorded history: times from zero [s], values [N, m or Pa], and what was done to have them."""

    times: tuple[float, ...]
    values: tuple[float, ...]
    note: str


def read_program(
    path: str | Path,
    *,
    time: str = "time",
    load: str | None = None,
    approach: str | None = None,
    pressure: str | None = None,
    start: float | str = "first",
    end: float | str | None = None,
    zero: float | str = 0.0,
    factor: float = 1.0,
    noise: float | str = NOISE,
    thin: float | str = THIN,
    decimal: Literal[".", ","] | None = None,
) -> Program:
    """Read a program from a table of a test machine: force, motion or nominal pressure against time.

    Parameters
    ----------
    path : path
        A text file; see Notes.
    time : str
        Name of the time column.
    load, approach, pressure : str, optional
        Name of the prescribed column; give one of them. Default: ``load="load"``.
    start : float or str
        Time in the file that becomes time zero of the program; earlier rows are ignored. ``"first"``: time of the first
        row. [s]
    end : float or str, optional
        Time in the file at which the program ends. Default: time of the last row. [s]
    zero : float or str
        Value in the file that becomes zero: a tare, or the position of first touch. [N, m or Pa]
    factor : float
        Factor for the values after subtracting `zero`: -1 if compression is negative in the file.
    noise : float or str
        Negative loads down to this magnitude count as zero. Lower loads are refused, because the model has no adhesion.
        A string with ``%`` is a part of the largest load. [N or Pa]
    thin : float or str
        Rows are omitted as long as all rows are within this distance of the straight lines between the kept rows; zero
        keeps all rows. A string with ``%`` is a part of the largest value. [N, m or Pa]
    decimal : {".", ","}, optional
        Decimal mark. Default: found from the numbers.

    Returns
    -------
    Program
        Its ``note`` states the numbers of rows and segments, and what becomes zero.

    Raises
    ------
    InputError
        If the file or a column cannot be read, times do not increase, or loads are negative; the message names the
        line.

    Notes
    -----
    Columns may be separated by semicolons, tabs, commas or blanks. The heading is the first line that contains both
    names; lines above it are skipped. Upper and lower case do not matter. The unit is in the heading, as
    ``Force [mN]`` or ``Force (mN)``, or in the name given here. Two rows at the same time are a jump.
    """
    chosen = {key: name for key, name in (("load", load), ("approach", approach), ("pressure", pressure)) if name}
    if len(chosen) > 1:
        raise InputError(f"found {', '.join(chosen)}: expected one column that is prescribed")
    control: Any = next(iter(chosen), "load")
    column, told = chosen.get(control, control), {"start": start, "end": end, "zero": zero, "factor": factor}
    found = read_history(path, control, time=time, column=column, noise=noise, thin=thin, decimal=decimal, **told)
    return Program.table(found.times, found.values, control, note=found.note)


def part_or_value(value: Any, unit: str, largest: float | None = None, key: str = "") -> float:
    """A quantity, or a part of the largest value given as a text such as ``"0.1 %"``; never negative.

    Without the largest value the part itself, for a check.
    """
    try:
        if isinstance(value, str) and is_quantity(value, "1"):
            return number(value, "1", least=0) * (1.0 if largest is None else largest)
        return number(value, unit, least=0)
    except InputError as error:
        where = f"{key}: " if key else ""
        raise InputError(f"{where}{error}, or a part of the largest value such as '0.1 %'") from None


def read_history(
    path: str | Path,
    control: Control,
    *,
    time: str,
    column: str,
    start: float | str,
    end: float | str | None,
    zero: float | str,
    factor: float,
    noise: float | str,
    thin: float | str,
    decimal: str | None,
) -> History:
    """As :func:`read_program`, for one column of what is controlled."""
    unit = UNITS[control]
    start = start if start == "first" else number(start, "s", "start")
    end = None if end is None else number(end, "s", "end")
    zero, factor = number(zero, unit, "zero"), number(factor, "1", "factor")
    if decimal not in (None, ".", ","):
        raise InputError(f"decimal: found {decimal!r}: expected '.' or ','")
    for name in (time, column):
        if not isinstance(name, str) or not name.strip():
            raise InputError(f"found {name!r}: expected the name of a column")
    wanted = {"time": Wanted(time, "s"), control: Wanted(column, unit)}
    columns, lines = read_table(path, wanted, decimal=decimal)
    times, values = columns["time"], _less(columns[control], zero) * factor
    _check_times(path, times, lines)
    first = float(times[0]) if start == "first" else float(start)
    said = [] if first == 0 else [f"{first:g} s in the file is time zero"]
    times, values = _cut(path, times, values, first, end)
    rows = len(times)
    if control in PUSHING:
        values, note = _above_noise(path, control, times + first, values, noise)
        said += note
    largest = float(np.max(np.abs(values)))
    tolerance = part_or_value(thin, unit, largest, "thin")
    if abs(values[0]) <= tolerance:
        values[0] = 0.0
    kept = thinned(times, values, tolerance)
    segments = len(kept) - (values[0] == 0)
    lead = f"{Path(path).name}: {rows:,} rows became {segments:,} segments"
    if tolerance:
        part = f", {100 * tolerance / largest:.2g} % of the largest {control}" if largest else ""
        lead += f", which pass every row within {tolerance:.3g} {unit}{part}"
    if segments > max(_MANY, rows / 10):
        said.append("the rows scatter by more than that: a larger `thin` leaves fewer segments")
    note = "; ".join([lead, *said]) + "."
    return History(tuple(times[kept].tolist()), tuple(values[kept].tolist()), note)


def _check_times(path: str | Path, times: Array, lines: list[int]) -> None:
    falls = np.flatnonzero(np.diff(times) < 0)
    if falls.size:
        at = int(falls[0]) + 1
        raise InputError(
            f"{path}, line {lines[at]}: time {times[at]:g} s after {times[at - 1]:g} s: expected increasing times"
        )
    crowded = np.flatnonzero(times[2:] == times[:-2])
    if crowded.size:
        at = int(crowded[0])
        raise InputError(
            f"{path}, lines {lines[at]} to {lines[at + 2]}: three rows at {times[at]:g} s: expected at most two, which "
            "are a jump; export the times with more digits"
        )


def _above_noise(
    path: str | Path, control: str, times: Array, values: Array, noise: float | str
) -> tuple[Array, list[str]]:
    """Values with noise below zero set to zero, and a word on it."""
    unit = UNITS[control]
    largest, lowest = max(float(values.max()), 0.0), float(values.min())
    limit = part_or_value(noise, unit, largest, "noise")
    if lowest < -limit:
        at = int(np.argmin(values))
        turn = " Does the machine count compression negative? Then factor = -1." if -lowest > largest else ""
        raise InputError(
            f"{path}: {control} falls to {lowest:.3g} {unit} at {times[at]:g} s: expected none below zero by more than "
            f"noise, {limit:.3g} {unit} (`noise` sets another limit, `zero` takes an offset off).{turn}"
        )
    below = int(np.count_nonzero(values < 0))
    rows = "row below zero counts" if below == 1 else "rows below zero count"
    said = [f"{below:,} {rows} as zero, the lowest {lowest:.3g} {unit}"] if below else []
    return np.maximum(values, 0.0), said


def _cut(path: str | Path, times: Array, values: Array, start: float, end: float | None) -> tuple[Array, Array]:
    """Rows from one time of the file to another, with values between rows at both; time counts from the first."""
    last = float(times[-1]) if end is None else end
    if not times[0] <= start < last <= times[-1]:
        expected = f"expected them in order from {times[0]:g} to {times[-1]:g} s, where it has rows"
        raise InputError(f"{path}: start is {start:g} s and end {last:g} s: {expected}")
    inside = (times >= start) & (times <= last)
    cut, chosen = times[inside], values[inside]
    for at in (start, last):
        if at not in cut:
            where = np.searchsorted(cut, at)
            cut, chosen = np.insert(cut, where, at), np.insert(chosen, where, np.interp(at, times, values))
    return _less(cut, start), chosen


def _less(values: Array, zero: float) -> Array:
    """Values less their zero, without the noise of rounding in the last digits; in memory of their own."""
    return np.array([float(f"{value - zero:.12g}") for value in values.tolist()]) if zero else values.copy()


def thinned(times: Array, values: Array, tolerance: float) -> NDArray[np.intp]:
    """Rows to keep so that the straight lines between them pass every row within a tolerance.

    Parameters
    ----------
    times, values : ndarray
        Of the rows; two rows at one time are a jump, and both are kept.
    tolerance : float
        In the unit of the values; zero keeps every row.

    Returns
    -------
    ndarray of int
        Ascending, with the first and the last row.

    Notes
    -----
    From each row that is kept the line goes to the farthest row that it can reach: the slopes that pass all rows
    between within the tolerance form a cone, which narrows row by row. One sweep through the rows.
    """
    count = len(times)
    if tolerance <= 0 or count < 3:
        return np.arange(count)
    ends = [*np.flatnonzero(np.diff(times) == 0).tolist(), count - 1]
    kept, row = [0], 0
    for end in ends:
        while row < end:
            row = _farthest(times, values, row, end, tolerance)
            kept.append(row)
        if end < count - 1:
            row = end + 1
            kept.append(row)
    return np.array(kept)


def _farthest(times: Array, values: Array, row: int, end: int, tolerance: float) -> int:
    """The farthest row, up to an end, that a line from a row reaches within a tolerance of all between."""
    low, high, best = -np.inf, np.inf, row + 1
    here, ahead = row + 1, _AHEAD
    while here <= end and low <= high:
        there = min(here + ahead, end + 1)
        span, rise = times[here:there] - times[row], values[here:there] - values[row]
        lows = np.maximum.accumulate(np.concatenate([[low], (rise - tolerance) / span]))
        highs = np.minimum.accumulate(np.concatenate([[high], (rise + tolerance) / span]))
        reached = np.flatnonzero((lows[:-1] <= rise / span) & (rise / span <= highs[:-1]))
        if reached.size:
            best = here + int(reached[-1])
        low, high = float(lows[-1]), float(highs[-1])
        here, ahead = there, 2 * ahead
    return best
