"""Loading: a program of load, pressure or approach against time, and of slides, gives rows over time."""

from __future__ import annotations

import json
import logging
import math
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import EdgeContactError, InputError
from roughvisc.experiment.accuracy import (
    SOLVER_AT_EDGE,
    Stated,
    area_error,
    border_warning,
    columns_of,
    error_columns,
    loaded_depth,
    memory_of,
    slope_warning,
    uncertain_area,
    wakes_of,
)
from roughvisc.experiment.base import Experiment, Outgrown, Row, Rows
from roughvisc.experiment.kept_times import kept_times
from roughvisc.experiment.memory_limit import WORTH_ASKING, require_loading
from roughvisc.experiment.problem import Problem
from roughvisc.experiment.profile import BEYOND, GROWTH, Domain, Profile, choose_surface
from roughvisc.mechanics.adhesion import Adhesion
from roughvisc.mechanics.body import HALF_SPACE, Body
from roughvisc.mechanics.contact.solver import contact_area
from roughvisc.mechanics.grid import Grid, arrays_of, to_host
from roughvisc.mechanics.memory import History
from roughvisc.mechanics.program import Program
from roughvisc.mechanics.scene import SOFT, Packed, Point, Scene
from roughvisc.mechanics.stated_error import StepErrors
from roughvisc.mechanics.stepping import State, Step, march
from roughvisc.mechanics.tangential import tangential_force
from roughvisc.settings import Settings, attraction
from roughvisc.topography.grid import spacing
from roughvisc.topography.recipes import grown
from roughvisc.units import format_quantity, unit_for
from roughvisc.variables import STATUS_MEANINGS

log = logging.getLogger("roughvisc")
Array = NDArray[np.float64]

#: Largest stated error, over the tolerance, of a step that is kept because its error is small. This choice favours
#: steps whose stated error is too small. With 1 instead of 0.5, a third more steps are kept, but 9 instead of 4 % of
#: 185 random cases have a row beyond the tolerance.
CHOSEN = 0.5
#: Largest ratio of :func:`jump_ratio`. At 0.8 the pull-off of a sphere is 1.4 % off, at 3 it is 15 %.
LARGEST_RATIO = 1.0
#: The attraction beyond the border of a free surface is missed if the gap at the border is below this, in ranges.
FELT = 5.0
#: Times whose squares and products stay far from overflow. [s]
LARGEST = 1e100
#: A segment, or the period of a cycle, lasts at least this many units in the last place of its end: adding a millionth
#: of its length, the shortest time step, must change the time.
LEAST_ROUNDINGS = 4e6
#: Segments of a program that the attribute ``program`` of a result lists.
DESCRIBED = 100


@dataclass(frozen=True)
class LoadingState:
    """State of a loading after a step.

    Attributes
    ----------
    march : State or None
        State of the time stepping; None at the start.
    enlarged, outgrown : int
        Number of times that the surface of an indenter was enlarged, and that contact outgrew the domain.
    border : float or None
        Time at which contact first reached the border of a free surface, if this is accepted. [s]
    """

    march: State | None = None
    enlarged: int = 0
    outgrown: int = 0
    border: float | None = None


#: Dataclasses in the state of a row, for checkpoints. Its other parts are plain values, tuples and arrays.
STATES = (LoadingState, State, Point, Packed, History, StepErrors)


