"""Loading: a program of load, pressure or approach against time, and of slides, gives rows over time."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import EdgeContactError
from roughvisc.experiment.base import Experiment, Outgrown, Problem, Row, Rows, facts_of
from roughvisc.experiment.domain import enlarged_indenter, estimated
from roughvisc.experiment.notes import (
    accuracy_note,
    border_note,
    contact_stands_alone,
    creep_left,
    edge_note,
    slope_note,
    surface_stands_alone,
    table_note,
    tolerance_note,
    wake_note,
)
from roughvisc.experiment.profile import Profile
from roughvisc.experiment.resources import require_loading
from roughvisc.experiment.scene import (
    build_scene,
    check_program,
    domain_of,
    slide_note,
)
from roughvisc.experiment.stated import (
    Fields,
    area_columns,
    error_columns,
    fields_of,
    friction_columns,
    meets_tolerance,
    staircase_area,
    time_error,
)
from roughvisc.labels import warnings_text
from roughvisc.mechanics.materials.creep import complete
from roughvisc.mechanics.memory import History
from roughvisc.mechanics.program import Program
from roughvisc.mechanics.stepping import Difference, Point, State, Step, at_rest, march
from roughvisc.topography.grid import nominal_area
from roughvisc.units import unit_for
from roughvisc.variables import STATUS_MEANINGS

log = logging.getLogger("roughvisc")
Array = NDArray[np.float64]


@dataclass(frozen=True)
class LoadingState:
    """Where a march through a program stands after a step.

    Attributes
    ----------
    march : State or None
        Of the march itself; None at the start.
    largest : tuple of float
        Largest force [N] and approach [m] of the kept rows.
    enlarged, outgrown : int
        How many times the surface of an indenter has been made larger, and the domain has been outgrown.
    border : float or None
        When contact was first found at the border of a free surface, if that is accepted. [s]
    """

    march: State | None = None
    largest: tuple[float, float] = (0.0, 0.0)
    enlarged: int = 0
    outgrown: int = 0
    border: float | None = None


@dataclass(frozen=True)
class Loading(Experiment):
    """A surface is pressed through a program, and slid where that has slides.

    Parameters
    ----------
    program : Program
        Load, nominal pressure or approach against time.
    """

    program: Program

    axis: ClassVar[str] = "time"
    table: ClassVar[str] = "program"

    def __repr__(self) -> str:
        return repr(self.program)

    def rows(self, problem: Problem, state: LoadingState | None = None, *, in_memory: bool = True) -> LoadingRows:
        """Every accepted step, those to keep as rows of the result."""
        return LoadingRows(problem, self.program, state, in_memory=in_memory)

    def content(self) -> Any:
        """The segments."""
        return [
            [one.control, one.duration, one.end, one.amplitude, one.period]
            + ([one.slide.distance, one.slide.direction] if one.slide else [])
            for one in self.program.segments
        ]

    def progress(self, done: float, end: float) -> str:
        """The time reached. [s]"""
        unit = unit_for(end, "s")
        return f"t = {unit(done):.3g} of {unit.text(end)}"


#: Dataclasses that the state of a row is made of, beside plain values, tuples and arrays: for checkpoints.
STATES = (LoadingState, State, Point, History, Difference)


class LoadingRows(Rows):
    """Accepted steps of one march, in order: histories of all of them, fields of those that are kept.

    Parameters
    ----------
    problem : Problem
        Surface, body and settings.
    program : Program
        The loading program.
    state : LoadingState, optional
        From which the march continues. Default: from rest.
    in_memory : bool
        Whether the kept fields stay in memory.
    """

    def __init__(
        self, problem: Problem, program: Program, state: LoadingState | None = None, *, in_memory: bool = True
    ) -> None:
        height, body, settings = problem.height, problem.body, problem.settings
        self._given, self._settings = problem, settings
        shape = height.sizes["x"], height.sizes["y"]
        require_loading(shape, nominal_area(height), program, settings, body, in_memory=in_memory)
        check_program(Profile(height, settings.missing, body.kernel), body, program, settings)
        self._start = state or LoadingState(enlarged=enlargements(problem, program))
        larger = enlarged_indenter(height, self._start.enlarged)
        assert larger is not None, "it was made before"
        self.problem = replace(problem, height=larger)
        self.profile = Profile(larger, settings.missing, body.kernel)
        self.profile.nominal_area = nominal_area(height)
        self._domain = domain_of(self.profile, body, program, settings, self._start.outgrown)
        self._scene, self._choice = build_scene(self.profile, body, program, settings, self._domain)
        log.info("memory: %s", self._choice.note)
        self.end = program.duration
        self._border = self._start.border

    def __iter__(self) -> Iterator[Row]:
        """March to the end of the program.

        Raises
        ------
        Outgrown
            If contact outgrows the domain: the march must begin anew.
        """
        scene, start = self._scene, self._start
        every = scene.kept is None
        to_keep = set(scene.corners if scene.kept is None else scene.kept)
        largest, reached = start.largest, start.march or at_rest(scene)
        for step in march(scene, start.march):
            point, before = step.point, largest
            self._check_border(step)
            largest = max(before[0], point.force), max(before[1], abs(point.approach))
            reached = step.state or reached
            of_all = max(reached.largest_force, point.force), max(reached.largest_approach, abs(point.approach))
            stated = error_columns(step, scene, self._choice.series_error, largest, of_all)
            kept = point.time in to_keep or (every and meets_tolerance(step, scene, stated["stated_error"]))
            state = None
            if step.state is not None:
                told = largest if kept else before
                state = LoadingState(step.state, told, start.enlarged, start.outgrown, self._border)
            if kept or (not every and self._is_end_value(step)):
                yield self._row(step, largest, stated, kept, state)
            else:
                yield Row(point.time, state=state, done=point.time)
            largest = largest if kept else before

    def _check_border(self, step: Step) -> None:
        """Take note of contact at the border of a free surface, or refuse it; find out if the domain is outgrown."""
        scene, start, point = self._scene, self._start, step.point
        if scene.grid.boundary != "free" or point.force == 0:
            return
        if self._domain.is_outgrown(point.approach):
            raise Outgrown(LoadingState(enlarged=start.enlarged, outgrown=start.outgrown + 1))
        touches = point.pressure > 0
        lines = [line for i in (0, -1) for line in (touches[i], touches[:, i])]
        if not self._domain.is_whole or not any(bool(line.any()) for line in lines):
            return
        if self._settings.edge == "accept":
            self._border = point.time if self._border is None else self._border
            return
        if enlarged_indenter(self.profile.height, 1) is not None:
            raise Outgrown(LoadingState(enlarged=start.enlarged + 1, outgrown=start.outgrown))
        nx, ny = scene.gap.shape
        raise EdgeContactError(
            f"at {point.time:.6g} s contact reaches the border of the free-space domain of {nx} x {ny} cells: expected "
            "contact inside it; use boundary='mirror' for a nominally flat scan, a larger scan, a smaller load, or "
            "edge='accept' to treat the scan outline as a punch"
        )

    def _is_end_value(self, step: Step) -> bool:
        """Return whether pressure and force of a step that is not kept are those at its end.

        With hardly any instantaneous compliance they belong to the whole step; a given load is right all the same.
        """
        before = step.point.before
        length = step.point.time - (before[0] if before else self._scene.corners[step.segment])
        by_load = self._scene.program.segments[step.segment].control == "load"
        return by_load or not self._scene.is_soft(length)

    def _row(
        self, step: Step, largest: tuple[float, float], stated: dict[str, float], kept: bool, state: LoadingState | None
    ) -> Row:
        """Return the row of a step.

        Parameters
        ----------
        step : Step
            An accepted step.
        largest : tuple of float
            Largest force [N] and approach [m] of the kept rows so far, this one included.
        stated : dict
            Its stated errors.
        kept : bool
            Whether it is a row of the result, or of the histories of all steps only.
        state : LoadingState or None
            From which an interrupted run continues.
        """
        scene, point, domain = self._scene, step.point, self._domain
        fields = fields_of(step, scene)
        count = int(np.count_nonzero(fields.contact))
        touching = count * scene.grid.cell_area
        area = max(touching - staircase_area(fields.contact, scene, domain), 0.0)
        row: dict[str, Any] = {
            "force": point.force,
            "approach": point.approach,
            "work": step.work,
            "time_error": time_error(step, largest),
            "convolutions": step.convolutions,
            "status": self._status(step, count),
            "contact_area": area,
            "contact_area_counted": touching,
            "contact_fraction": self.profile.contact_fraction(area),
            "mean_gap": self._mean_gap(step, fields),
            **friction_columns(step, scene, fields.displacement),
        }
        arrays: dict[str, Array] = {}
        if kept:
            row |= stated | area_columns(step, scene, fields, touching, area)
            arrays = self._stored(step, fields)
        return Row(point.time, row, arrays, kept, 0, state, point.time)

    def _stored(self, step: Step, fields: Fields) -> dict[str, Array]:
        """Return the fields that are stored, on the whole surface."""
        domain, names = self._domain, self._settings.fields
        stored = {"pressure": step.point.pressure, "displacement": fields.displacement, "gap": fields.gap}
        if domain.is_whole:
            stored["gap"] = np.where(self.profile.present, fields.gap, np.nan)
        else:
            stored["pressure"] = domain.padded(step.point.pressure)
            if "displacement" in names or "gap" in names:
                displacement = domain.displacement(self._scene.memory.present(step.point.history)[1])
                displacement[domain.cells] = fields.displacement
                stored["displacement"] = displacement
                gap = np.maximum(self.profile.gap + displacement - step.point.approach, 0.0)
                gap[domain.cells] = fields.gap
                stored["gap"] = gap
        return {name: stored[name] for name in names}

    def _mean_gap(self, step: Step, fields: Fields) -> float:
        """Return the mean gap of the whole surface. [m]"""
        if self._domain.is_whole:
            return float(np.mean(fields.gap, where=self.profile.present))
        effective = self._scene.memory.present(step.point.history)[1]
        return self.profile.mean_gap + self._domain.mean_displacement(effective) - step.point.approach

    def _status(self, step: Step, count: int) -> int:
        if step.point.force == 0:
            meaning = "open"
        elif self._domain.is_whole and count == np.count_nonzero(self.profile.present):
            meaning = "full_contact"
        else:
            meaning = "converged"
        return STATUS_MEANINGS.index(meaning)

    def finish(self, dataset: xr.Dataset) -> xr.Dataset:
        """Return the result: costs of each row from the sums till then, nominal pressure, attributes.

        The attributes state the memory model, numbers for an audit, and warnings, which are logged too.
        """
        dataset["convolutions"] = "time", np.diff(dataset["convolutions"].values, prepend=0)
        dataset["nominal_pressure"] = dataset["force"] / self.profile.nominal_area
        scene, choice, profile, settings = self._scene, self._choice, self.profile, self._settings
        approach = float(np.fmax.reduce(dataset["approach"].values))
        repeats = settings.boundary == "periodic"
        warnings = {
            "slope": slope_note(
                profile.height[self._domain.cells],
                settings.boundary,
                approach - profile.least_gap,  # below the highest cell
            ),
            "border": border_note(profile.height, dataset) if repeats else "",
            "edge": "" if self._border is None else edge_note(self._border),
            "wake": self._wake_note(dataset),
            "slide": slide_note(scene.program, profile.spacing),
            "series": choice.warning(settings.tolerance),
        }
        for note in filter(None, warnings.values()):
            log.warning("%s", note)
        stated = {"accuracy": accuracy_note(scene), "tolerance": tolerance_note(scene, dataset)}
        stated["material"] = table_note(self.problem.body.materials)
        attributes = facts_of(self._given.body, self.end, scene.program.time_scale)
        if self.problem.body.separates:  # of what was pressed, a series or not; of layers those of the top one
            attributes |= {
                "compliance_at_once": scene.compliance(0.0),
                "compliance_at_end": scene.compliance(self.end),
            }
        attributes |= {
            "memory": choice.note,
            "series_error": choice.series_error,
            "warnings": warnings_text(stated | warnings),
        }
        return dataset.assign_attrs({name: value for name, value in attributes.items() if value != ""})

    def _wake_note(self, dataset: xr.Dataset) -> str:
        """What to say of a contact that stands alone and slides into the wake of the one before."""
        scene, profile = self._scene, self.profile
        segments = [(one, one.slide) for one in scene.program.segments if one.slide is not None]
        if not segments:
            return ""
        notes, alone = [], surface_stands_alone(profile.height)
        for axis, side in enumerate(profile.spacing):
            period = profile.height.shape[axis] * side
            strokes = [(slide.distance, slide.distance / one.duration) for one, slide in segments if slide.axis == axis]
            if sum(distance for distance, _ in strokes) < period / 2:  # it does not come as far as the next wake
                continue
            single = alone
            if single is None and "pressure" in dataset:
                single = contact_stands_alone(dataset["pressure"][-1].values, axis)
            if single:
                left = {
                    speed: creep_left(scene.compliance(min(period / speed, self.end)), scene.compliance(self.end))
                    for _, speed in strokes
                }
                notes.append(wake_note(left, period))
        return " ".join(filter(None, notes))


def enlargements(problem: Problem, program: Program) -> int:
    """Return how many times the surface of an indenter must be made larger for the contact that is expected."""
    height, settings = problem.height, problem.settings
    if settings.boundary != "free" or settings.edge != "error" or enlarged_indenter(height, 1) is None:
        return 0
    program, times = program.on_area(nominal_area(height)), 0
    compliance = float(complete(problem.body.material).contact_compliance(program.duration))
    larger: xr.DataArray | None = height
    while larger is not None and estimated(larger, problem.body.kernel, compliance, program)[1]:
        larger, times = enlarged_indenter(height, times + 1), times + 1
    return times if larger is not None else times - 1
