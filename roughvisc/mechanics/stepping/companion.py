"""Error of the time steps, estimated by a companion march in steps twice as long.

The rules for a step are of second order, so that the companion is about four times as far off and the difference is
three times the error; where they are of first order, because contact jumps or creep is not resolved, it is the error.
Energies are sums over the steps, whose error follows the second order closely: its leading part is taken off.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.arrays import cut_at_zero, empty, over_blocks, weighted
from roughvisc.mechanics.hereditary.memory import Rule
from roughvisc.mechanics.sparse import Sparse, Sum
from roughvisc.mechanics.stepping.controller import rule_for
from roughvisc.mechanics.stepping.program import Segment
from roughvisc.mechanics.stepping.scene import Scene
from roughvisc.mechanics.stepping.state import (
    ControllerState,
    Guess,
    Instant,
    State,
    Step,
    Trajectory,
    Trial,
    Uncertainty,
)
from roughvisc.mechanics.stepping.step import (
    advance_trajectory,
    cost_after,
    displacement_after,
    is_outgrown,
    segment_number,
    trial_step,
    without_past,
)
from roughvisc.mechanics.stepping.tangential import tangential_force

Array = NDArray[np.float64]

# The companion's contact is solved to so many times the tolerance of the march's.
_SHARE = 2.5
# Where steps double from one to the next, those of the companion grow fourfold.
_GROWTH = 4.1
#: Of the difference to the companion, what is stated as the error: three times it (second order) or all of it (first
#: order). Measured on workflows/benchmarks/accuracy.py: with 0.6, one row in fifteen was less accurate than stated.
STATED = 1.0
# The same of a force that is not given, and of energies, from which a third of the difference is taken off.
_STATED_FORCE, _STATED_ENERGY = 0.8, 0.7
# The same where hardly any compliance is there at once: both marches then miss some part of each jump.
_STATED_SOFT, _STATED_SOFT_ENERGY = 1.1, 1.2
# There, pressure jumps in each cell that enters. In doubt are so many times the pressure of cells that have entered
# within the companion's step; and of the mean pressure for each cell that march and companion disagree on, where hardly
# any of the step's own compliance is there at once.
_ENTERED, _ENTERING = 0.3, 2.5
# Part of what is stated of the work that counts where steps are shortened, since it is some times the error; and the
# same where hardly any compliance is there at once.
_USED_BY_WORK, _USED_BY_SOFT_WORK = 0.5, 0.25


def behind(state: State) -> dict[str, Any]:
    """Fields of the state after a step that the companion does not take.

    The companion stays where it is; if there was none, it starts as a copy of the state before that step.
    """
    companion = state.companion
    if companion is None:
        own = {part.name: getattr(state, part.name) for part in fields(Trajectory)}
        companion = Trajectory(**own | {"before": state.before and state.before.without_fields()})
    return {"companion": companion, "behind": 1}


def coarse_initial_guess(now: Instant, companion: Instant | None = None, together: Instant | None = None) -> Guess:
    """First guess of the companion's contact: as far from the state's as when both were last at the same instant.

    Parameters
    ----------
    now : Instant
        The state's.
    companion, together : Instant or None
        The companion's, and the state's then; None where that is not known.

    Returns
    -------
    pressure, displacement : ndarray, shape (nx, ny)
        [Pa], and at unit compliance [Pa m], in memory of their own.
    """
    threads = now.contact.threads
    pressure, known = now.contact.times(1.0), now.unit_displacement
    displaced = [] if known is None else [(1.0, known)]
    if companion is not None and together is not None:
        companion.contact.add_to(pressure, 1.0)
        together.contact.add_to(pressure, -1.0)
        cut_at_zero(pressure, threads)
        if displaced and companion.unit_displacement is not None and together.unit_displacement is not None:
            displaced += [(1.0, companion.unit_displacement), (-1.0, together.unit_displacement)]
    return pressure, weighted(displaced, empty(pressure.shape), threads) if displaced else None


def difference(
    scene: Scene, step: Step, companion: Trajectory, displaced: Sum, earlier: Sparse | None, wants_area: bool
) -> Uncertainty:
    """Stated error of a step, from its difference to the companion at the same time.

    Parameters
    ----------
    scene : Scene
        What is prescribed.
    step : Step
        The accepted step.
    companion : Trajectory
        Its companion after a step of its own.
    displaced : Sum
        Displacement after that step. [m]
    earlier : Sparse or None
        Pressure before it, if there was one. [Pa]
    wants_area : bool
        Whether to estimate the error of the contact area too.

    Notes
    -----
    The pressures from which both continue are compared. If hardly any compliance is instantaneous, the step shows a
    pressure that is more accurate.
    """
    fine, coarse = step.state.now, companion.now
    area = scene.operator.cell_area
    inside, outside = _undecided(scene, step, coarse, displaced) if wants_area else (0, 0)
    own, other = step.state.energy, companion.energy
    entered, soft = 0.0, scene.is_soft
    if earlier is not None and soft:
        entered = _ENTERED * area * float(np.sum(step.shown.pressure, where=earlier.field() == 0))
        if companion.before is None or scene.lacks_instantaneous_compliance(coarse.time - companion.before.time):
            entered += _ENTERING * outside * fine.force / max(fine.contact.count, 1)
    stated, force, energy = STATED, _STATED_FORCE, _STATED_ENERGY
    if soft:
        stated, force, energy = _STATED_SOFT, _STATED_SOFT, _STATED_SOFT_ENERGY
    return Uncertainty(
        pressure=stated * area * fine.contact.apart_from(coarse.contact) + entered,
        approach=stated * abs(fine.approach - coarse.approach),
        force=force * abs(fine.force - coarse.force) + (entered if step.control == "approach" else 0.0),
        work=energy * abs(step.state.work - companion.work) + own.unresolved,
        dissipated=energy * abs(own.dissipated - other.dissipated) + own.unresolved,
        friction=stated * _friction_apart(scene, step, coarse.pressure, displaced.field()) if scene.motions else 0.0,
        inside=area * inside,
        outside=area * outside,
        stored_excess=(own.stored - other.stored) / -3,
        dissipated_excess=(own.dissipated - other.dissipated) / -3,
    )


def adapt_tolerance_share(
    scene: Scene, before: State, state: State, ahead: float, left: float, unknown: Uncertainty
) -> ControllerState:
    """Adapt the tolerance of the next steps to the error accumulated so far.

    Parameters
    ----------
    scene : Scene
        What is prescribed.
    before, state : State
        At the last two instants that the companion reached.
    ahead : float
        Prescribed value at the next event over the present one, at least one: errors count relative to the larger.
    left : float
        Part of the error of the pressure that is left at the next kept time; that of the work does not fade.
    unknown : Uncertainty
        Stated error of the state.
    """

    def used(one: State, unknown: Uncertainty) -> float:
        """Part of the tolerance; the work goes about as the square of what is prescribed."""
        part = _USED_BY_SOFT_WORK if scene.is_soft else _USED_BY_WORK
        by_work = part * unknown.work / one.largest_work / scene.tolerance if one.largest_work > 0 else 0.0
        if scene.is_soft:  # pressure and force jump with every cell that enters
            unknown = replace(unknown, pressure=0.0, force=0.0)
        relative = unknown.relative(one.largest_force, one.largest_approach) / scene.tolerance
        return max(left * relative / ahead, by_work / ahead**2)

    return state.pace.adapt_sharpness(used(state, unknown), used(before, before.uncertainty))


def _friction_apart(scene: Scene, step: Step, pressure: Array, displacement: Array) -> float:
    """Difference of the tangential force to that of the companion's pressure and displacement. [N]"""
    slide = scene.motions[segment_number(step.state)]
    fine = tangential_force(scene.operator, step.shown.pressure, step.displacement, slide)
    return abs(fine - tangential_force(scene.operator, pressure, displacement, slide))