@dataclass(frozen=True)
class Loading(Experiment):
    """Contact of a surface under a program of load, pressure or approach, and of slides.

    Parameters
    ----------
    program : Program
        Load, nominal pressure or approach against time.
    """

    program: Program

    axis: ClassVar[str] = "time"

    def __post_init__(self) -> None:
        if not isinstance(self.program, Program):
            expected = "a program, such as rv.Program().load(1, over=1)"
            raise InputError(key="program", found=self.program, expected=expected)

    def __repr__(self) -> str:
        return repr(self.program)

    def described(self) -> str:
        """Return the segments of the program in words."""
        return self.program.in_words(DESCRIBED)

    def rows(self, problem: Problem, state: LoadingState | None = None, *, in_memory: bool = True) -> LoadingRows:
        """Return all accepted steps, from rest or a state; the kept ones are rows of the result."""
        height = problem.height
        body = problem.body
        settings = problem.settings
        xp = arrays_of(settings.device)
        if height.size >= WORTH_ASKING:
            require_loading((height.sizes["x"], height.sizes["y"]), self.program, settings, body, in_memory)
        given = Profile(height, settings.missing, body.kernel)
        program = self.program.on_area(given.area)
        check_program(given, program, settings.boundary)

        before = (None, 0) if state is None else (state.enlarged, state.outgrown)
        profile, domain, enlarged, reaches_border = choose_surface(given, problem, program, *before)
        gap = np.ascontiguousarray(profile.gap[domain.cells])
        assert settings.boundary != "auto", "resolved() replaces it"
        grid = Grid((gap.shape[0], gap.shape[1]), profile.spacing, settings.boundary, kernel=profile.kernel, xp=xp)
        memory = memory_of(body, program, settings, grid=grid, keeps_pressure=not domain.is_whole)
        log.info("memory: %s", memory.note)
        scene = Scene(
            grid=grid,
            gap=xp.asarray(gap),
            memory=memory,
            program=program,
            kept=kept_times(program, settings.times, profile.spacing),
            tolerance=settings.tolerance,
            time_step=None if isinstance(settings.time_step, str) else settings.time_step,
            present=None if profile.all_present else xp.asarray(profile.present[domain.cells]),
            adhesion=attraction(settings),
        )
        return LoadingRows(
            problem=replace(problem, height=profile.height),
            end=program.duration,
            scene=scene,
            profile=profile,
            domain=domain,
            area=given.area,
            reaches_border=reaches_border,
            state=on_device(state, xp) if state else LoadingState(enlarged=enlarged),
        )

    def unsupported(self, settings: Settings, body: Body) -> Iterator[tuple[str, Any, str]]:
        """Yield the settings that do not fit the program or the body: name, value and expected value."""
        if self.program.slides and settings.boundary != "periodic":
            yield "boundary", settings.boundary, "'periodic' for a program that slides (rv.mirror unfolds a surface)"
        end = self.program.duration
        if not isinstance(settings.time_step, str) and settings.time_step < 4 * math.ulp(end):
            resolution = f"at the end of the program, {end:g} s, times have a resolution of {math.ulp(end):.2g} s"
            yield "time_step", settings.time_step, f"a longer step: {resolution}"
        if attraction(settings) is None:
            if self.program.lowest_load < 0:
                yield "program", self.program.lowest_load, "loads and pressures of at least zero, or adhesion"
            return
        if self.program.slides:
            yield "adhesion", settings.adhesion, "no adhesion in a program that slides"
        if body.kernel != HALF_SPACE:
            yield "adhesion", settings.adhesion, "no adhesion on a sheet, on layers or on a kernel of your own"
        if settings.device != "cpu":
            yield "device", settings.device, "'cpu' for adhesion"

    def check_cells(self, problem: Problem) -> None:
        """Refuse cells that do not resolve the range of an attraction: single cells would jump.

        Raises
        ------
        InputError
            If the cells are too long. The message states the length that fits.
        """
        attracts = attraction(problem.settings)
        if attracts is None:
            return
        sides = spacing(problem.height, "height")
        ratio = jump_ratio(attracts, problem.body, sides, self.program.duration)
        if ratio > LARGEST_RATIO:
            fits = format_quantity(float(f"{max(sides) / ratio:.2g}"), "m")
            cells = [math.ceil(count * ratio) for count in problem.height.shape]
            least = format_quantity(float(f"{attracts.range * math.sqrt(ratio):.3g}"), "m")
            shown = f"resample = {cells} under [surface], rv.resample in Python"
            expected = f"a range of at least {least}, or cells of at most {fits} ({shown}): the cells do not resolve it"
            raise InputError(key="adhesion.range", found=attracts.range, expected=expected)

    def facts(self, body: Body, height: xr.DataArray) -> dict[str, Any]:
        """Return facts about the body at the end of the program, and the time scale of the program."""
        return body.facts(self.program.duration) | {"time_scale": self.program.time_scale}

    def progress(self, done: float, end: float) -> str:
        """Return the time reached, in words."""
        unit = unit_for(end, "s")
        return f"t = {unit(done):.3g} of {unit.text(end)}"


