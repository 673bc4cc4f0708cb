"""One time step: its elastic contact problem, the state after it, what is shown of it, and a grid that it outgrows."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import ConvergenceError, EdgeContactError, InputError
from roughvisc.mechanics.arrays import blockwise, empty
from roughvisc.mechanics.contact import solve_contact
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.hereditary.exponentials import Modes, padded
from roughvisc.mechanics.hereditary.memory import Rule
from roughvisc.mechanics.sparse import Sparse, Sum
from roughvisc.mechanics.stepping import energy
from roughvisc.mechanics.stepping.program import Control
from roughvisc.mechanics.stepping.scene import Scene
from roughvisc.mechanics.stepping.state import (
    AnyTrajectory,
    ControllerState,
    Guess,
    Instant,
    State,
    Step,
    Trajectory,
    Trial,
)
from roughvisc.mechanics.stepping.wave_memory import WaveMemory

Array = NDArray[np.float64]
# Part of the tolerance that the estimated error of the contact solver may take.
_SOLVED = 0.2
_DISCARDED = 1e-3  # length of the short solve that shows a soft step's pressure, in steps


def initial_state(scene: Scene) -> State:
    nothing = np.zeros(scene.operator.shape)
    given = any(segment.control == "approach" for segment in scene.program.segments[:1])
    now = Instant(0.0, Sparse.of(nothing), 0.0, 0.0 if given else scene.lowest(scene.gap), nothing)
    assert isinstance(scene.memory, Modes | WaveMemory)
    return State(now, scene.memory.start(scene.operator.shape), energy=energy.at_rest(scene.memory))


def trial_at_rest(scene: Scene, state: State) -> Trial:
    nothing = np.zeros(scene.operator.shape)
    of_pressures = scene.memory.acts_on in ("pressure", "both")
    return Trial(state.now, nothing, nothing if of_pressures else None, 0.0, "linear")


def trial_step(
    scene: Scene,
    state: Trajectory,
    control: Control,
    value: float,
    length: float,
    rule: Rule,
    share: float = 1.0,
    guess: Guess | None = None,
    arrival: float | None = None,
) -> Trial:
    """Contact state a step ahead, where the load or the approach has a given value.

    ``share`` scales the contact solver's tolerance. ``guess``, which is used up, is a first guess of the pressure and
    its displacement at unit compliance. ``arrival`` is the time of the end if it is known to the last bit, and not only
    as a sum. [s]

    Raises
    ------
    ConvergenceError
        If the contact is not solved. The message states the time, the estimated error of the pressure and what to try.
    """
    operator, alpha, effective, field = carried_into_step(scene, state.memory, length, rule)
    # a displacement that costs no convolution is not held while the contact is solved: the memory will give it again
    carried = None if scene.memory.acts_on == "displacement" else field
    threads = scene.operator.threads
    gap = field if carried is None else empty(field.shape)
    blockwise(np.add, scene.gap, field, out=gap, threads=threads)
    del field
    time = state.now.time + length if arrival is None else arrival
    no_contact = value == 0 if control == "load" else value <= scene.lowest(gap)
    if no_contact:
        approach = scene.lowest(gap) if control == "load" else value
        nothing = np.zeros_like(gap)
        instant = Instant(time, Sparse.of(nothing), 0.0, approach, nothing)
        return Trial(instant, carried, effective, length, rule, control)
    if alpha <= 0:
        raise InputError(f"at {time:g} s a {control} jumps, and the material has no instantaneous compliance")
    area = scene.operator.cell_area
    start, start_displacement = state.first_guess(length) if guess is None else guess
    for known in (start, start_displacement):
        if known is not None:
            blockwise(np.multiply, known, alpha, out=known, threads=threads)
    try:
        contact = solve_contact(
            operator,
            gap,
            load=value * alpha / area if control == "load" else None,
            approach=value if control == "approach" else None,
            tolerance=max(_SOLVED * scene.tolerance * math.sqrt(share), 1e-10),
            start=start,
            start_displacement=start_displacement,
            present=scene.present,
        )
    except ConvergenceError as error:
        raise ConvergenceError(
            f"at {time:.6g} s {error}; try a looser tolerance, a coarser grid, or layers whose moduli differ less"
        ) from error
    del gap, start, start_displacement
    pressure, displacement = contact.pressure, contact.displacement

    def add_and_divide(found: Array, past: Array, out: Array) -> None:
        past += found
        np.divide(found, alpha, out=out)

    for found, past in ((pressure, effective), (displacement, carried)):
        if past is None:
            blockwise(np.divide, found, alpha, out=found, threads=threads)
        else:
            blockwise(add_and_divide, found, past, out=found, threads=threads)
    instant = Instant(
        time,
        Sparse.of(pressure),
        value if control == "load" else contact.load / alpha * area,
        value if control == "approach" else contact.approach,
        displacement if operator is scene.operator else None,
    )
    return Trial(
        instant,
        carried,
        effective,
        length,
        rule,
        control,
        contact.error,
        contact.approach_error,
        contact.iterations,
        contact.convolutions + (scene.memory.acts_on in ("pressure", "waves")),
    )


def carried_into_step(scene: Scene, memory: Any, length: float, rule: Rule) -> tuple[Grid, float, Array | None, Array]:
    """What answers the pressure of a step, an operator times ``alpha``, and what is carried into it.

    That is the effective pressure, if known, and the displacement.
    """
    alpha, carried = scene.memory.predict(memory, length, rule)
    if isinstance(scene.memory, WaveMemory):
        return scene.memory.operator_of(memory, length, rule), alpha, None, carried
    if scene.memory.acts_on == "displacement":
        return scene.operator, alpha, None, carried
    if scene.memory.acts_on == "both":
        return scene.operator, alpha, carried[0], carried[1]
    return scene.operator, alpha, carried, scene.operator.displacement(carried)


def advance_trajectory(scene: Scene, state: AnyTrajectory, trial: Trial) -> AnyTrajectory:
    """A trajectory that has accepted a trial."""
    now, acts_on = trial.instant, scene.memory.acts_on
    if acts_on == "displacement":
        assert now.unit_displacement is not None
        field = now.unit_displacement
    else:
        field = now.pressure
    if acts_on == "both":  # held once
        both = np.empty((2, *field.shape))
        both[0], both[1] = field, now.unit_displacement
        field, now = both, Instant(now.time, Sparse.of(both[0]), now.force, now.approach, both[1])
    memory = scene.memory.advance(state.memory, trial.length, trial.rule, field)
    spent = energy_after(scene, state, trial, memory)
    return replace(
        state,
        now=now,
        before=state.now if trial.length > 0 else None,
        memory=memory,
        work=spent.stored + spent.dissipated,
        energy=spent,
        unresolved=False,
    )


def accept(scene: Scene, state: State, trial: Trial, pace: ControllerState, **more: Any) -> State:
    """State after an accepted trial; ``pace`` tells how long the next step may be, ``more`` what else is other."""
    advanced = advance_trajectory(scene, state, trial)
    now = advanced.now
    return replace(
        advanced,
        **more,
        largest_force=max(state.largest_force, now.force),
        largest_approach=max(state.largest_approach, abs(now.approach)),
        largest_work=max(state.largest_work, abs(advanced.work)),
        contact_since=state.contact_since if now.force > 0 and state.now.force > 0 else state.now.time,
        pace=pace,
        **cost_after(state, trial),
    )


def energy_after(scene: Scene, state: Trajectory, trial: Trial, memory: Any) -> energy.Energy:
    """Energies at the end of a step, with the state of the memory then."""
    if isinstance(scene.memory, WaveMemory):
        products = scene.memory.products(state.memory, memory.field, trial.rule)
    else:
        assert isinstance(scene.memory, Modes)
        start, end = state.now.unit_displacement, trial.instant.unit_displacement
        assert start is not None
        assert end is not None
        pressed = trial.instant.contact, end
        products = energy.inner_products(
            scene.memory, state.memory, trial.rule, start, pressed, scene.operator.cell_area
        )
    return energy.after_step(
        state.energy,
        scene.memory,
        state.memory,
        trial.length,
        trial.rule,
        products,
        fresh=state.before is None,
        jumped=state.unresolved,
        work=work_while_held(state, trial) if scene.is_viscoelastic and trial.length > 0 else None,
    )


def work_while_held(state: Trajectory, trial: Trial) -> float | None:
    """Work of a step in which the load or the approach is held, exactly; None where neither is. [J]

    Where surfaces touch, their displacement follows the approach: the work is the integral of the force over it,
    however the pressure runs meanwhile. A load that jumps is held from then on.
    """
    before, now = state.now, trial.instant
    if trial.slides:  # the tangential force works too
        return None
    if trial.control == "approach" and now.approach == before.approach:
        return 0.0
    if trial.control == "load" and (now.force == before.force or state.unresolved):
        return now.force * (now.approach - before.approach)
    return None


def cost_after(state: State, trial: Trial) -> dict[str, Any]:
    """Iterations and convolutions so far, those of a trial included."""
    return {
        "iterations": state.iterations + trial.iterations,
        "convolutions": state.convolutions + trial.convolutions,
    }


def step_of(scene: Scene, state: State, trial: Trial) -> Step:
    """What is yielded of an accepted trial; as uncertain as the state is."""
    shown, displaced, now = trial, displacement_after(scene, state, trial), state.now
    level = now.approach
    kept = trial.length > 0 and not trial.is_open and scene.keeps(state.now.time)
    if kept and scene.lacks_instantaneous_compliance(trial.length):
        # The pressure of an implicit step belongs to the step, not to its end. A short step at constant
        # pressure shows the end's (largest error of a Kelvin-Voigt pressure 39 % -> 5e-8).
        alone = replace(state, before=None)
        shown = trial_step(scene, alone, "load", state.now.force, _DISCARDED * trial.length, "right")
        state = replace(state, **cost_after(state, shown))
        displaced = displacement_after(scene, alone, shown, shown.length, shown.rule)
        now, level = replace(now, contact=shown.instant.contact), shown.instant.approach
    return Step(
        shown=now,
        displaced=displaced,
        effective=shown.effective,
        level=level,
        control=trial.control,
        given=scene.program.gives(segment_number(state)),
        solver_error=shown.solver_error,
        solver_error_approach=shown.solver_error_approach,
        uncertainty=state.uncertainty,
        scene=scene,
        state=state,
    )


def displacement_after(scene: Scene, state: Trajectory, trial: Trial, length: float = 0.0, rule: Rule = "right") -> Sum:
    """Total displacement after a trial that has led to a state, or leads so much farther. [m], [s]"""
    if trial.displacement is not None:
        return Sum.whole(trial.displacement)
    assert isinstance(scene.memory, Modes)
    assert trial.instant.unit_displacement is not None
    alpha, terms = scene.memory.terms(state.memory, length, rule)
    return Sum((*terms, (alpha, trial.instant.unit_displacement)))


def segment_number(state: State) -> int:
    """Index of the segment that ended or goes on at the present instant."""
    return max(state.segment - (state.now.time <= state.began), 0)


def start_segment(scene: Scene, state: State) -> State:
    """State at the start of the next segment."""
    segments = scene.program.segments
    index = state.segment + 1
    joined = segments[max(index - 1, 0) : index + 1]
    neighbours = {segment.control for segment in joined}
    # a corner of the approach is a jump of the load where the material cannot follow at once
    jumps = "approach" in neighbours and not scene.can_jump
    given = segments[index].control if index < len(segments) else None

    def enter(one: AnyTrajectory) -> AnyTrajectory:
        start = 0.0 if given is None else one.now.force if given == "load" else one.now.approach
        return replace(without_past(scene, one), start=start, unresolved=jumps and one.now.force > 0)

    entered = state.with_each(enter)
    # a corner in what is prescribed bends the histories and does not break them: the steps may stay as long, unless
    # the first one is of first order
    smooth = len(neighbours) == 1 and all(segment.duration > 0 and segment.slide is None for segment in joined)
    smooth = smooth and scene.is_viscoelastic and not scene.lacks_instantaneous_compliance(state.pace.suggestion)
    smooth = smooth and state.now.force > 0 and not entered.unresolved
    pace = state.pace if smooth else replace(state.pace, suggestion=0.0)
    return replace(entered, segment=index, began=state.now.time, pace=pace)


def restarted(scene: Scene, state: State, suggestion: float) -> State:
    """State from which nothing is extrapolated, whose next step is as long as a suggestion. [s]"""
    return replace(without_past(scene, state), pace=replace(state.pace, suggestion=suggestion))


def without_past(scene: Scene, state: AnyTrajectory) -> AnyTrajectory:
    """A trajectory from which nothing is extrapolated."""
    return replace(state, before=None, memory=scene.memory.restart(state.memory))


# The approach stays below the least gap beyond the grid by this factor: what is shown of a step's end is solved anew.
_BEYOND = 1.05


def is_outgrown(scene: Scene, instant: Instant) -> bool:
    """Whether the grid is too small: contact cannot be excluded beyond it, or has reached the domain's border."""
    if scene.outside < math.inf:
        return _BEYOND * instant.approach >= scene.outside
    return at_edge(scene, instant.contact)


