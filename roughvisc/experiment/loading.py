"""Loading: a program of load, pressure or approach against time, and of slides, gives rows over time."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import EdgeContactError
from roughvisc.experiment.base import Experiment, Outgrown, Problem, Row, Rows, facts_of
from roughvisc.experiment.notes import loading_warnings, table_note
from roughvisc.experiment.profile import BEYOND, Profile, choose_surface, enlarged_indenter
from roughvisc.experiment.resources import require_loading
from roughvisc.experiment.scene import build_scene, check_program
from roughvisc.experiment.stated import area_error, error_columns, length_of, meets_tolerance
from roughvisc.labels import warnings_text
from roughvisc.mechanics.contact.neighbours import staircase
from roughvisc.mechanics.memory import History
from roughvisc.mechanics.program import Program
from roughvisc.mechanics.stepping import Difference, Point, State, Step, march
from roughvisc.mechanics.tangential import tangential_force
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

    def __repr__(self) -> str:
        return repr(self.program)

    def rows(self, problem: Problem, state: LoadingState | None = None, *, in_memory: bool = True) -> LoadingRows:
        """Every accepted step, those to keep as rows of the result."""
        return LoadingRows(problem, self.program, state, in_memory=in_memory)

    def progress(self, done: float, end: float) -> str:
        """The time reached. [s]"""
        unit = unit_for(end, "s")
        return f"t = {unit(done):.3g} of {unit.text(end)}"


#: Dataclasses that the state of a row is made of, beside plain values, tuples and arrays: for checkpoints.
STATES = (LoadingState, State, Point, History, Difference)


class LoadingRows(Rows):
    """Accepted steps of a run, in order: histories of all of them, fields of those that are kept.

    Parameters
    ----------
    problem : Problem
        Surface, body and settings.
    program : Program
        The loading program.
    state : LoadingState, optional
        From which the run continues. Default: from rest.
    in_memory : bool
        Whether the kept fields stay in memory.
    """

    def __init__(
        self, problem: Problem, program: Program, state: LoadingState | None = None, *, in_memory: bool = True
    ) -> None:
        height, body, settings = problem.height, problem.body, problem.settings
        shape = height.sizes["x"], height.sizes["y"]
        self._area, self.end = nominal_area(height), program.duration
        program = program.on_area(self._area)
        require_loading(shape, program, settings, body, in_memory=in_memory)
        profile = Profile(height, settings.missing, body.kernel)
        check_program(profile, body, program, settings)
        enlarged, outgrown = (None, 0) if state is None else (state.enlarged, state.outgrown)
        profile, self._domain, enlarged, _ = choose_surface(profile, problem, program, enlarged, outgrown)
        self._start = state or LoadingState(enlarged=enlarged)
        self._scene, self._choice = build_scene(profile, self._domain, body, program, settings)
        self.problem, self._profile = replace(problem, height=profile.height), profile
        log.info("memory: %s", self._choice.note)
        self._border = self._start.border

    def __iter__(self) -> Iterator[Row]:
        """Compute the steps to the end of the program.

        Raises
        ------
        Outgrown
            If contact outgrows the domain: the run must begin again.
        """
        scene, start, largest = self._scene, self._start, self._start.largest
        every, ends = scene.kept is None, set(scene.program.corners)
        for step in march(scene, start.march):
            point = step.point
            self._check_border(step)
            so_far = max(largest[0], point.force), max(largest[1], abs(point.approach))
            stated = error_columns(step, scene, self._choice.series_error, so_far)
            kept = scene.keeps(point.time)
            if every:
                kept = point.time in ends or meets_tolerance(step, scene, stated["stated_error"])
            largest = so_far if kept else largest
            state, values, fields = None, {}, {}
            if step.is_end:
                state = LoadingState(step.state, largest, start.enlarged, start.outgrown, self._border)
            # with hardly any instantaneous compliance a pressure that is not kept belongs to the whole step; a given
            # load is right all the same
            by_load = scene.program.segments[step.segment].control == "load"
            if kept or (not every and (by_load or not scene.is_soft(length_of(step, scene)))):
                values, fields = self._row(step, stated, kept)
            yield Row(point.time, values, fields, kept, state=state, done=point.time)

    def _check_border(self, step: Step) -> None:
        """Record contact at the border of a free surface, or refuse it; find out if the domain is outgrown."""
        scene, start, point, domain = self._scene, self._start, step.point, self._domain
        if scene.grid.boundary != "free" or point.force == 0:
            return
        if BEYOND * point.approach >= domain.outside:
            raise Outgrown(LoadingState(enlarged=start.enlarged, outgrown=start.outgrown + 1))
        touches = point.pressure > 0
        if not domain.is_whole or not (touches[[0, -1]].any() or touches[:, [0, -1]].any()):
            return
        if self.problem.settings.edge == "accept":
            self._border = point.time if self._border is None else self._border
            return
        if enlarged_indenter(self._profile.height) is not None:
            raise Outgrown(LoadingState(enlarged=start.enlarged + 1, outgrown=start.outgrown))
        nx, ny = scene.gap.shape
        raise EdgeContactError(
            f"at {point.time:.6g} s contact reaches the border of the free-space domain of {nx} x {ny} cells: expected "
            "contact inside it; use boundary='mirror' for a nominally flat scan, a larger scan, a smaller load, or "
            "edge='accept' to treat the scan outline as a punch"
        )

    def _row(self, step: Step, stated: dict[str, float], kept: bool) -> tuple[dict[str, Any], dict[str, Array]]:
        """Return the variables of a step, and its fields on the whole surface.

        Parameters
        ----------
        step : Step
            An accepted step.
        stated : dict
            Its stated errors.
        kept : bool
            Whether it is a row of the result, or of the histories of all steps only.
        """
        scene, profile, domain, point = self._scene, self._profile, self._domain, step.point
        contact, grid = point.pressure > 0, scene.grid
        present = scene.memory.displacement(point.history)
        displacement, effective = present[0], present[-1]
        gap = np.maximum(scene.gap + displacement - point.approach, 0.0)
        gap[contact] = 0.0

        # The count is too large by a part of the strip along the perimeter, where contact ends although the material
        # goes on. Where the material itself ends, at an absent cell or at the border of a scan in free space, the edge
        # of the contact is known, and the count exact. A cell at a mirror neighbours its own image: no edge either.
        free, goes_on = ~contact if scene.present is None else scene.present & ~contact, not domain.is_whole
        count = int(np.count_nonzero(contact))
        counted = count * grid.cell_area
        strip = staircase(contact, free, grid.cell_area, grid.boundary == "periodic", before=goes_on, beyond=goes_on)
        area = max(counted - strip, 0.0)

        if domain.is_whole:
            mean_gap = float(np.mean(gap, where=profile.present))
        else:
            mean_gap = profile.mean_gap + domain.mean_displacement(effective) - point.approach
        is_full = domain.is_whole and count == np.count_nonzero(profile.present)
        status = "open" if point.force == 0 else "full_contact" if is_full else "converged"
        row: dict[str, Any] = {
            "force": point.force,
            "approach": point.approach,
            "work": step.state.work,
            "time_error": stated["time_error"],
            "convolutions": step.state.convolutions,
            "status": STATUS_MEANINGS.index(status),
            "contact_area": area,
            "contact_area_counted": counted,
            "contact_fraction": area / profile.area,
            "mean_gap": mean_gap,
        }
        if scene.motions:
            slide = scene.motions[step.segment]
            friction = tangential_force(grid, point.pressure, displacement, slide)
            row |= {
                "sliding_distance": step.state.distance,
                "friction_force": friction,
                "friction_coefficient": friction / point.force if point.force > 0 else math.nan,
                "friction_force_across": tangential_force(grid, point.pressure, displacement, slide, across=True),
                "friction_force_error": step.difference.friction,
            }
        if not kept:
            return row, {}
        row |= stated | {"contact_area_error": area_error(step, scene, gap, counted, area)}

        names = self.problem.settings.fields
        fields = {"pressure": point.pressure, "displacement": displacement, "gap": gap}
        if domain.is_whole:
            fields["gap"] = np.where(profile.present, gap, np.nan)
        else:
            fields["pressure"] = domain.padded(point.pressure)
            if "displacement" in names or "gap" in names:
                whole = domain.displacement(effective)
                whole[domain.cells] = displacement
                opening = np.maximum(profile.gap + whole - point.approach, 0.0)
                opening[domain.cells] = gap
                fields |= {"displacement": whole, "gap": opening}
        return row, {name: fields[name] for name in names}

    def finish(self, dataset: xr.Dataset) -> xr.Dataset:
        """Return the result with the cost of each row, the nominal pressure and the attributes.

        The attributes state the memory model, numbers for an audit, and warnings, which are logged too.
        """
        scene, choice, body = self._scene, self._choice, self.problem.body
        dataset["convolutions"] = "time", np.diff(dataset["convolutions"].values, prepend=0)
        dataset["nominal_pressure"] = dataset["force"] / self._area
        loaded = self._profile.height[self._domain.cells]
        warnings = loading_warnings(scene, self._profile, dataset, loaded=loaded, border=self._border)
        warnings["series"] = choice.warning(scene.tolerance)
        for subject, note in warnings.items():
            if note and subject not in ("accuracy", "tolerance"):
                log.warning("%s", note)
        warnings["material"] = table_note(body.materials)
        attributes = facts_of(body, self.end, scene.program.time_scale)
        if body.separates:  # of what was pressed, a series or not; of layers those of the top one
            attributes["compliance_at_once"] = scene.memory.compliance(0.0)
            attributes["compliance_at_end"] = scene.memory.compliance(self.end)
        attributes |= {
            "memory": choice.note,
            "series_error": choice.series_error,
            "warnings": warnings_text(warnings),
        }
        return dataset.assign_attrs({name: value for name, value in attributes.items() if value != ""})