@dataclass(eq=False, kw_only=True)
class LoadingRows(Rows):
    """Accepted steps of a run, in order: values of all steps, and fields of the kept steps.

    Attributes
    ----------
    problem : Problem
        Surface, enlarged if necessary, body and settings.
    end : float
        Duration of the program. [s]
    scene : Scene
        Input of the time stepping: grid, gap, memory, program, kept times.
    profile : Profile
        Arrays of the surface.
    domain : Domain
        Part of the surface on which the contact is solved.
    area : float
        Nominal area of the given surface. [m2]
    reaches_border : bool
        Whether contact is expected at the border of a free surface.
    state : LoadingState
        State from which the run continues, then the last one of a row.
    """

    problem: Problem
    end: float
    scene: Scene
    profile: Profile
    domain: Domain
    area: float
    reaches_border: bool
    state: LoadingState

    def __iter__(self) -> Iterator[Row]:
        """Compute the steps to the end of the program.

        Raises
        ------
        Outgrown
            If contact outgrows the domain, or reaches the border of an indenter's surface: the run must restart.
        EdgeContactError
            If contact reaches the border of another free surface, unless the settings accept it.
        """
        scene = self.scene
        domain = self.domain
        every = scene.kept is None
        ends = set(scene.program.corners)
        is_free = scene.grid.boundary == "free"
        for step in march(scene, self.state.march):
            point = step.point
            if is_free and not point.is_open:
                touches = point.contact
                if scene.adhesion is not None and point.gap is not None:
                    touches = point.gap < FELT * scene.adhesion.range
                at_border = bool(touches[[0, -1]].any() or touches[:, [0, -1]].any())
                if (at_border and not domain.is_whole) or BEYOND * point.approach >= domain.outside:
                    raise Outgrown(LoadingState(enlarged=self.state.enlarged, outgrown=self.state.outgrown + 1))
                if at_border:
                    self._reach_border(point.time)

            stated = error_columns(step, scene)
            kept = scene.keeps(point.time)
            if every:  # the length of fixed steps and of steps in a slide cannot be reduced
                is_given = scene.time_step is not None or scene.program.segments[step.segment].slide is not None
                kept = point.time in ends or is_given or stated["stated_error"] <= CHOSEN * scene.tolerance
            jumps = step.state.dissipated > (self.state.march.dissipated if self.state.march else 0.0)
            values: dict[str, Any] = {}
            fields: dict[str, Array] = {}
            if step.is_end:
                self.state = replace(self.state, march=step.state)
            # If hardly any compliance is instantaneous, the pressure of a step that is not kept belongs to the step and
            # not to its end. A prescribed load is correct even then.
            by_load = scene.program.segments[step.segment].control == "load"
            began = point.previous[0] if point.previous else scene.program.corners[step.segment]
            length = max(point.time - began, 0.0)  # of the step, which began at its previous point
            if kept or (not every and (by_load or not scene.memory.grows(length, SOFT))):
                values, fields = self._row(step, length, stated, kept, jumps)
            yield Row(point.time, values, fields, kept, self.state if step.is_end else None, point.time)
            del fields  # frees their memory while the next step is computed

    def _reach_border(self, time: float) -> None:
        """Record that contact reaches the border of a free surface, enlarge an indenter, or refuse the contact."""
        state = self.state
        nx, ny = self.profile.gap.shape
        if self.problem.settings.edge == "accept":
            self.state = state if state.border is not None else replace(state, border=time)
            return
        if grown(self.profile.height, GROWTH) is not None:
            raise Outgrown(LoadingState(enlarged=state.enlarged + 1, outgrown=state.outgrown))
        raise EdgeContactError(
            f"at {time:.6g} s contact reaches the border of the free-space domain of {nx} x {ny} cells: expected "
            "contact inside it; use boundary='mirror' for a nominally flat scan, a larger scan, a smaller load, or "
            "edge='accept' to treat the scan outline as a punch"
        )

    def _row(
        self, step: Step, length: float, stated: dict[str, float], kept: bool, jumps: bool
    ) -> tuple[dict[str, Any], dict[str, Array]]:
        """Return the variables of a step, and its fields on the whole surface.

        Parameters
        ----------
        step : Step
            An accepted step.
        length : float
            Length of the step; zero for a jump. [s]
        stated : dict
            Its stated errors.
        kept : bool
            Whether the step is a row of the result; otherwise it belongs only to the history of all steps.
        jumps : bool
            Whether the contact of an elastic body with adhesion jumps to another state in the step.
        """
        scene = self.scene
        profile = self.profile
        domain = self.domain
        point = step.point
        grid = scene.grid
        present = scene.present
        is_whole = domain.is_whole
        xp = scene.grid.xp
        displaced = scene.memory.displacement(point.history)
        pressure = point.pressure
        contact = point.contact
        displacement = displaced[0]
        gap = xp.maximum(scene.gap + displacement - point.approach, 0.0)
        gap[contact] = 0.0

        # Counting cells overestimates the area by a part of the strip along the perimeter, where contact ends within
        # the material. If the material itself ends, at an absent cell or at the border of a scan in free space, the
        # edge of the contact is known and the count is exact. A mirror plane is not an edge: cells adjoin their images.
        free = ~contact if present is None else present & ~contact
        goes_on = not is_whole
        counted, area, _ = contact_area(contact, free, grid.cell_area, grid.boundary, goes_on)

        is_full = is_whole and not bool(free.any())
        status = "open" if not contact.any() else "full_contact" if is_full else "converged"
        status = "jump" if jumps else status
        if is_whole:
            mean_gap = float(gap[scene.solid].mean())
        else:
            effective = to_host(displaced[-1])
            mean_gap = profile.mean_gap + float((effective * domain.mean_influence).sum()) - point.approach
        slide = scene.motions[step.segment]
        friction = None
        if slide is not None:
            friction = Stated(tangential_force(grid, pressure, displaced[0], slide), step.errors.friction)
        off_area = self._area_error(step, length, gap, counted, area) if kept else math.nan
        force = Stated(point.force, stated["force_error"])
        row: dict[str, Any] = stated | columns_of(force, Stated(area, off_area), profile.area, friction)
        row |= {
            "approach": point.approach,
            "nominal_pressure": point.force / self.area,
            "work": step.state.work,
            "convolutions": step.state.convolutions,
            "status": STATUS_MEANINGS.index(status),
            "contact_area_counted": counted,
            "mean_gap": mean_gap,
        }
        if scene.adhesion is not None:
            tension = scene.adhesion.strength * xp.exp(-gap[scene.solid] / scene.adhesion.range)
            row["adhesive_force"] = float(tension.sum()) * grid.cell_area
            if scene.memory.is_elastic:
                row["dissipated_energy"] = step.state.dissipated
        if slide is not None:
            row["sliding_distance"] = step.state.distance
            row["friction_force_across"] = tangential_force(grid, pressure, displaced[0], slide, across=True)
        if not kept:
            return row, {}

        names = self.problem.settings.fields
        beyond = dict[str, Array]()  # fields outside the domain
        if not is_whole:
            beyond["pressure"] = np.zeros(domain.shape)
            if "displacement" in names or "gap" in names:
                beyond["displacement"] = domain.displacement(effective)
                beyond["gap"] = np.maximum(profile.gap + beyond["displacement"] - point.approach, 0.0)
        fields = {}
        for name in names:
            columns = {"pressure": point.stored_pressure, "displacement": displacement, "gap": gap}
            fields[name] = to_host(columns[name])
            if beyond:
                beyond[name][domain.cells] = fields[name]
                fields[name] = beyond[name]
        if "gap" in names:
            fields["gap"] = np.where(profile.present, fields["gap"], np.nan)
        return row, fields

    def _area_error(self, step: Step, length: float, gap: Any, counted: float, area: float) -> float:
        """Return the error of the contact area due to time steps and contact solver. [m2]

        Parameters
        ----------
        step : Step
            An accepted step.
        length : float
            Length of the step; zero for a jump. [s]
        gap : array, shape (nx, ny)
            Gap between the surfaces. [m]
        counted, area : float
            Contact area, counted and corrected for the grid. [m2]
        """
        scene = self.scene
        point = step.point
        difference = step.errors
        inside = 0.0
        outside = 0.0
        if counted > 0 and point.solver_error > 0:
            off = SOLVER_AT_EDGE * point.solver_error * point.size / counted
            closed = off * scene.grid.self_influence * scene.memory.compliance(length)
            pressure = scene.contact_pressure(point, point.pressure)
            inside, outside = uncertain_area(pressure, gap, off, closed, scene.grid.cell_area, scene.present)
        return area_error(counted, area, difference.inside + inside, difference.outside + outside)

    def finish(self, dataset: xr.Dataset) -> tuple[xr.Dataset, dict[str, str]]:
        """Return the result with the memory model and the cycles, and its warnings."""
        scene = self.scene
        profile = self.profile
        memory = self.scene.memory
        limit = self.scene.tolerance
        warnings = {}
        boundary = scene.grid.boundary
        program = scene.program
        errors = dataset["stated_error"].values
        missed = errors[errors > limit]
        if missed.size:
            warnings["tolerance"] = (
                f"{missed.size} of {errors.size} rows {'states' if missed.size == 1 else 'state'} an error above the "
                f"tolerance {limit:g}, {missed.max():.3g} at worst (stated_error)."
            )
            note = " A slide takes one cell a step: its error falls with the square of the cell side."
            warnings["tolerance"] += note if program.slides else ""
        if boundary == "free":
            depth = float(np.fmax.reduce(dataset["approach"].values)) - profile.least_gap
        else:
            depth = loaded_depth(profile.height, float(dataset["contact_fraction"].max()))
        warnings["slope"] = slope_warning(profile.height[self.domain.cells], boundary, depth)
        if boundary == "periodic":
            warnings["border"] = border_warning(profile.height)
        if self.state.border is not None:
            warnings["edge"] = (
                f"Contact reached the border of the surface, first in the step to {self.state.border:.3g} s: its "
                "outline acts as the edge of a punch, with pressure that no larger surface would have."
            )
        if program.slides:
            pressure = dataset["pressure"][-1].values if "pressure" in dataset else None
            warnings["wake"] = wakes_of(scene, profile, pressure)
        off = max(memory.series_error, memory.misfit)
        if off > limit:
            warnings["series"] = (
                f"The series in place of the material is {100 * off:.2g} % off at worst, more than the tolerance "
                f"{limit:g} (memory): no passive material comes nearer to it."
            )
        attributes: dict[str, Any] = {"memory": memory.note, "series_error": memory.series_error}
        if scene.adhesion is not None:
            attributes |= {"work_of_adhesion": scene.adhesion.work, "range_of_adhesion": scene.adhesion.range}
        if cycles := program.cycles:  # for the work in each cycle
            attributes["cycles"] = json.dumps(cycles)
        return dataset.assign_attrs(attributes), warnings


