"""Histories of test machines as loading programs: zero, scale factor, noise below zero, thinning of rows."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.program import LEAST, UNITS, Control, Program
from roughvisc.tables import Wanted, read_table
from roughvisc.units import is_quantity, number

Array = NDArray[np.float64]

#: Negative loads count as zero up to this part of the largest load.
_NOISE = 0.01


def read_program(path: str | Path, **columns: Any) -> Program:
    """Read a program from a table of a test machine: force, motion or nominal pressure against time.

    Parameters
    ----------
    path : path
        A text file; see Notes.
    **columns
        The arguments below.
    time : str
        Name of the time column. The time of the first row becomes zero.
    load, approach, pressure : str, optional
        Name of the prescribed column; give one. Default: ``load="load"``.
    zero : float or str
        Value in the file that becomes zero: a tare, or the position of first touch. [N, m or Pa]
    factor : float
        Factor for the values after subtracting `zero`: -1 if compression is negative in the file.
    thin : float or str
        Largest distance of an omitted row from the straight lines between the kept rows; zero keeps all rows. A string
        with ``%`` is a part of the largest value. [N, m or Pa]

    Returns
    -------
    Program
        Its ``note`` states the numbers of rows and segments, and the noise that is set to zero.

    Raises
    ------
    InputError
        If the file or a column cannot be read, times do not increase, or loads are below zero by more than noise (1 %
        of the largest load); the message names the line.

    See Also
    --------
    roughvisc.Program, roughvisc.read_record

    Notes
    -----
    Columns may be separated by semicolons, tabs, commas or blanks. The heading is the first line that contains both
    names; lines above it are skipped. Upper and lower case do not matter. The unit is in the heading, as
    ``Force [mN]`` or ``Force (mN)``, or in the name given here. Two rows at the same time are a jump. A text export of
    JPK has names and units in comments before each segment, such as ``"Series Time"`` and ``"Vertical Deflection"``.

    Adhesion is not modelled: a record with a pull-off ends at the end of its hold.

    Examples
    --------
    >>> import tempfile
    >>> import roughvisc as rv
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with open(f"{folder}/machine.csv", "w") as file:
    ...         _ = file.write("time [s]; load [mN]\\n0; 0\\n1; 2\\n2; 2\\n")
    ...     program = rv.read_program(f"{folder}/machine.csv", time="time")
    >>> program
    Program: load to 2 mN over 1 s, load to 2 mN over 1 s
    """
    control, times, values, note = read_history(path, **columns)
    return Program.table(times, values, control, note)


def read_history(
    path: str | Path,
    *,
    time: str = "time",
    load: str | None = None,
    approach: str | None = None,
    pressure: str | None = None,
    zero: float | str = 0.0,
    factor: float = 1.0,
    thin: float | str = "0.1 %",
) -> tuple[Control, list[float], list[float], str]:
    """Return the control, times from zero [s], values [N, m or Pa] and note of a table; see :func:`read_program`."""
    columns: dict[Control, str | None] = {"load": load, "approach": approach, "pressure": pressure}
    chosen = {control: name for control, name in columns.items() if name is not None} or {"load": "load"}
    if len(chosen) > 1:
        raise InputError(key="load", found=list(chosen), expected="one prescribed column")
    ((control, column),) = chosen.items()
    unit = UNITS[control]
    is_part = isinstance(thin, str) and is_quantity(thin, "1")
    limit = number(thin, "1" if is_part else unit, "thin", least=0)
    offset = number(zero, unit, "zero")
    scale = number(factor, "1", "factor")
    columns_read, lines = read_table(path, {"time": Wanted(time, "s"), control: Wanted(column, unit)})
    measured = columns_read["time"]
    start = float(measured[0])
    falls = np.diff(measured) < 0
    if falls.any():
        row = falls.argmax() + 1
        times_of_rows = f"time {measured[row]:g} s after {measured[row - 1]:g} s"
        raise InputError(f"{path}, line {lines[row]}: {times_of_rows}: expected increasing times")
    is_third = measured[2:] == measured[:-2]
    if is_third.any():
        row = is_third.argmax()
        rows = f"lines {lines[row]} to {lines[row + 2]}: three rows at {measured[row]:g} s"
        raise InputError(f"{path}, {rows}: expected at most two, which are a jump; export more digits")
    times = _less(measured, start)
    values = _less(columns_read[control], offset) * scale
    notes = [f"{start:g} s in the file is time zero"] if start else []
    largest = float(np.max(np.abs(values)))
    lowest = float(values.min())
    if control in LEAST and lowest < 0:
        highest = max(float(values.max()), 0.0)
        if lowest < -_NOISE * highest:
            below = np.flatnonzero(values < -_NOISE * highest)
            expected = f"none below zero by more than {100 * _NOISE:g} % of the largest {control}"
            if -lowest > highest:
                advice = "Does the machine count compression negative? Then factor = -1."
            elif below[0] > values.argmax():
                advice = (
                    "A pull-off is adhesion: prescribe the approach of the record, with adhesion, or delete the rows "
                    f"after the end of the hold, at the latest from line {lines[below[0]]} on ({times[below[0]]:g} s)."
                )
            else:
                advice = "`zero` takes an offset off."
            reached = f"{control} falls to {lowest:.3g} {unit} at {times[values.argmin()]:g} s"
            message = f"{path}: {reached}: expected {expected}. {advice}"
            raise InputError(message, key=control, found=lowest, expected=expected)
        notes.append(f"{(values < 0).sum()} rows below zero count as zero, the lowest {lowest:.3g} {unit}")
        values = np.maximum(values, 0.0)
    tolerance = limit * largest if is_part else limit
    if abs(values[0]) <= tolerance:
        values[0] = 0.0
    kept = thinned(times, values, tolerance)
    lead = f"{Path(path).name}: {len(times):,} rows became {len(kept) - (values[0] == 0):,} segments"
    if tolerance:
        lead += f", which pass every row within {tolerance:.3g} {unit}"
    return control, times[kept].tolist(), values[kept].tolist(), "; ".join([lead, *notes]) + "."


def _less(values: Array, zero: float) -> Array:
    """Return a copy of values minus their zero, rounded to 12 digits."""
    return np.array([float(f"{value - zero:.12g}") for value in values.tolist()]) if zero else values.copy()


def thinned(times: Array, values: Array, tolerance: float) -> NDArray[np.intp]:
    """Return the numbers of the rows to keep, so that linear interpolation between them meets a tolerance at every row.

    Parameters
    ----------
    times, values : ndarray
        Times and values of the rows; two rows at one time are a jump, and both are kept.
    tolerance : float
        In the unit of the values; zero keeps every row.

    Returns
    -------
    ndarray of int
        In ascending order, including the first and the last row.

    Notes
    -----
    From each kept row a line goes to the farthest row that it can reach within the tolerance. The slopes that pass all
    rows in between within the tolerance form a cone, which narrows from row to row.
    """
    if tolerance <= 0:
        return np.arange(len(times))
    time = times.tolist()
    value = values.tolist()
    kept = [0]
    while kept[-1] < len(time) - 1:
        start = kept[-1]
        low = -math.inf
        high = math.inf
        farthest = start + 1
        for row in range(start + 1, len(time)):
            if time[row] == time[row - 1]:  # a jump: the line ends before it
                break
            span = time[row] - time[start]
            rise = value[row] - value[start]
            if low <= rise / span <= high:
                farthest = row
            low = max(low, (rise - tolerance) / span)
            high = min(high, (rise + tolerance) / span)
            if low > high:
                break
        kept.append(farthest)
    return np.array(kept)
