"""Times at which the rows of a program are kept."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.program import Program, instant

Array = NDArray[np.float64]
#: Times that differ by at most this many units in the last place are equal: rounding of sums and logarithms of times.
_ROUNDING = 64
#: Start of the logarithmic spacing of kept times in a hold, as a part of the hold, at most. [-]
_FIRST = 1e-3
#: Relative numbers of kept times of a ramp or a slide, a hold, and a period of a cycle.
_RAMP = 2.0
_HOLD = 3.0
_PERIOD = 16.0


def kept_times(
    program: Program, times: int | Sequence[Any] | None, *spacings: tuple[float, float]
) -> tuple[float, ...] | None:
    """Return the times to keep, ascending. [s]

    Times within rounding of a corner of the program are moved to the corner. Times in a slide are moved to the nearest
    time at which a whole number of cells has been slid.

    Parameters
    ----------
    program : Program
        The loading program.
    times : int, sequence of float or None
        Number of times, see :func:`spread_times`; or the times [s]; or None for every accepted step.
    *spacings : tuple of float
        Cell sides of each grid that slides. [m]

    Raises
    ------
    InputError
        If a time lies outside the program.
    """
    if times is None:
        return None
    corners = np.array(program.corners)
    duration = program.duration
    kept: list[float] = []
    for value in spread_times(program, times) if isinstance(times, int) else np.unique(np.asarray(times, dtype=float)):
        nearest = float(corners[np.argmin(np.abs(corners - value))])
        snapped = nearest if abs(nearest - value) <= _ROUNDING * math.ulp(nearest) else float(value)
        if not 0 <= snapped <= duration:
            raise InputError(f"times holds {value:g} s: expected times from 0 to the program's end at {duration:g} s")
        if not kept or snapped - kept[-1] > _ROUNDING * math.ulp(snapped):
            kept.append(snapped)
    if not (spacings and program.slides):
        return tuple(kept)
    instants = np.array(kept)
    for segment, began, end in zip(program.segments, program.corners, program.corners[1:], strict=False):
        if segment.slide is not None:
            cells = math.gcd(*map(segment.slide.cells, spacings))
            for place in np.flatnonzero((instants > began) & (instants < end)):
                taken = round((instants[place] - began) / (end - began) * cells)
                instants[place] = instant(began, end, taken, cells)
    return tuple(np.unique(instants).tolist())


def spread_times(program: Program, count: int) -> Array:
    """Return a number of times, spread over the program; they are denser where the result changes faster.

    Parameters
    ----------
    program : Program
        The loading program.
    count : int
        Number of times. If the program has more corners, an even selection of corners is kept, with the last one.

    Returns
    -------
    ndarray, shape (n,)
        Ascending; fewer than `count` if the program has no duration. [s]

    Notes
    -----
    All corners of the program are kept. The other times are distributed in the proportion of two per ramp or slide,
    three per hold and sixteen per period of a cycle. In a hold they are spaced evenly in the logarithm of the time
    since its start. This spacing begins at a third of the segment before or a thousandth of the hold, whichever is
    less. In other segments the times are spaced evenly.
    """
    corners = np.unique(program.corners)
    further = count - len(corners)
    if further <= 0:
        return corners[np.linspace(len(corners) - 1, 0, count).round().astype(int)[::-1]]
    weights = np.zeros(len(program.segments))
    for row, segment in enumerate(program.segments):
        if segment.duration > 0:
            periods = segment.duration / segment.period if segment.amplitude else 0.0
            weights[row] = _PERIOD * periods if periods else _HOLD if segment.holds else _RAMP
    if not weights.any():
        return corners
    exact = weights * further / weights.sum()
    numbers = np.floor(exact).astype(int)
    largest_remainders = np.argsort(numbers - exact, kind="stable")[: further - int(numbers.sum())]
    numbers[largest_remainders] += 1

    places = [corners]
    before = math.inf
    for began, segment, many in zip(program.corners, program.segments, numbers, strict=False):
        if segment.duration > 0:
            parts = np.arange(1, many + 1) / (many + 1)
            if segment.holds and many:
                parts = min(_FIRST, before / (3 * segment.duration)) ** (1 - parts)
            places.append(began + parts * segment.duration)
            before = segment.duration
    return np.unique(np.concatenate(places))