def jump_ratio(attracts: Adhesion, body: Body, sides: tuple[float, float], age: float) -> float:
    r"""Return the ratio from which single cells may jump into and out of contact.

    A cell under tension has two stable states if the tension decreases faster with the gap than the elastic restoring
    pressure. The condition is :math:`C w K_0 / \rho^2 > 1`, with the contact compliance :math:`C`, the work of adhesion
    :math:`w`, its range :math:`\rho`, and the displacement :math:`K_0` of a cell under unit pressure on it.

    Parameters
    ----------
    attracts : Adhesion
        Attraction.
    body : Body
        The body.
    sides : tuple of float
        Cell sides. [m]
    age : float
        Time since the start, at which the compliance is taken. [s]
    """
    response = float(body.kernel.influence((1, 1), sides)[0, 0])
    return float(body.material.contact_compliance(age)) * attracts.work * response / attracts.range**2


def on_device(value: Any, xp: Any) -> Any:
    """Return a state with its arrays in a namespace, NumPy or CuPy; a checkpoint has NumPy arrays."""
    if isinstance(value, np.ndarray):
        return xp.asarray(value)
    if isinstance(value, tuple):
        return tuple(on_device(inner, xp) for inner in value)
    if isinstance(value, STATES):
        return replace(value, **{field.name: on_device(getattr(value, field.name), xp) for field in fields(value)})
    return value


