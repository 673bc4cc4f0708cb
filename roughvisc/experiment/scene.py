"""From labelled to plain arrays: surface, material, program and settings become the scene of a march.

Refused here is what floating-point numbers cannot resolve, and slides that do not go with the grid.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import ConvergenceError, InputError
from roughvisc.experiment.domain import GROWTH, Domain, choose_domain, estimated, whole_domain
from roughvisc.experiment.profile import Profile
from roughvisc.mechanics.body import Body, has_finite_mean
from roughvisc.mechanics.contact import solve_contact
from roughvisc.mechanics.grid import Boundary, Grid
from roughvisc.mechanics.layer import LayeredBody
from roughvisc.mechanics.layer_memory import LayerMemory
from roughvisc.mechanics.materials.creep import Material, complete
from roughvisc.mechanics.memory_choice import SERIES_SHARE, Choice, choose_memory
from roughvisc.mechanics.program import Program, Segment, instant
from roughvisc.mechanics.stepping import SHORTEST_PAIR, Scene
from roughvisc.settings import Settings
from roughvisc.units import said

#: Times that differ by at most this many units in the last place are one: sums and logarithms of times err by a few.
_ROUNDING = 64
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
        snapped = nearest if abs(nearest - value) <= _ROUNDING * math.ulp(nearest) else float(value)
        if not 0 <= snapped <= duration:
            raise InputError(f"times holds {value:g} s: expected times from 0 to the program's end at {duration:g} s")
        if not kept or snapped - kept[-1] > _ROUNDING * math.ulp(snapped):
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
                f"program.{i}: {what} lasts {shortest:g} s where time has reached {end:g} s, which has a resolution of "
                f"{math.ulp(end):.2g} s: expected at least {least:.2g} s"
            )
    if time_step != "auto" and time_step < 4 * math.ulp(program.duration):
        raise InputError(
            f"time_step is {time_step!r} s and the program ends at {program.duration:g} s, which has a resolution of "
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
        rounding would hide the variation of the pressure.
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
            f"surface has: rounding would hide the variation of the pressure; expected at most "
            f"{load * MOST_HEIGHTS * heights / displaced:.1g} N"
        )


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
    if settings.boundary == "mirror":
        raise InputError(
            key="boundary",
            found="mirror",
            expected="'periodic' for a program that slides, on the unfolded surface rv.mirror(height): mirror images "
            "would slide towards each other",
        )
    if settings.boundary != "periodic":
        raise InputError(
            "boundary is 'free' and the program slides: in free space the wake of the profile leaves the grid at its "
            "back; expected boundary = 'periodic'"
        )
    if program.segments[0].slide is not None:
        raise InputError("program.0 slides before there is a load: expected load, pressure or approach before it")
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


def check_program(profile: Profile, body: Body, program: Program, settings: Settings) -> None:
    """Refuse surface, material, program and settings that do not go together.

    Raises
    ------
    InputError
        Naming the segment or the setting, and what is expected.
    """
    program = program.on_area(profile.nominal_area)
    if not program.segments:
        raise InputError("the program is empty: expected at least one segment")
    check_times(program, settings.time_step)
    check_slides(program, settings, profile.spacing)
    (nx, ny), (dx, dy) = profile.height.shape, profile.spacing
    material = complete(body.material)
    check_loads(program, material, settings.boundary, (nx * dx, ny * dy), profile.gap[profile.present])
    if settings.boundary != "free" and profile.all_present and not has_finite_mean(profile.kernel):
        _check_approach(program, profile.mean_gap, settings.boundary)


def build_scene(
    profile: Profile, body: Body, program: Program, settings: Settings, domain: Domain | None = None
) -> tuple[Scene, Choice]:
    """Return the scene of a case, and what represents its material.

    Parameters
    ----------
    profile : Profile
        The surface.
    body, program, settings
        Of the case.
    domain : Domain, optional
        Part of the surface that is solved on. Default: all of it.

    """
    program = program.on_area(profile.nominal_area)
    domain = domain or whole_domain(profile.gap, profile.spacing, profile.kernel)
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
        kept=snap_to_cells(program, kept_times(program, settings.times), profile.spacing),
        tolerance=settings.tolerance,
        time_step=None if settings.time_step == "auto" else settings.time_step,
        present=None if profile.all_present else profile.present[domain.cells],
    )
    return scene, choice


def domain_of(profile: Profile, body: Body, program: Program, settings: Settings, growths: int) -> Domain:
    """Return the part of a surface that is solved on, after it has been outgrown a number of times."""
    whole = whole_domain(profile.gap, profile.spacing, profile.kernel)
    if not may_crop(profile, body, settings):
        return whole
    program = program.on_area(profile.nominal_area)
    compliance = float(complete(body.material).contact_compliance(program.duration))
    approach, _ = estimated(profile.height, profile.kernel, compliance, program)
    return choose_domain(profile.gap, profile.spacing, profile.kernel, approach * GROWTH**growths)


def may_crop(profile: Profile, body: Body, settings: Settings) -> bool:
    """Return whether a part of the surface may stand for all of it."""
    free = settings.boundary == "free" and settings.edge == "error"
    return free and body.separates and profile.all_present and not profile.kernel.raises_surface


def _check_approach(program: Program, full: float, boundary: Boundary) -> None:
    """Refuse an approach beyond the one of full contact, which has none: pressure may rise without limit there.

    Where cells are absent the half-space bulges into them, and every approach has its force.
    """
    for i, segment in enumerate(program.segments):
        largest = (segment.end or 0.0) + abs(segment.amplitude)
        if segment.control == "approach" and segment.end is not None and largest >= full:
            raise InputError(
                f"program.{i}: approach goes to {largest:.6g} m, and with {boundary} boundaries contact is full at "
                f"{full:.6g} m: expected less"
            )


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
    """What :func:`~roughvisc.mechanics.memory_choice.choose_memory` is to be asked for, whatever the material."""
    return {
        "duration": program.duration,
        "tolerance": settings.tolerance,
        "shortest": shortest_age(program, kept_times(program, settings.times), settings.tolerance),
    }


def shortest_age(program: Program, kept: Sequence[float] | None, tolerance: float) -> float:
    """Shortest age, beside zero, at which the compliance matters to what is kept. [s]

    Parameters
    ----------
    program : Program
        The loading program.
    kept : sequence of float or None
        Kept times, None for every accepted step. [s]
    tolerance : float
        Relative error that is allowed.

    Returns
    -------
    float
        Zero for a program of jumps alone.

    Notes
    -----
    What is kept soonest after a corner of the program resolves the shortest interval. Pressure that came in the last
    part ``f`` of an interval ``h`` is all that meets ages below ``f h``. What a compliance that ascends from the right
    value at age zero can be wrong by there is the creep till then: for the whole interval less than ``f`` of
    ``C(h)``. With a tenth of the tolerance for ``f`` that is as much as the error beyond may be. Steps below a
    millionth of a segment are not taken, so that ``f`` need not be less.
    """
    spans = [min(segment.duration, segment.period) for segment in program.segments if segment.duration > 0]
    if not spans:
        return 0.0
    if kept is None:
        return SHORTEST_PAIR * min(spans)
    times = np.array(sorted(kept))
    after = [times[times > corner][:1] - corner for corner in program.corners]
    return float(min([*spans, *np.concatenate(after)])) * max(SERIES_SHARE * tolerance, SHORTEST_PAIR)
