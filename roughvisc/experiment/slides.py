"""Slides of a program on the grid of a surface: what is refused, what is really slid, and when."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from roughvisc.errors import InputError
from roughvisc.mechanics.stepping.program import Program
from roughvisc.mechanics.stepping.slide import instant
from roughvisc.settings import Settings
from roughvisc.units import said

Spacing = tuple[float, float]

#: A slide's cells differ from what was asked for by more than this part of it where that is told.
_TOLD = 1e-9


def check_slides(program: Program, settings: Settings, spacing: Spacing) -> None:
    """Refuse slides that cannot be computed.

    Raises
    ------
    InputError
        Naming the segment or the setting, and what is expected.
    """
    if not program.slides:
        return
    if settings.boundary != "periodic":
        raise InputError(
            "boundary is 'free' and the program slides: in free space the wake of the profile leaves the grid at its "
            "back; expected boundary = 'periodic'"
        )
    if settings.method != "fast":
        raise InputError(
            f"method is {settings.method!r}, which knows no motion along the surface, and the program slides: expected "
            "method = 'fast'"
        )
    if program.segments[0].slide is not None:
        raise InputError("program.0 slides and nothing is pressed yet: expected load, pressure or approach before it")
    for number, segment in enumerate(program.segments):
        if segment.slide is not None:
            try:
                segment.slide.cells(spacing)
            except InputError as error:
                raise InputError(f"program.{number}: {error}") from None


def snap_to_cells(program: Program, times: Sequence[float] | None, *spacings: Spacing) -> tuple[float, ...] | None:
    """Kept times, those within a slide brought to the nearest instant at which whole cells of each grid are behind. [s]

    Parameters
    ----------
    program : Program
        The loading program.
    times : sequence of float or None
        Ascending; None for every accepted step. [s]
    *spacings : tuple of float
        Cell sides of each grid. [m]
    """
    if times is None or not program.slides:
        return None if times is None else tuple(times)
    found = np.array(times)
    corners = program.corners
    for segment, began, end in zip(program.segments, corners, corners[1:], strict=False):
        if segment.slide is None:
            continue
        cells = math.gcd(*(segment.slide.cells(spacing) for spacing in spacings))
        for place in np.flatnonzero((found > began) & (found < end)):
            taken = round((found[place] - began) / (end - began) * cells)
            found[place] = instant(began, end, taken, cells)
    return tuple(np.unique(found).tolist())


def slide_note(program: Program, spacing: Spacing) -> str:
    """What is slid where that is not what was asked for; empty if it is.

    Parameters
    ----------
    program : Program
        The loading program.
    spacing : tuple of float
        Cell sides. [m]
    """
    notes = []
    for number, segment in enumerate(program.segments):
        if segment.slide is None:
            continue
        asked, cells = segment.slide.distance, segment.slide.cells(spacing)
        real = cells * spacing[segment.slide.axis]
        if abs(real - asked) > _TOLD * asked:
            notes.append(f"program.{number} slides {said(real, 'm')}, {cells} whole cells, of {said(asked, 'm')}")
    return "; ".join(notes)
