"""Refusal of programs and loads that floating-point numbers cannot resolve."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.bodies.operator import Boundary
from roughvisc.mechanics.materials.models import Material
from roughvisc.mechanics.stepping.program import Program

#: A segment, or the period of a cycle, is as long as so many roundings of its end: a march may take steps of a
#: millionth of it, and each must move the time.
LEAST_ROUNDINGS = 4e6
#: Times and loads whose squares and products stay far from overflow. [s], [N]
LARGEST = 1e100
#: Displacements of a periodic surface may exceed its heights by so much before their rounding exceeds a tenth of these.
MOST_HEIGHTS = 1e15


def check_times(program: Program, time_step: float | Literal["auto"]) -> None:
    """Refuse a program whose times lie too close for where they are, and steps that would not move the time.

    Raises
    ------
    InputError
        Naming the segment, what its end is known to, and what is expected.
    """
    for i, (segment, end) in enumerate(zip(program.segments, program.corners[1:], strict=True)):
        if segment.duration == 0:
            continue
        shortest, least = min(segment.duration, segment.period), LEAST_ROUNDINGS * math.ulp(end)
        what = "the period of a cycle" if segment.period < segment.duration else "a segment"
        if not (shortest >= 1 / LARGEST and end <= LARGEST):
            raise InputError(
                f"program.{i}: {what} lasts {shortest:g} s and ends by {end:g} s: expected times from "
                f"{1 / LARGEST:g} to {LARGEST:g} s"
            )
        if shortest < least:
            raise InputError(
                f"program.{i}: {what} lasts {shortest:g} s where time has reached {end:g} s, which is known to "
                f"{math.ulp(end):.2g} s: expected at least {least:.2g} s"
            )
    if time_step != "auto" and time_step < 4 * math.ulp(program.duration):
        raise InputError(
            f"time_step is {time_step!r} s and the program ends at {program.duration:g} s, which is known to "
            f"{math.ulp(program.duration):.2g} s: expected a longer step"
        )


def check_loads(
    program: Program, material: Material, boundary: Boundary, sides: tuple[float, float], gap: NDArray[np.float64]
) -> None:
    """Refuse a load under which rounding is all that is left of a surface with these sides [m] and undeformed gaps [m].

    Raises
    ------
    InputError
        If the load is beyond what can be computed with, or presses a periodic surface so far past full contact that
        the pressure's variation is lost in its mean.
    """
    load = program.largest_load
    if load > LARGEST:
        raise InputError(f"the load reaches {load:g} N: expected at most {LARGEST:g} N")
    heights = float(np.ptp(gap))
    if boundary == "free" or heights == 0:
        return
    displaced = load / math.prod(sides) * float(material.contact_compliance(program.duration)) * max(sides)
    if displaced > MOST_HEIGHTS * heights:
        raise InputError(
            f"the load reaches {load:g} N, which would close gaps {displaced / heights:.1g} times as high as this "
            f"surface has: the pressure's variation is lost in its mean; expected at most "
            f"{load * MOST_HEIGHTS * heights / displaced:.1g} N"
        )
