"""Kept times: which instants of a program a result shows with its fields."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.stepping.program import Program, Segment

#: Times that differ by less, in lengths of the program, are one.
_ROUNDING = 1e-12
#: In a hold the first of them lies no later than this part of it. [-]
_FIRST = 1e-3

Array = NDArray[np.float64]


def kept_times(program: Program, times: int | Sequence[float] | None) -> tuple[float, ...] | None:
    """Times to keep, ascending, snapped to the program's corners; those that differ by rounding alone are one. [s]

    Parameters
    ----------
    program : Program
        The loading program.
    times : int, sequence of float or None
        A count, see :func:`spread_times`; a list; None for every accepted step.

    Raises
    ------
    InputError
        If a time lies outside the program.
    """
    if times is None:
        return None
    duration = program.duration
    listed = spread_times(program, times) if isinstance(times, int) else np.unique(np.asarray(times, dtype=float))
    corners = np.array(program.corners)
    kept: list[float] = []
    for value in listed:
        nearest = float(corners[np.argmin(np.abs(corners - value))])
        snapped = nearest if abs(nearest - value) <= _ROUNDING * duration else float(value)
        if not 0 <= snapped <= duration:
            raise InputError(f"times holds {value:g} s: expected times from 0 to the program's end at {duration:g} s")
        if not kept or snapped - kept[-1] > _ROUNDING * duration:
            kept.append(snapped)
    return tuple(kept)


def spread_times(program: Program, count: int) -> Array:
    """So many times where the result changes: the corners of the program, and between them the denser after each.

    Parameters
    ----------
    program : Program
        The loading program.
    count : int
        How many. The last one is the program's end. Where the program has more corners, some of them, evenly.

    Returns
    -------
    ndarray, shape (n,)
        Ascending; fewer than `count` where the program has no duration. [s]

    Notes
    -----
    A hold takes three parts of the times between the corners where a ramp or a slide takes two and a cycle sixteen.
    In a hold they lie evenly in the logarithm of the time since it began, between a third of the segment before it or
    a thousandth of its own length, whichever is less, and its end; elsewhere evenly in time.
    """
    corners = np.unique(program.corners)
    if count <= len(corners):
        return corners[np.linspace(len(corners) - 1, 0, count).round().astype(int)[::-1]]
    lasting = [(began, one) for began, one in zip(program.corners, program.segments, strict=False) if one.duration > 0]
    shares = _apportioned([_weight(segment) for _, segment in lasting], count - len(corners))
    found, before = [corners], math.inf
    for (began, segment), number in zip(lasting, shares, strict=True):
        parts = np.arange(1, number + 1) / (number + 1)
        if segment.holds and number:
            shortest = min(_FIRST, before / (3 * segment.duration))
            parts = shortest ** (1 - parts)
        found.append(began + parts * segment.duration)
        before = segment.duration
    return np.unique(np.concatenate(found))


def _weight(segment: Segment) -> float:
    """How many of the kept times a segment takes, relative to others."""
    if segment.amplitude:
        return 16 * segment.duration / segment.period
    return 3.0 if segment.holds else 2.0


def _apportioned(weights: Sequence[float], count: int) -> list[int]:
    """Whole numbers in proportion to weights, that add up to a count: those rounded up have the largest remainders."""
    if not weights:
        return []
    exact = np.array(weights) * count / sum(weights)
    whole = np.floor(exact).astype(int)
    order = np.argsort(whole - exact, kind="stable")
    whole[order[: count - int(whole.sum())]] += 1
    return [int(number) for number in whole]
