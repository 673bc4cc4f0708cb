"""Stated error of the time steps: the difference between two solutions, and what both share.

The fine solution takes a pair of steps, the coarse solution takes the pair as one step. Their difference, times a
factor, is the error at the end of the pair (:func:`stated_difference`). The difference may miss an error:

- it has parts of first and of second order and may pass through zero (:meth:`StepErrors.at_least`);
- the pressure of a cell that has just entered the contact is uncertain (:func:`uncertain_part`, :func:`shared_part`,
  :func:`error_of_late_entry`);
- slow slides have a phase error at one and at two cells a step (:func:`phase_error`);
- their first step misses friction and pressure (:func:`skipped_friction`, :func:`skipped_pressure`).

The work of a pair is an integral over parabolas (:func:`work_of_pair`). Its error is the difference to straight lines,
and after a corner of the program the part of the force that relaxes within a step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from roughvisc.mechanics.adhesive_step import dissipated, stored_energy
from roughvisc.mechanics.grid import fft_of
from roughvisc.mechanics.memory import STIFF, LayerMemory, Memory
from roughvisc.mechanics.program import Slide
from roughvisc.mechanics.scene import SOFT, Point, Scene
from roughvisc.mechanics.tangential import tangential_force

#: Stated error over the difference between the fine and the coarse solution, of pressure and force,
#: and of the approach. The difference is three times the error at second order and the error at first order. Measured
#: on workflows/benchmarks/accuracy.py. Then the same for bodies with hardly any instantaneous compliance, whose first
#: steps are of first order.
STATED = (0.6, 0.6)
STATED_SOFT = (1.0, 1.5)
#: Least stated error after a pair, over the part of the error before the pair that relaxation leaves: a difference that
#: passes through zero states nothing (`test_row_at_which_both_solutions_meet`). On random scenes it raises the median
#: of stated over true error by 1 to 4 % (`closed_forms.py cells-many cells-one slides`).
LASTING = 0.5
#: Uncertain part of the pressure of a cell that has just entered the contact, if the pressure is due to creep. Without
#: this part and the shared one, rows are up to 1.7 times beyond their stated error where a crest enters within a step
#: (`test_entering_cells.py`).
UNCERTAIN_OF_ENTERED = 0.3
#: Error of the pressure of entered cells that both solutions of a pair may share, as a part of the pressure times the
#: square of the creep in the pair over the instantaneous compliance; at most the pressure itself. Measured on random
#: contacts of 2 x 40 cells with eight per cent instantaneous compliance, and of 21 x 16 cells with four.
SHARED = 0.1
#: Pressure of a cell that may have entered the contact of a soft body, over the mean pressure.
PRESSURE_OF_LATE = 2.5
#: Relative error of a quantity without a second solution. Used for the pressure change in a slide by one cell,
#: and for the work of a force that vanishes at one end and is taken as linear over the approach. On a sphere the error
#: is a fifth of this work, on a cone a third.
UNBOUNDED = 0.25
#: The error of the friction force that remains after a step of a hold counts with this power of the part that decays.
#: Without: 5 of 9,367 rows bad instead of 3 (`closed_forms.py slides-friction --scenes 300`, seeds 51 and 52); with 3,
#: as many, and stated over true error 2 % larger.
UNRESOLVED = 4.0
#: Force and approach are parabolas over a pair only if each step covers at least this part of the pair.
LEAST_PART = 0.1


@dataclass(frozen=True)
class StepErrors:
    """Stated errors of the time steps, from the difference between the fine and the coarse solution.

    Attributes
    ----------
    pressure : float
        Error of the pressure: integral of its absolute value. [N]
    force, approach : float
        Errors of force and approach. [N, m]
    inside, outside : float
        Uncertain area in contact, and uncertain area out of contact. [m2]
    friction : float
        Error of the friction force of a slide. [N]
    shared : float
        Further error of the pressure, which both solutions may share and `pressure` does not contain: of cells that
        have entered, or may have (:func:`shared_part`, :func:`uncertain_part`, :func:`error_of_late_entry`), and of
        slides by one cell. [N]
    gap : float
        Error of the gap of a soft body. [m]
    """

    pressure: float = 0.0
    force: float = 0.0
    approach: float = 0.0
    inside: float = 0.0
    outside: float = 0.0
    friction: float = 0.0
    shared: float = 0.0
    gap: float = 0.0

    def at_least(
        self, former: StepErrors, left: float, left_of_friction: float = 0.0, *, is_soft: bool = False
    ) -> StepErrors:
        """Return the errors after a pair; none is smaller than a part of the error before the pair.

        Shared errors add up, but a soft body forgets those before the pair. Earlier uncertain areas do not count.

        Parameters
        ----------
        former : StepErrors
            Errors before the pair.
        left : float
            Part of an error of the pressure that relaxation leaves over the pair.
        left_of_friction : float
            Part of the friction force that is left, see :func:`left_of_friction`.
        is_soft : bool
            Whether the pair is soft: errors of pressure and force follow from errors of the surface, which do not fade.
        """
        lasting = LASTING if is_soft else LASTING * left
        return replace(
            self,
            pressure=max(self.pressure, lasting * former.pressure),
            force=max(self.force, lasting * former.force),
            approach=max(self.approach, LASTING * former.approach),
            friction=max(self.friction, max(left, left_of_friction) * former.friction),  # both solutions may share it
            shared=self.shared + (0.0 if is_soft else left * former.shared),
            gap=max(self.gap, LASTING * former.gap),
        )

    def or_larger(self, other: StepErrors, left: float = 1.0) -> StepErrors:
        """Return the larger error of each kind, of this one and of what relaxation leaves of the other one.

        Parameters
        ----------
        other : StepErrors
            Other errors.
        left : float
            Part that relaxation leaves of the other errors. Areas and the errors of approach and gap do not fade.
        """
        parts = {name: error * left for name, error in vars(other).items()}
        parts |= {name: getattr(other, name) for name in ("approach", "gap", "inside", "outside")}
        return StepErrors(**{name: max(error, parts[name]) for name, error in vars(self).items()})


def stated_over_difference(scene: Scene) -> tuple[float, float]:
    """Return the stated error over the difference of both solutions: of pressure and force, and of the approach."""
    return STATED_SOFT if scene.becomes_soft else STATED


def stated_difference(
    scene: Scene,
    before: Point,
    fine: Point,
    coarse: Point,
    slide: Slide | None = None,
    *,
    is_kept: bool = False,
) -> StepErrors:
    """Return the stated errors of a fine solution, from its difference to the coarse solution at the same time.

    Parameters
    ----------
    scene : Scene
        Input of the time stepping.
    before : Point
        Fine solution before the step.
    fine, coarse : Point
        Both solutions, with the pressures at that time.
    slide : Slide or None
        Motion, if the error of the friction force is needed.
    is_kept : bool
        Whether a kept row needs the uncertain area and the uncertain pressure of entering cells.
    """
    if fine is coarse:
        return StepErrors()
    grid = scene.grid
    factor, of_approach = stated_over_difference(scene)
    pressure = fine.pressure
    other = coarse.pressure
    error = StepErrors(
        pressure=factor * (float(abs(pressure - other).sum()) * grid.cell_area),
        force=factor * abs(fine.force - coarse.force),
        approach=of_approach * abs(fine.approach - coarse.approach),
    )
    if slide is not None:
        of_friction = abs(friction(scene, fine, slide) - friction(scene, coarse, slide))
        error = replace(error, friction=of_friction)
    is_soft = scene.memory.grows(fine.time - before.time, SOFT)
    if not (is_kept or is_soft) or (fine.is_open and coarse.is_open):
        return error
    gap = scene.gap + scene.memory.displacement(fine.history)[0] - fine.approach
    gap_of_coarse = scene.gap + scene.memory.displacement(coarse.history)[0] - coarse.approach
    uncertain_gap = abs(gap - gap_of_coarse)
    if is_soft:
        # the difference is three times an error of second order, and the surface is smoother than the pressure
        error = replace(error, gap=float(uncertain_gap[scene.solid].max()) / 3)
    if not is_kept:
        return error
    pressure = scene.contact_pressure(fine, pressure)
    other = scene.contact_pressure(coarse, other)
    contact = fine.contact
    inside = contact & (pressure <= abs(pressure - other))
    outside = ~contact & (coarse.contact | (gap <= uncertain_gap))
    if scene.present is not None:
        outside &= scene.present
    cells = int(contact.sum())
    uncertain = 0.0
    if cells and is_soft:
        uncertain = uncertain_part(scene.memory, fine.time - before.time) * force_of_entered(scene, before, fine)
        uncertain += PRESSURE_OF_LATE * float(outside.sum()) * fine.size / cells
    return replace(
        error,
        shared=uncertain,
        inside=grid.cell_area * float(inside.sum()),
        outside=grid.cell_area * float(outside.sum()),
    )


def uncertain_part(memory: Memory, step: float) -> float:
    """Return the uncertain part of the pressure of a cell that has entered within a step of some length [s]."""
    compliance = memory.compliance(step)
    return UNCERTAIN_OF_ENTERED * (1 - memory.glassy / compliance) if compliance > 0 else 0.0


def shared_part(memory: Memory, step: float) -> float:
    """Return the relative error of the pressure that both solutions share in cells that enter within a pair."""
    return min(SHARED * (memory.compliance(step) / memory.glassy - 1) ** 2, 1.0)


def with_former(
    scene: Scene,
    start: Point,
    point: Point,
    error: StepErrors,
    former: StepErrors,
    slide: Slide | None,
    *,
    is_soft: bool,
) -> StepErrors:
    """Return the stated errors at a point of a pair; none is smaller than a part of the error before the pair.

    Parameters
    ----------
    scene : Scene
        Input of the time stepping.
    start, point : Point
        Fine solution before the pair, and at a point of the pair.
    error, former : StepErrors
        Errors at the point from the difference of both solutions, and stated errors before the pair.
    slide : Slide or None
        Motion, if the error of the friction force is needed.
    is_soft : bool
        Whether hardly any of the compliance of the pair is instantaneous.
    """
    left = scene.memory.remaining(point.time - start.time)
    of_friction = 0.0
    if slide is not None and former.friction > 0:
        of_friction, unresolved = left_of_friction(scene, start, point, slide)
        error = replace(error, friction=max(error.friction, unresolved))
    return error.at_least(former, left, of_friction, is_soft=is_soft)


def stated_inside(
    scene: Scene,
    start: Point,
    point: Point,
    stated: StepErrors,
    former: StepErrors,
    slide: Slide | None,
    *,
    is_soft: bool,
) -> StepErrors:
    """Return the stated errors of a row inside a pair, where no coarse solution exists.

    Each is the larger one of both ends of the pair, except the shared error. The shared error is the uncertain pressure
    of cells that have entered before the row; in a soft pair it is at least the shared error at the end of the pair.

    Parameters
    ----------
    stated : StepErrors
        Stated errors at the end of the pair.
    scene, start, point, former, slide, is_soft
        See :func:`with_former`.
    """
    step = point.time - start.time
    left = 1.0 if is_soft else scene.memory.remaining(step)
    entered = force_of_entered(scene, start, point)
    shared = stated.shared if is_soft else shared_part(scene.memory, step) * entered
    shared = max(shared, uncertain_part(scene.memory, step) * entered)
    error = replace(stated.or_larger(former, left), shared=shared)
    # changes only the friction, and adds the remaining former shared error
    return with_former(scene, start, point, error, former, slide, is_soft=is_soft)


def error_of_late_entry(scene: Scene, before: Point, after: Point, error: float, former: tuple[float, float]) -> float:
    """Return the error of the pressure of a soft body due to cells that may not have entered the contact yet. [N]

    The pressure of a soft body jumps when a cell enters, which it may do at any approach within the error of the gap.
    A row just after the computed jump may lie before the true one, and a row just before the computed jump after it.

    Parameters
    ----------
    scene : Scene
        Input of the time stepping.
    before, after : Point
        Solution before a pair, and at a row of the pair.
    error : float
        Error of the gap. [m]
    former : tuple of float
        Force on the cells that have entered before the pair within this error, and the approach then. [N, m]
    """
    force = former[0] if abs(after.approach - former[1]) <= error else 0.0
    if abs(after.approach - before.approach) <= error:
        force += force_of_entered(scene, before, after)
    gap = scene.gap + scene.memory.displacement(after.history)[0] - after.approach
    near = ~after.contact & (gap <= error)
    if scene.present is not None:
        near &= scene.present
    cells = int(after.contact.sum())
    if cells:
        force += PRESSURE_OF_LATE * float(near.sum()) * after.size / cells
    return 2 * force  # other cells carry what these do not


def force_of_entered(scene: Scene, before: Point, after: Point) -> float:
    """Return the force on the cells that have entered between two points. [N]"""
    return float(scene.contact_pressure(after, after.pressure)[~before.contact].sum()) * scene.grid.cell_area


# ---------------------------------------------------------------------------------------------------------- friction


def friction(scene: Scene, point: Point, slide: Slide) -> float:
    """Return the friction force of a point. [N]"""
    return tangential_force(scene.grid, point.pressure, scene.memory.displacement(point.history)[0], slide)


def left_of_friction(scene: Scene, before: Point, after: Point, slide: Slide) -> tuple[float, float]:
    """Return the part of the friction force that is left between two points of a hold, and its error there. [-, N]

    The phase errors of a slide have changed the friction of all modes by about the same part, so that the error of the
    friction force decays as the force does. If the force decays far within a step, it may pass through zero in both
    solutions. Its error is then the difference to the force that relaxation would leave of an equal part in all modes.
    """
    if scene.memory.is_elastic:
        return 0.0, 0.0
    former = friction(scene, before, slide)
    present = friction(scene, after, slide)
    left = min(abs(present / former), 1.0) if former else 0.0
    if isinstance(scene.memory, LayerMemory):  # the rates depend on the wave
        return left, 0.0
    relaxed = scene.memory.remaining(after.time - before.time) * former
    return left, (1 - left) ** UNRESOLVED * abs(relaxed - present)


def phase_error(scene: Scene, point: Point, slide: Slide, step: float) -> float:
    r"""Return the error of the friction force of a slide by one cell a step, due to the rate of each wave. [N]

    A wave that slides by the phase :math:`\theta` in a step has the rate :math:`\sin\theta\,(2 - \cos\theta)` in place
    of :math:`\theta` with BDF2, and :math:`\sin\theta` if it is linear within steps. The friction of a slow wave is
    proportional to this rate, also in the coarse solution, so that the difference of both may vanish.
    """
    if scene.memory.is_elastic or point.is_open:
        return 0.0
    fft = fft_of(scene.grid.xp)
    axis = slide.axis
    count = point.pressure.shape[slide.axis]
    spectra = [fft.rfft(field, axis=axis) for field in (point.pressure, scene.memory.displacement(point.history)[0])]
    wave = scene.grid.xp.arange(1, (count + 1) // 2)
    phase = 2 * math.pi / count * wave
    power = (spectra[0].conj() * spectra[1]).imag.sum(axis=1 - axis)[1 : (count + 1) // 2]
    friction_of_wave = 2 / count * power * phase / scene.grid.spacing[axis] * scene.grid.cell_area
    rate = scene.grid.xp.sin(phase)
    if scene.memory.may_ring and scene.memory.grows(step, STIFF):
        rate *= 2 - scene.grid.xp.cos(phase)
    off = rate / phase - 1
    return float(abs(friction_of_wave * off).sum())


def skipped_friction(scene: Scene, before: Point, point: Point, slide: Slide, step: float) -> float:
    """Return the friction force that the first step of a slow slide misses. [N]

    The step takes the pressure as constant, so slow waves have hardly any friction at its end. A pressure that is
    linear within the step would change the displacement by the change of pressure times the compliance at the end of
    the step less its mean over the step.

    Parameters
    ----------
    scene : Scene
        Input of the time stepping.
    before, point : Point
        Solution before the step, in the frame of its end, and at its end.
    slide : Slide
        Motion.
    step : float
        Length of the step. [s]
    """
    memory = scene.memory
    follows = before.history.earlier is not None
    if isinstance(memory, LayerMemory):  # the compliance depends on the wave
        return 0.0
    if follows or not (memory.may_ring and memory.grows(step, STIFF)) or point.is_open:
        return 0.0
    missed = memory.compliance(step) - float(memory.crept(step)[0]) / step
    change = missed * (point.history.fields[0] - before.history.fields[0])
    return abs(tangential_force(scene.grid, point.pressure, change, slide))


def skipped_pressure(scene: Scene, before: Point, point: Point, step: float) -> float:
    """Return the error of the pressure after the first step of a slide, to which no step before it led. [N]

    The pressure of a wave is not linear within a step that is longer than the relaxation. The error is at most the
    change of the pressure times the part of the compliance that a linear pressure misses, as far as the step relaxes.
    The parameters are those of :func:`skipped_friction`.
    """
    memory = scene.memory
    if isinstance(memory, LayerMemory) or point.is_open:
        return 0.0
    missed = 1 - float(memory.crept(step)[0]) / step / memory.compliance(step)
    change = float(abs(point.pressure - before.pressure).sum()) * scene.grid.cell_area
    return missed * (1 - memory.remaining(step)) * change


# -------------------------------------------------------------------------------------------------------------- work


def work_of_pair(
    scene: Scene, start: Point, first: Point, end: Point, inside: list[Point]
) -> tuple[list[float], float, float]:
    """Return the work of the normal force from the start of a pair to points inside it and to its end. [J]

    Force and approach are parabolas over time. If contact is lost in the second step, the force is a parabola over the
    approach instead, and vanishes at the approach of last contact. After a jump the load is constant. If the steps are
    too unequal, or the force would not fall steadily to zero, the force is linear over the approach in each step.

    Parameters
    ----------
    scene : Scene
        Input of the time stepping.
    start, first, end : Point
        Fine solution before the pair, after its first step and at its end.
    inside : list of Point
        Points within the pair, in order, `first` among them.

    Returns
    -------
    works : list of float
        Work to each point inside, and to the end.
    first_error, error : float
        Errors of the work to the first step and to the end.
    """
    points = [*inside, end]
    straight = np.cumsum([work_of_step(scene, start, first), work_of_step(scene, first, end)]).tolist()
    begin = np.array([first.force if start.is_late else start.force, touch(scene, start)])
    changes = np.array([[point.force, touch(scene, point)] for point in (first, end)]) - begin
    is_over_time = not end.is_open

    def parameter(point: Point) -> float:
        return point.time - start.time if is_over_time else touch(scene, point) - float(begin[1])

    early = parameter(first)
    last = parameter(end)
    is_curved = not first.is_open and LEAST_PART * last**2 < early * last < (1 - LEAST_PART) * last**2
    if is_curved:
        bends = (changes[1] / last - changes[0] / early) / (last - early)
        slopes = changes[0] / early - bends * early
        is_curved = is_over_time or float(slopes[0] * (slopes[0] + 2 * bends[0] * last)) > 0
    if not is_curved:
        forces = [float(begin[0]), first.force, end.force]
        sizes = [abs(force) for force in forces]
        uncertain = UNBOUNDED * (1 - min(sizes) / max(*sizes, 1e-300))
        path = [start, *points]
        works = np.cumsum([work_of_step(scene, *ends) for ends in zip(path, points, strict=False)]).tolist()
        return works, uncertain * abs(straight[0]), uncertain * abs(straight[1])
    # coefficients of the integral of the force, a + b t + c t^2, times the rate of the approach, d + 2 e t
    a, (b, d), (c, e) = float(begin[0]), slopes.tolist(), bends.tolist()
    coefficients = a * d, (b * d + 2 * a * e) / 2, (c * d + 2 * b * e) / 3, c * e / 2
    curved = [sum(part * time**power for power, part in enumerate(coefficients, 1)) for time in (early, last)]
    arches = curved[0] - straight[0], curved[1] - curved[0] - straight[1] + straight[0]
    works = []
    for point in inside:  # the straight line to the point itself, and its part of the arch above the step
        ends = (start, first)
        known = 0.0
        arch = arches[0]
        if point.time > first.time:
            ends = (first, end)
            known = curved[0]
            arch = arches[1]
        fraction = (point.time - ends[0].time) / (ends[1].time - ends[0].time)
        works.append(known + work_of_step(scene, ends[0], point) + fraction**3 * arch)
    works.append(curved[1])
    errors = [abs(line - work) for line, work in zip(straight, curved, strict=True)]
    return works, errors[0], errors[1]


def transient_error(scene: Scene, start: Point, first: Point, end: Point, *, by_load: bool) -> float:
    """Return the error of the work of a pair after a corner, due to a transient that is over within a step. [J]

    At a corner the rate of the prescribed quantity changes. A given approach then adds to the force a part that follows
    ``S(t)``, the integral of the relaxation function. With a pressure that is linear within the step, this part is
    ``h^2 / I(h)`` after the first step instead, with the integral ``I`` of the compliance. The work has the integral of
    a parabola instead of the integral of ``S``. Both errors count twice, because the rate may change its sign. If the
    compliance grows much within the step, the error may be as large as the part ``1 - h R(h) / S(h)`` of the force that
    relaxes in it, with the relaxation function ``R``. It remains to the end of the pair.

    Under a given load the approach is right at both points, and follows ``I`` between them. ``begin + a t + b I(t)``
    through the three points of a pair has another integral than the parabola.

    Parameters
    ----------
    scene : Scene
        Input of the time stepping.
    start, first, end : Point
        Fine solution at the corner, and after each step.
    by_load : bool
        Whether the load is prescribed.
    """
    if first.is_open or end.is_open:
        return 0.0
    early = first.time - start.time
    last = end.time - start.time
    memory = scene.memory
    is_stiff = scene.memory.may_ring and scene.memory.grows(early, STIFF)
    if not by_load:
        missed = part_relaxed(memory, early) if is_stiff else part_missed(memory, early, last)
        return 2 * missed * abs(first.force - start.force) * abs(end.approach - touch(scene, start))
    integral, twice = memory.crept([early, last])
    determinant = early * integral[1] - last * integral[0]
    if abs(determinant) <= 1e-9 * last * abs(integral[1]):
        return 0.0
    begin = touch(scene, start)
    changes = first.approach - begin, end.approach - begin
    weight = (early * changes[1] - last * changes[0]) / determinant
    slope = (changes[0] - weight * integral[0]) / early
    modal = slope * last**2 / 2 + weight * twice[1]
    bend = (changes[1] / last - changes[0] / early) / (last - early)
    smooth = (changes[0] / early - bend * early) * last**2 / 2 + bend * last**3 / 3
    error = abs(modal - smooth) / last
    if is_stiff:  # the first step takes the pressure as constant
        missed = 1 - (integral[1] - integral[0]) / (last - early) * last / integral[1]
        error = max(error, 2 / 3 * abs(missed * changes[1]))  # the weight of the first step in the parabola
    return float(error * abs(end.force - start.force))


def part_relaxed(memory: Memory, step: float) -> float:
    """Return the part of the change of a force under a steady approach that relaxes within a step [s]."""
    return 1 - step * memory.relaxation(step) / float(memory.relaxed(step)[0])


def part_missed(memory: Memory, early: float, last: float) -> float:
    """Return the error of a force under a steady approach, and of its integral, as a part of its change.

    Parameters
    ----------
    memory : Memory
        Memory of the body.
    early, last : float
        Time from the corner to the end of the first step, and of the second. [s]
    """
    if not memory.relaxing.any():  # no relaxation function is known
        return 0.0
    integral, twice = memory.relaxed([early, last])
    of_force = abs(1 - integral[0] * float(memory.crept(early)[0]) / (memory.glassy * early**2))
    bend = (integral[1] / last - integral[0] / early) / (last - early)
    smooth = (integral[0] / early - bend * early) * last**2 / 2 + bend * last**3 / 3
    return of_force + abs(twice[1] - smooth) / (last * integral[0])


def work_of_step(scene: Scene, before: Point, after: Point, slides: bool = False) -> float:
    """Return the work between two points. [J]

    In a jump, and if an elastic body does not slide, the instantaneous compliance stores all work. Otherwise the force
    is linear over the approach; after a jump it is constant.
    """
    memory = scene.memory
    if after.time == before.time or (memory.is_elastic and not slides):
        lost = 0.0 if scene.adhesion is None else dissipated(scene, before, after)
        return stored_energy(scene, after) - stored_energy(scene, before) + lost
    force = after.force if before.is_late else before.force
    return 0.5 * (force + after.force) * (touch(scene, after) - touch(scene, before))


def touch(scene: Scene, point: Point) -> float:
    """Return the approach of a point; while the surfaces are apart, the approach at which they would just touch. [m]"""
    if not point.is_open:
        return point.approach
    surface = scene.gap + scene.memory.displacement(point.history)[0]
    return max(point.approach, float(surface[scene.solid].min()))