def _undecided(scene: Scene, step: Step, coarse: Instant, displaced: Sum) -> tuple[int, int]:
    """Cells in contact that may be out of it, and cells out of contact that may be in it."""
    flat = scene.gap.reshape(-1)
    present = None if scene.present is None else scene.present.reshape(-1)

    def work(part: slice) -> tuple[int, int]:
        fine, other, own, others = (
            field.part(part) for field in (step.shown.contact, coarse.contact, step.displaced, displaced)
        )
        contact = fine > 0
        inside = contact & (fine <= np.abs(fine - other))
        sunk = own - step.level
        outside = ~contact & ((other > 0) | (flat[part] + sunk <= np.abs(sunk - (others - coarse.approach))))
        if present is not None:
            outside &= present[part]
        return int(np.count_nonzero(inside)), int(np.count_nonzero(outside))

    found = over_blocks(work, scene.gap.size, scene.operator.threads)
    return sum(inside for inside, _ in found), sum(outside for _, outside in found)


def followed(
    scene: Scene, state: State, segment: Segment, guess: Guess, rule: Rule | None = None
) -> tuple[State, Trial | None] | None:
    """Bring the companion, if there is one, to the instant of the state by one step; return the state and that step.

    None if the companion outgrew the grid. ``guess``, of :func:`coarse_initial_guess`, is used up.
    """
    companion = state.companion
    if companion is None:
        return state, None
    time = state.now.time
    length = time - companion.now.time
    value = segment.value(time - state.began, companion.start)
    rule = rule or rule_for(scene, companion, length, _GROWTH)
    trial = trial_step(scene, companion, segment.control, value, length, rule, _SHARE, guess, arrival=time)
    if is_outgrown(scene, trial.instant):
        return None
    return coarse_step(scene, state, companion, trial), trial


