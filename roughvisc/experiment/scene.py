"""From labelled to plain arrays: surface, material, program and settings become the scene of a run.

Refused here is what floating-point numbers cannot resolve, and what does not go together.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from roughvisc.errors import ConvergenceError, InputError
from roughvisc.experiment.kept_times import kept_times
from roughvisc.experiment.profile import Domain, Profile
from roughvisc.mechanics.body import Body, has_finite_mean
from roughvisc.mechanics.contact import solve_contact
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.layer import LayeredBody
from roughvisc.mechanics.layer_memory import LayerMemory
from roughvisc.mechanics.memory_choice import SERIES_SHARE, Choice, choose_memory
from roughvisc.mechanics.program import Program
from roughvisc.mechanics.stepping import SHORTEST_PAIR, Scene
from roughvisc.settings import Settings

#: Times and loads whose squares and products stay far from overflow. [s], [N]
LARGEST = 1e100
#: A segment, or the period of a cycle, lasts at least this many units in the last place of its end: time steps of a
#: millionth of it must move the time.
LEAST_ROUNDINGS = 4e6
#: Displacements of a periodic surface may exceed its heights by this factor before their rounding exceeds a tenth of
#: these.
MOST_HEIGHTS = 1e15


def check_program(profile: Profile, body: Body, program: Program, settings: Settings) -> None:
    """Refuse surface, material, program and settings that do not go together.

    Parameters
    ----------
    profile : Profile
        The surface.
    body, program, settings
        Of the case; the program has loads in place of nominal pressures.

    Raises
    ------
    InputError
        Naming the segment or the setting, and what is expected.
    """
    if not program.segments:
        raise InputError("the program is empty: expected at least one segment")
    boundary = settings.boundary
    for number, (segment, end) in enumerate(zip(program.segments, program.corners[1:], strict=True)):
        where, shortest = f"program.{number}", min(segment.duration, segment.period)
        what = "the period of a cycle" if segment.period < segment.duration else "a segment"
        if segment.duration > 0 and not (shortest >= 1 / LARGEST and end <= LARGEST):
            raise InputError(
                f"{where}: {what} lasts {shortest:g} s and ends by {end:g} s: expected times from "
                f"{1 / LARGEST:g} to {LARGEST:g} s"
            )
        if segment.duration > 0 and shortest < LEAST_ROUNDINGS * math.ulp(end):
            raise InputError(
                f"{where}: {what} lasts {shortest:g} s where time has reached {end:g} s, which has a resolution of "
                f"{math.ulp(end):.2g} s: expected at least {LEAST_ROUNDINGS * math.ulp(end):.2g} s"
            )
        if segment.slide is not None:
            if boundary == "mirror":
                raise InputError(
                    key="boundary",
                    found="mirror",
                    expected="'periodic' for a program that slides, on the unfolded surface rv.mirror(height): mirror "
                    "images would slide towards each other",
                )
            if boundary != "periodic":
                raise InputError(
                    "boundary is 'free' and the program slides: in free space the wake of the profile leaves the grid "
                    "at its back; expected boundary = 'periodic'"
                )
            if number == 0:
                raise InputError(f"{where} slides before there is a load: expected load, pressure or approach before")
            try:
                segment.slide.cells(profile.spacing)
            except InputError as error:
                raise error.prefixed(where) from None
    duration = program.duration
    if settings.time_step != "auto" and settings.time_step < 4 * math.ulp(duration):
        raise InputError(
            f"time_step is {settings.time_step!r} s and the program ends at {duration:g} s, which has a resolution of "
            f"{math.ulp(duration):.2g} s: expected a longer step"
        )
    load, heights = program.largest_load, float(np.ptp(profile.gap[profile.present]))
    if load > LARGEST:
        raise InputError(f"the load reaches {load:g} N: expected at most {LARGEST:g} N")
    if boundary != "free" and heights > 0:
        # as if the whole surface gave way like a punch of its longer side
        compliance = float(body.material.contact_compliance(duration))
        sides = profile.gap.shape[0] * profile.spacing[0], profile.gap.shape[1] * profile.spacing[1]
        displaced = load / math.prod(sides) * compliance * max(sides)
        if displaced > MOST_HEIGHTS * heights:
            raise InputError(
                f"the load reaches {load:g} N, which would close gaps {displaced / heights:.1g} times as high as this "
                f"surface has: rounding would hide the variation of the pressure; expected at most "
                f"{load * MOST_HEIGHTS * heights / displaced:.1g} N"
            )
    # Beyond full contact an approach has no pressure. Where cells are absent the body bulges into them, and every
    # approach has its force.
    if boundary != "free" and profile.all_present and not has_finite_mean(profile.kernel):
        for number, segment in enumerate(program.segments):
            largest = (segment.end or 0.0) + abs(segment.amplitude)
            if segment.control == "approach" and segment.end is not None and largest >= profile.mean_gap:
                raise InputError(
                    f"program.{number}: approach goes to {largest:.6g} m, and with {boundary} boundaries contact is "
                    f"full at {profile.mean_gap:.6g} m: expected less"
                )


def build_scene(
    profile: Profile, domain: Domain, body: Body, program: Program, settings: Settings
) -> tuple[Scene, Choice]:
    """Return the scene of a case, and what represents its material.

    Parameters
    ----------
    profile : Profile
        The surface.
    domain : Domain
        Part of the surface that is solved on.
    body, program, settings
        Of the case; the program has loads in place of nominal pressures.
    """
    gap = np.ascontiguousarray(profile.gap[domain.cells])
    grid = Grid((gap.shape[0], gap.shape[1]), profile.spacing, settings.boundary, kernel=profile.kernel)
    keeps = not domain.is_whole
    choice = choose_memory(body, **memory_options(program, settings), grid=grid, keeps_pressure=keeps)
    if isinstance(body, LayeredBody):
        _check_layers(body, choice, grid, program, settings, profile)
    scene = Scene(
        grid=grid,
        gap=gap,
        memory=choice.memory,
        program=program,
        kept=kept_times(program, settings.times, profile.spacing),
        tolerance=settings.tolerance,
        time_step=None if settings.time_step == "auto" else settings.time_step,
        present=None if profile.all_present else profile.present[domain.cells],
    )
    return scene, choice


#: Compliance of the longest wave of a grid over that of the shortest, from which the contact may not converge.
_STIFF_LAYERS = 100.0
#: Parts of the largest load and approach at which the contact is tried.
_TRIED = (1.0, 0.1, 0.01)


def _check_layers(
    body: LayeredBody, choice: Choice, operator: Grid, program: Program, settings: Settings, profile: Profile
) -> None:
    """Refuse stiff layers on a soft base whose contact does not converge, before anything is computed.

    Their elastic contact is tried at the largest load or approach, with the first and with the last compliance.
    """
    segments, gap, present = program.segments, profile.gap, None if profile.all_present else profile.present
    parts = _TRIED if program.duration > 0 else _TRIED[:1]  # jumps pass no smaller loads
    kernels: list[tuple[Any, float]] = [(body.kernel, float(choice.material.contact_compliance(program.duration)))]
    if isinstance(choice.memory, LayerMemory):
        waves = choice.memory.waves
        kernels = [(waves.kernel(), 1.0), (waves.kernel(waves.crept(program.duration)), 1.0)]
    for kernel, compliance in kernels:
        contrast = kernel.contrast(*operator.wave_numbers)
        if contrast < _STIFF_LAYERS:
            continue
        grid = operator.answering(operator.symbol_of(kernel), kernel)
        unit, tolerance = compliance / grid.cell_area, 0.2 * settings.tolerance
        for control in ("load", "approach"):
            largest = max(((s.end or 0.0) + abs(s.amplitude) for s in segments if s.control == control), default=0.0)
            for value in (part * largest for part in parts if largest > 0):
                load, approach = (value * unit, None) if control == "load" else (None, value)
                try:
                    solve_contact(grid, gap, load=load, approach=approach, tolerance=tolerance, present=present)
                except ConvergenceError as error:
                    raise InputError(
                        f"material is {body!r}, whose longest waves on these cells are {contrast:.3g} times as "
                        f"compliant as the shortest, and {error}: expected layers whose moduli differ less, fewer "
                        "cells, a smaller load or a looser tolerance",
                        key="material",
                        found=body,
                    ) from error


def memory_options(program: Program, settings: Settings) -> dict[str, Any]:
    """Return the arguments of :func:`~roughvisc.mechanics.memory_choice.choose_memory` that do not depend on the body.

    Notes
    -----
    ``shortest`` is the shortest age, next to zero, at which the compliance matters to the kept rows; zero for a program
    of jumps alone. The shortest interval ``h`` lies between a corner of the program and the kept time after it. Ages
    below ``f h`` only belong to pressure that came in the last part ``f`` of the interval. There a compliance that
    starts from the right value is wrong by at most the creep, which is less than ``f C(h)`` over the interval. With a
    tenth of the tolerance for ``f`` this is as large as the error allowed beyond. No step is shorter than a millionth
    of a segment, so a smaller ``f`` is not needed.
    """
    shortest, kept = math.inf, kept_times(program, settings.times)
    for segment in program.segments:
        if segment.duration > 0:
            shortest = min(shortest, segment.duration, segment.period)
    if math.isinf(shortest):
        shortest = 0.0
    elif kept is None:
        shortest *= SHORTEST_PAIR
    else:
        corners, times = np.array(program.corners), np.array(kept)
        after = np.searchsorted(times, corners, side="right")
        corners, after = corners[after < times.size], after[after < times.size]
        shortest = min(shortest, float(np.min(times[after] - corners, initial=math.inf)))
        shortest *= max(SERIES_SHARE * settings.tolerance, SHORTEST_PAIR)
    return {"duration": program.duration, "tolerance": settings.tolerance, "shortest": shortest}