def check_program(profile: Profile, program: Program, boundary: str) -> None:
    """Check that surface and program are compatible.

    Parameters
    ----------
    profile : Profile
        The surface.
    program : Program
        The loading program. Nominal pressures are converted to loads.
    boundary : {"free", "periodic", "mirror"}
        Boundary of the grid.

    Raises
    ------
    InputError
        If they are incompatible. The message names the segment and the expected value.
    """
    if not program.segments:
        raise InputError("the program is empty: expected at least one segment")
    # Beyond full contact the approach does not determine the pressure, unless a uniform pressure causes a finite mean
    # displacement. If cells are absent, the body bulges into them, and every approach has a definite force.
    can_fill = boundary != "free" and profile.all_present and not profile.kernel.transfer(0.0, 0.0) > 0
    for number, (segment, end) in enumerate(zip(program.segments, program.corners[1:], strict=True)):
        where = f"program.{number}"
        shortest = min(segment.duration, segment.period)
        least = max(LEAST_ROUNDINGS * math.ulp(end), 1 / LARGEST)
        if segment.duration > 0 and not (least <= shortest and end <= LARGEST):
            resolved = f"a duration of at least {least:.2g} s, which times near {end:g} s resolve"
            expected = f"{resolved}, also of a period, and an end by {LARGEST:g} s"
            raise InputError(key=where, found=shortest, expected=expected)
        if segment.slide is not None:
            if number == 0:
                raise InputError(key=where, found="slide", expected="load, pressure or approach before a slide")
            try:
                segment.slide.cells(profile.spacing)
            except InputError as error:
                raise error.prefixed(where) from None
        largest = (segment.end or 0.0) + abs(segment.amplitude)
        if can_fill and segment.control == "approach" and segment.end is not None and largest >= profile.mean_gap:
            expected = f"an approach below {profile.mean_gap:.6g} m, at which contact is full ({boundary} boundaries)"
            raise InputError(key=where, found=largest, expected=expected)