def coarse_step(scene: Scene, state: State, companion: Trajectory, trial: Trial) -> State:
    """State whose companion has accepted a step to the same instant."""
    advanced = advance_trajectory(scene, companion, trial)
    if companion.unresolved:
        advanced = without_past(scene, advanced)
    # no field of the instant before is ever wants_area for
    advanced = replace(advanced, before=advanced.before and advanced.before.without_fields())
    return replace(state, companion=advanced, behind=0, **cost_after(state, trial))


def with_error_estimate(
    scene: Scene, step: Step, companion_trial: Trial | None, earlier: Sparse | None = None, wants_area: bool = True
) -> Step:
    """The step with its stated error, if its companion has taken a step too."""
    companion = step.state.companion
    if companion is None or companion_trial is None:
        return step
    displaced = displacement_after(scene, companion, companion_trial)
    return with_uncertainty(step, difference(scene, step, companion, displaced, earlier, wants_area))


def with_uncertainty(step: Step, uncertainty: Uncertainty, **more: Any) -> Step:
    """The step with a stated error; ``more`` are other changes of its state."""
    return replace(step, uncertainty=uncertainty, state=replace(step.state, uncertainty=uncertainty, **more))


def in_pairs(steps: Iterator[Step | None]) -> Iterator[Step]:
    """The same steps, the first of a pair held until the second one tells how far off both are.

    Only a step that is kept or that follows an event is held; any other goes on at once with the error stated last.
    None comes before the grid grows: then the step that is held goes on, since its fields are those of the smaller
    grid.
    """
    first: Step | None = None
    for step in steps:
        if first is not None:
            if step is not None:
                assert first.state.companion is not None  # it waits where the pair began
                began, middle, end = first.state.companion.now.time, first.shown.time, step.shown.time
                # of what both add to the energies, by the cubes of their lengths
                part = (middle - began) ** 3 / ((middle - began) ** 3 + (end - middle) ** 3)
                first = replace(first, uncertainty=first.uncertainty.or_worse(step.uncertainty, part))
            yield first
            first = None
        if (
            step is not None
            and step.state.behind
            and (step.scene.keeps(step.shown.time) or (step.state.companion and step.state.companion.before is None))
        ):
            first = step
        elif step is not None:
            yield step
        del step  # its fields are not needed while the next one is computed