def at_edge(scene: Scene, contact: Sparse) -> bool:
    """Whether pressure at the border of a free-space domain acts as the edge of a punch that nobody asked for."""
    return not scene.accept_edge and at_border(scene, contact)


def at_border(scene: Scene, contact: Sparse) -> bool:
    """Whether there is pressure at the border of a free-space domain."""
    if scene.operator.boundary != "free":
        return False
    pressure = contact.field()
    return any(np.maximum.reduce(line) > 0 for i in (0, -1) for line in (pressure[i], pressure[:, i]))


def edge_error(scene: Scene, time: float) -> EdgeContactError:
    """The error to raise where the grid cannot grow."""
    nx, ny = scene.operator.shape
    return EdgeContactError(
        f"at {time:.6g} s contact reaches the border of the free-space domain of {nx} x {ny} cells: expected contact "
        "inside it; use boundary='mirror' for a nominally flat scan, a larger scan, a smaller load, or "
        "edge='accept' to treat the scan outline as a punch"
    )


def enlarged(scene: Scene, state: State, time: float) -> tuple[Scene, State]:
    """Scene and state on a larger grid: nothing outside ever carried pressure."""
    larger = scene.enlarge(scene) if scene.enlarge is not None else None
    if larger is None:
        raise edge_error(scene, time)
    scene, offset = larger
    return scene, state.with_each(partial(_on_larger, scene, offset))


def _on_larger(scene: Scene, offset: tuple[int, int], state: AnyTrajectory) -> AnyTrajectory:
    """A trajectory on a larger grid, in which the present one begins at a cell."""
    shape = scene.operator.shape
    memory = scene.memory.enlarged(state.memory, shape, offset, scene.operator.displacement)

    def on_larger_grid(instant: Instant) -> Instant:
        if not instant.contact.size:  # of a companion
            return instant
        contact = Sparse.of(padded(instant.pressure, shape, offset))
        return replace(instant, contact=contact, unit_displacement=None)

    now, before = on_larger_grid(state.now), None if state.before is None else on_larger_grid(state.before)
    now = replace(now, unit_displacement=scene.operator.displacement(now.pressure))
    return replace(state, now=now, before=before, memory=memory)
