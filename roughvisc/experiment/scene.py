"""From labelled to plain arrays: surface, material, program and settings become the scene of a march."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from roughvisc.errors import InputError
from roughvisc.experiment.kept_times import kept_times
from roughvisc.experiment.profile import Profile
from roughvisc.experiment.representable import check_loads, check_times
from roughvisc.experiment.slides import check_slides, snap_to_cells
from roughvisc.mechanics.bodies.kernel import has_finite_mean
from roughvisc.mechanics.bodies.operator import HalfSpace
from roughvisc.mechanics.contact import solve_contact
from roughvisc.mechanics.hereditary.choice import SERIES_SHARE, Choice, choose_memory
from roughvisc.mechanics.hereditary.exponentials import ActsOn
from roughvisc.mechanics.materials.models import Material
from roughvisc.mechanics.materials.protocol import complete
from roughvisc.mechanics.stepping.control import SMALLEST_STEP
from roughvisc.mechanics.stepping.program import Program
from roughvisc.mechanics.stepping.scene import Scene
from roughvisc.settings import Settings

#: Cells of the longer side on which the window after a jump at the start is foreseen.
_FORESEEN_ON = 40


def build_scene(profile: Profile, material: Material, program: Program, settings: Settings) -> tuple[Scene, Choice]:
    """Scene of a case and what models its material.

    Raises
    ------
    InputError
        If surface, material, program and settings do not go together; nothing has been computed then.
    """
    program = program.on_area(profile.nominal_area)
    if not program.segments:
        raise InputError("the program is empty: expected at least one segment")
    check_times(program, settings.time_step)
    check_slides(program, settings, profile.spacing)
    material = complete(material)
    (nx, ny), (dx, dy) = profile.height.shape, profile.spacing
    check_loads(program, material, settings.boundary, (nx * dx, ny * dy), profile.gap[profile.present])
    if settings.boundary == "periodic" and profile.present.all() and not has_finite_mean(profile.kernel):
        _check_approach(program, profile.mean_gap)
    foreseen = 0.0 if profile.window.whole else _foreseen(profile, program, material)
    while profile.window.outside <= foreseen:
        profile.widen_window()
    grows = not profile.window.whole or (
        settings.boundary == "free" and settings.edge == "error" and profile.can_grow()
    )
    choice = choose_memory(material, **memory_options(program, settings, "pressure" if grows else "displacement"))
    scene = Scene(
        halfspace=profile.halfspace(settings.boundary),
        material=choice.material,
        memory=choice.memory,
        program=program,
        times=snap_to_cells(program, kept_times(program, settings.times), profile.spacing),
        tolerance=settings.tolerance,
        time_step=None if settings.time_step == "auto" else settings.time_step,
        accept_edge=settings.edge == "accept",
        enlarge=profile.enlarge if grows else None,
        **profile.of_scene(),
    )
    return scene, choice


def _foreseen(profile: Profile, program: Program, material: Material) -> float:
    """About the approach right after a jump at the start, from every so-many-eth cell; zero if there is none. [m]"""
    segment, glassy = program.segments[0], float(material.contact_compliance(0.0))
    value = segment.end or 0.0
    if segment.duration > 0 or value <= 0 or glassy <= 0:
        return 0.0
    if segment.control == "approach":
        return value
    stride = math.ceil(max(profile.height.shape) / _FORESEEN_ON)
    gap = profile.gap[::stride, ::stride]
    dx, dy = (stride * side for side in profile.spacing)
    halfspace = HalfSpace((gap.shape[0], gap.shape[1]), (dx, dy), mirrored=profile.mirrored, kernel=profile.kernel)
    load = value * glassy / halfspace.cell_area
    return solve_contact(halfspace, gap, load=load, tolerance=1e-2, max_iterations=50).approach


def _check_approach(program: Program, full: float) -> None:
    """Refuse an approach beyond the one of full contact, which has none: pressure may rise without limit there.

    Where cells are absent the half-space bulges into them, and every approach has its force.
    """
    for i, segment in enumerate(program.segments):
        largest = (segment.end or 0.0) + abs(segment.amplitude)
        if segment.control == "approach" and segment.end is not None and largest >= full:
            raise InputError(
                f"program.{i}: approach goes to {largest:.6g} m, and with periodic boundaries contact is full at "
                f"{full:.6g} m: expected less"
            )


def memory_options(program: Program, settings: Settings, acts_on: ActsOn = "displacement") -> dict[str, Any]:
    """What :func:`~roughvisc.mechanics.hereditary.choice.choose_memory` is to be asked for, whatever the material."""
    return {
        "duration": program.duration,
        "tolerance": settings.tolerance,
        "acts_on": acts_on,
        "kind": settings.memory,
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
        return SMALLEST_STEP * min(spans)
    times = np.array(sorted(kept))
    after = [times[times > corner][:1] - corner for corner in program.corners]
    return float(min([*spans, *np.concatenate(after)])) * max(SERIES_SHARE * tolerance, SMALLEST_STEP)
