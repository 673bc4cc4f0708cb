"""Refusal of a case that cannot fit into memory, before its arrays are made."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import TooLargeError
from roughvisc.experiment.profile import uses_window
from roughvisc.experiment.resources import Available, curve_bytes, march_bytes, memory_available
from roughvisc.experiment.scene import memory_options
from roughvisc.mechanics.bodies.body import Body
from roughvisc.mechanics.stepping.program import Program
from roughvisc.mechanics.stepping.wave_memory import choose_body_memory
from roughvisc.settings import Settings
from roughvisc.topography.borders import is_mirrored

#: Cells from which it is asked what memory there is: on fewer a march takes less than 100 MB.
WORTH_ASKING = 512**2
#: Part of the memory there is that a case may take.
PART = 0.9
#: No surface is pressed on fewer cells than these without need: the longest stride that is advised leaves them.
_FEWEST = 64
#: Fields of the grid that making or reading a surface takes.
_SURFACE = 4.0


def require_memory(
    shape: tuple[int, int],
    settings: Settings,
    body: Body,
    program: Program,
    *,
    in_memory: bool,
    heights: NDArray[np.float64] | None = None,
    area: float = 1.0,
) -> None:
    """Refuse a case that takes more memory than there is, even if its contact stays sparse.

    Parameters
    ----------
    shape : tuple of int
        Cells of the surface.
    settings, body, program : Settings, Body, Program
        Of the case.
    in_memory : bool
        Whether the kept fields stay in memory.
    heights : ndarray, optional
        Of the surface, if they are there: a surface that is its own mirror image is solved on a quarter. [m]
    area : float
        That a nominal pressure refers to. [m2]

    Raises
    ------
    TooLargeError
        If it does not fit: what it needs, what there is, and what would fit.
    """
    cells = math.prod(shape)
    if cells < WORTH_ASKING:
        return
    memory = choose_body_memory(body, **memory_options(program.on_area(area), settings)).memory
    rows = least_rows(settings, program)
    part = 0.0 if uses_window(settings) and not body.kernel.raises_surface else 1.0

    def needed(cells: float, settings: Settings = settings, *, part: float, in_memory: bool = in_memory) -> float:
        return march_bytes(settings, cells, memory, rows=rows, part=part, in_memory=in_memory)

    there = memory_available()
    if needed(cells, part=part) <= PART * there.size:
        return
    if part and settings.method == "fast" and (heights is None or is_mirrored(heights)):
        part = 0.25
        if needed(cells, part=part) <= PART * there.size:
            return
    refuse(shape, partial(needed, part=part), there, _savings(settings, rows, needed, part, there, cells, in_memory))


def require_memory_of_curve(shape: tuple[int, int], settings: Settings) -> None:
    """Refuse a curve of friction on a surface of so many cells that takes more memory than there is."""
    if math.prod(shape) < WORTH_ASKING:
        return
    needed, there = partial(curve_bytes, settings), memory_available()
    if not _fits(there, needed(math.prod(shape))):
        refuse(shape, needed, there, [])


def require_surface(shape: tuple[int, int]) -> None:
    """Refuse a surface that cannot be made in the memory there is. [cells]"""
    cells = math.prod(shape)
    if cells < WORTH_ASKING:
        return
    there = memory_available()
    if 8.0 * _SURFACE * cells > PART * there.size:
        refuse(shape, lambda cells: 8.0 * _SURFACE * cells, there, [])


def refuse(shape: tuple[int, int], needed: Callable[[float], float], there: Available, savings: list[str]) -> None:
    """Raise what says how much a case needs, how much there is, and what would fit."""
    raise TooLargeError(too_large(shape, needed, there, savings))


def too_large(shape: tuple[int, int], needed: Callable[[float], float], there: Available, savings: list[str]) -> str:
    """What is said of a case that does not fit.

    Parameters
    ----------
    shape : tuple of int
        Cells of the surface.
    needed : callable
        Memory by the number of cells. [byte]
    there : Available
        What there is.
    savings : list of str
        What else would make it fit.
    """
    cells = math.prod(shape)
    advice = [_coarser(shape, needed, there), *savings]
    advice = [one for one in advice if one]
    fitting = f"what would fit: {'; or '.join(advice)}" if advice else "expected more memory, or a coarser grid"
    return (
        f"{shape[0]} x {shape[1]} cells need about {amount(needed(cells))} of memory, and {amount(there.size)} are "
        f"{there.words}: {fitting}"
    )


def _coarser(shape: tuple[int, int], needed: Callable[[float], float], there: Available) -> str:
    """The finest grid of whole strides that fits, in words; empty if none does."""
    for stride in range(2, max(min(shape) // _FEWEST, 1) + 1):
        few = [math.ceil(count / stride) for count in shape]
        if needed(math.prod(few)) <= PART * there.size:
            wanted = f"{few[0]} x {few[1]} cells, {stride} times as long, need {amount(needed(math.prod(few)))}"
            return f"{wanted} (resample = {few} under [surface], rv.resample in Python)"
    return ""


def _savings(
    settings: Settings,
    rows: float,
    needed: Callable[..., float],
    part: float,
    there: Available,
    cells: int,
    in_memory: bool,
) -> list[str]:
    """What fits beside a coarser grid."""
    fits = partial(_fits, there)
    found = []
    if in_memory and fits(needed(cells, part=part, in_memory=False)):
        found.append("rv.run, which keeps the fields in a file")
    if (
        in_memory
        and len(settings.fields) > 1
        and fits(needed(cells, replace(settings, fields=settings.fields[:1]), part=part))
    ):
        found.append(f"one kept field in place of {len(settings.fields)}")
    if (
        settings.boundary == "free"
        and settings.edge == "accept"
        and fits(needed(cells, replace(settings, boundary="periodic"), part=part))
    ):
        found.append("boundary = 'periodic'")
    return found


def _fits(there: Available, size: float) -> bool:
    return size <= PART * there.size


def least_rows(settings: Settings, program: Program) -> float:
    """Kept times, at least."""
    if settings.times is None:
        return float(len(program.segments))
    return float(settings.times if isinstance(settings.times, int) else len(settings.times))


def amount(size: float) -> str:
    """A number of bytes as one reads it.

    Examples
    --------
    >>> amount(2.13e9), amount(350e6), amount(-1)
    ('2.1 GB', '350 MB', '0 MB')
    """
    return f"{size / 1e9:.2g} GB" if size >= 1e9 else f"{max(size, 0) / 1e6:.0f} MB"
