"""The march through a slide: one cell a step, in the frame of the profile.

The body moves backwards under the profile. Before each step what belongs to the body, its memory first of all, moves by
one cell, whole and without interpolation; then the step is an elastic contact problem as ever. Pressure is nearly
steady in the frame of the profile, so that the last one, where it was, is the first guess. The companion takes two
cells at once, and tells what the length of the steps leaves unknown: that falls with the cells alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from roughvisc.errors import InputError
from roughvisc.mechanics.sparse import Sparse
from roughvisc.mechanics.stepping.companion import (
    behind,
    coarse_initial_guess,
    coarse_step,
    with_error_estimate,
    with_uncertainty,
)
from roughvisc.mechanics.stepping.controller import rule_for
from roughvisc.mechanics.stepping.program import Segment, Slid, Slide, instant
from roughvisc.mechanics.stepping.scene import Scene
from roughvisc.mechanics.stepping.state import (
    AnyTrajectory,
    Guess,
    Instant,
    State,
    Step,
    Trajectory,
    Trial,
    Uncertainty,
)
from roughvisc.mechanics.stepping.step import accept, restarted, start_segment, step_of, trial_step
from roughvisc.mechanics.stepping.tangential import tangential_force

# Of the contact solver's tolerance elsewhere. A slow slide changes the pressure by less than that in a step, and its
# friction is a small part of it.
_SHARE = 0.3
_COMPANION_SHARE = 2.5


def through_slide(scene: Scene, state: State, segment: Segment) -> Iterator[Step]:
    """Accepted steps through a slide; the last one has entered the next segment.

    Parameters
    ----------
    scene, state : Scene, State
        What is prescribed, and how far it has come: into the slide, as far as a step of it.
    segment : Segment
        The slide.

    Raises
    ------
    InputError
        If the slide is shorter than half a cell, or the surface is not periodic.
    """
    assert segment.slide is not None
    if scene.operator.boundary != "periodic":
        raise InputError("a profile slides with periodic boundaries alone: expected boundary = 'periodic'")
    cells = segment.slide.cells(scene.operator.spacing)
    end, length = scene.program.corners[state.segment + 1], segment.duration / cells
    while state.now.time < end:
        taken = round((state.now.time - state.began) / length)
        step = _further(scene, state, segment, instant(state.began, end, taken + 1, cells), length)
        state = step.state
        yield step
        del step


def _further(scene: Scene, state: State, segment: Segment, arrival: float, length: float) -> Step:
    """The step over the next cell, with what the companion says of it where it has come along."""
    assert segment.slide is not None
    end = scene.program.corners[state.segment + 1]
    trial = _tried(scene, state, segment, arrival, length, 1, _SHARE, coarse_initial_guess(state.now))
    moved = _moved(scene, state, segment.slide, 1)
    # the step before is kept as the profile saw it
    accepted = accept(scene, moved, trial, replace(moved.pace, ignore_pressure_error=False), before=state.now)
    accepted = replace(accepted, slid=_path(scene, state, accepted, segment.slide))
    if state.unresolved:
        accepted = restarted(scene, accepted, 0.0)
    companion_trial, earlier = None, state.companion
    if scene.is_viscoelastic and state.behind == 0 and arrival < end:
        accepted = replace(accepted, **behind(state))
    elif earlier is not None:
        cells = state.behind + 1
        guess = coarse_initial_guess(accepted.now, earlier.now, state.before if state.behind else None)
        companion_trial = _tried(scene, earlier, segment, arrival, length, cells, _COMPANION_SHARE * _SHARE, guess)
        accepted = coarse_step(scene, accepted, _moved(scene, earlier, segment.slide, cells), companion_trial)
    if arrival == end:
        accepted = start_segment(scene, accepted)
    step = step_of(scene, accepted, trial)
    if companion_trial is None or earlier is None:
        return step
    wants_area = scene.keeps(arrival) or (state.behind > 0 and scene.keeps(state.now.time))
    entered = Sparse.of(_rolled(earlier.now.pressure, segment.slide, state.behind + 1))
    step = with_error_estimate(scene, step, companion_trial, entered, wants_area)
    step = replace(step, state=replace(step.state, slid=_sharpened(step, state.uncertainty)))
    if scene.is_viscoelastic and segment.slide.cells(scene.operator.spacing) == 1:  # no step twice as long is known
        force = abs(tangential_force(scene.operator, step.shown.pressure, step.displacement, segment.slide))
        step = with_uncertainty(step, replace(step.uncertainty, friction=force))
    # after a single step the companion knows no more than before
    return step if state.behind else with_uncertainty(step, step.uncertainty.or_worse(state.uncertainty, 0.0))


def _tried(
    scene: Scene,
    state: Trajectory,
    segment: Segment,
    arrival: float,
    length: float,
    cells: int,
    share: float,
    guess: Guess,
) -> Trial:
    """A step over so many cells, each of which takes a length. [s]"""
    assert segment.slide is not None
    value = segment.value(arrival, state.start)  # it is held
    body, rule = _moved(scene, state, segment.slide, cells), rule_for(scene, state, cells * length)
    step, control = cells * length, segment.control
    trial = trial_step(scene, body, control, value, step, rule, share, guess, arrival=arrival)
    return replace(trial, slides=True)


def _path(scene: Scene, state: State, accepted: State, slide: Slide) -> Slid:
    """How far the profile has come with a step. What is controlled is held: so much is the work of the normal force."""
    before = state.slid or Slid()
    normal = accepted.now.force * (accepted.now.approach - state.now.approach)
    side = scene.operator.spacing[slide.axis]
    return Slid(before.distance + side, before.work + (accepted.work - state.work) - normal)


def _sharpened(step: Step, earlier: Uncertainty) -> Slid | None:
    """How far the profile has come, its work without the leading part of what the steps have added since earlier."""
    slid, now = step.state.slid, step.uncertainty
    added = now.stored_excess - earlier.stored_excess + now.dissipated_excess - earlier.dissipated_excess
    return None if slid is None else replace(slid, work=slid.work - added)


def _moved(scene: Scene, state: AnyTrajectory, slide: Slide, cells: int) -> AnyTrajectory:
    """State of the body as it lies under the profile when that has moved by so many cells."""

    def moved(one: Instant) -> Instant:
        displacement = None if one.unit_displacement is None else _rolled(one.unit_displacement, slide, cells)
        contact = Sparse.of(_rolled(one.pressure, slide, cells))
        return replace(one, contact=contact, unit_displacement=displacement)

    return replace(
        state,
        now=moved(state.now),
        memory=scene.memory.roll(state.memory, slide.sense * cells, slide.axis),
    )


def _rolled(field: np.ndarray, slide: Slide, cells: int) -> np.ndarray:
    return np.roll(field, -slide.sense * cells, slide.axis)
