"""Loading: a program of load, pressure or approach against time, and of slides, gives rows over time."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

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
from roughvisc.experiment.profile import Profile, uses_window
from roughvisc.experiment.protocol import Experiment, Row, Rows
from roughvisc.experiment.resources import least_rows, march_bytes, require_memory
from roughvisc.experiment.scene import build_scene, kept_times, memory_options, slide_note, snap_to_cells
from roughvisc.experiment.stated import (
    area_columns,
    error_columns,
    friction_columns,
    is_end_value,
    meets_tolerance,
    staircase_area,
)
from roughvisc.labels import warnings_text
from roughvisc.mechanics.arrays import is_wide, over_rows
from roughvisc.mechanics.bodies.window import FarFieldDisplacement, Window, mean_influence
from roughvisc.mechanics.body import Body
from roughvisc.mechanics.hereditary.exponentials import ModesState
from roughvisc.mechanics.sparse import Sparse
from roughvisc.mechanics.stepping.energy import Energy
from roughvisc.mechanics.stepping.march import march
from roughvisc.mechanics.stepping.program import Program, Slid
from roughvisc.mechanics.stepping.state import ControllerState, Instant, State, Step, Trajectory, Uncertainty
from roughvisc.mechanics.stepping.step import at_border
from roughvisc.mechanics.stepping.wave_memory import WaveMemory, choose_body_memory
from roughvisc.problem import Problem
from roughvisc.recorder import RowStore
from roughvisc.settings import Settings
from roughvisc.units import unit_for
from roughvisc.variables import STATUS_MEANINGS

log = logging.getLogger("roughvisc")
Array = NDArray[np.float64]
#: Kept times in place of all accepted steps, which differ from setting to setting and from grid to grid.
_FEW = 9
#: Tolerance from which single precision, 1e-6 of a displacement, is precise enough.
_SINGLE = 1e-4


@dataclass(frozen=True)
class LoadingState:
    """Where a march through a program stands after a step.

    Attributes
    ----------
    march : State
        Of the march itself.
    largest : tuple of float
        Largest force [N] and approach [m] of the kept rows.
    growths : int
        How many times the grid or the window has grown.
    border : float or None
        When contact was found at the border of a free-space domain first, where that is accepted. [s]
    """

    march: State
    largest: tuple[float, float] = (0.0, 0.0)
    growths: int = 0
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
    called: ClassVar[str] = "a loading program"
    doing: ClassVar[str] = "pressing"
    states: ClassVar[tuple[type, ...]] = (
        LoadingState,
        State,
        Trajectory,
        ControllerState,
        Slid,
        Instant,
        Sparse,
        Uncertainty,
        Energy,
        ModesState,
    )

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

    def on_area(self, area: float) -> Loading:
        """The same with loads in place of nominal pressures."""
        return Loading(self.program.on_area(area))

    def with_common_rows(self, settings: Settings, spacings: Sequence[tuple[float, float]]) -> Settings:
        """Those with kept times that are a few where all steps were kept, and lie at whole cells of all grids. [s]"""
        settings = replace(settings, times=settings.times or _FEW)
        if not self.program.slides:
            return settings
        times = kept_times(self.program, settings.times)
        return self.with_rows_at(settings, snap_to_cells(self.program, times, *spacings) or ())

    def with_rows_at(self, settings: Settings, places: Sequence[float]) -> Settings:
        """Those with these kept times. [s]"""
        return replace(settings, times=places)

    def creep_time(self, size: float) -> float:
        """To the end of the program. [s]"""
        return self.program.duration

    @property
    def time_scale(self) -> float:
        """Of the program. [s]"""
        return self.program.time_scale

    @property
    def largest_speed(self) -> float:
        """Of its slides. [m/s]"""
        slides = ((one.slide, one.duration) for one in self.program.segments)
        return max((slide.distance / duration for slide, duration in slides if slide), default=0.0)

    def progress(self, done: float, end: float) -> str:
        """The time reached. [s]"""
        unit = unit_for(end, "s")
        return f"t = {unit(done):.3g} of {unit.text(end)}"

    def bytes_needed(self, settings: Settings, body: Body, cells: float, area: float, **counts: float) -> float:
        """Memory of the march, its contact sparse unless it is known. [byte]"""
        options = memory_options(self.program.on_area(area), settings)
        memory = choose_body_memory(body, **options).memory
        counts = {"rows": least_rows(settings, self.program)} | counts
        return march_bytes(settings, cells, memory, **counts)


class LoadingRows(Rows):
    """Accepted steps of one march, in order: histories of all of them, fields of those that are kept.

    Where the march goes on in a window, or the grid may grow, a row keeps what was in contact and the effective
    pressure there, from which its fields over the final domain follow: nothing outside ever carried pressure.

    Parameters
    ----------
    problem : Problem
        Surface, body and settings. Where the tolerance leaves room for single precision, what lies beyond a window is
        computed so.
    program : Program
        The loading program.
    state : LoadingState or None
        From which the march goes on.
    in_memory : bool
        Whether the kept fields stay in memory.
    """

    def __init__(
        self, problem: Problem, program: Program, state: LoadingState | None = None, *, in_memory: bool = True
    ) -> None:
        height, body, settings = problem.height, problem.body, problem.settings
        self._problem, self._settings, self._start = problem, settings, state
        require_memory(problem, program, in_memory=in_memory)
        self.profile = Profile(height, settings.missing, follow=uses_window(settings), kernel=body.kernel)
        self._scene, self._choice = build_scene(self.profile, body, program, settings)
        self._followed = not self.profile.window.whole
        log.info("memory: %s", self._choice.note)
        for _ in range(0 if state is None else state.growths):
            larger = self.profile.enlarge(self._scene)
            assert larger is not None, "it grew before"
            self._scene = larger[0]
        self.end = program.duration
        self._border = None if state is None else state.border
        spacing, kernel, single = self.profile.spacing, body.kernel, settings.tolerance >= _SINGLE
        self._reach = lru_cache(maxsize=2)(lambda window: FarFieldDisplacement(window, spacing, kernel, single=single))
        self._mean_influence = lru_cache(maxsize=2)(lambda window: mean_influence(window, spacing, kernel))

    @property
    def height(self) -> xr.DataArray:  # type: ignore[override]
        """Of the surface, as far as it has grown. [m]"""
        return self.profile.height

    @property
    def highest(self) -> float:  # type: ignore[override]
        """Height of the highest point. [m]"""
        return self.profile.highest

    def __iter__(self) -> Iterator[Row]:
        """March to the end of the program."""
        scene, start = self._scene, self._start
        self._start = None  # its fields are not needed beyond the first step
        every = scene.times is None
        to_keep = set(scene.program.corners if scene.times is None else scene.times)
        largest = (0.0, 0.0) if start is None else start.largest
        steps = march(scene, None if start is None else start.march)
        del start
        for step in steps:
            # when contact comes to the border of a free-space domain, in a step that is kept or not
            if self._border is None and self._settings.edge == "accept" and at_border(step.scene, step.shown.contact):
                self._border = float(step.shown.time)
            # of every step those that keep the tolerance: the first ones from rest cannot, relative to themselves
            shown, before = step.shown, largest
            largest = max(before[0], shown.force), max(before[1], abs(shown.approach))
            kept = shown.time in to_keep or (every and meets_tolerance(step, self._choice.series_error, largest))
            state = LoadingState(step.state, largest if kept else before, self.profile.growths, self._border)
            if kept or (not every and is_end_value(step)):
                row = self.row(step, largest, kept, state)
            else:
                row = Row(step.shown.time, state=state, done=step.shown.time)
            largest = largest if kept else before
            del step, state, shown  # their fields are not needed while the next one is computed
            yield row
            del row

    def row(
        self, step: Step, largest: tuple[float, float], kept: bool = True, state: LoadingState | None = None
    ) -> Row:
        """Make the row of an accepted step.

        ``largest`` are force [N] and approach [m] of the kept rows so far, this one included; ``state`` is that from
        which an interrupted run continues.
        """
        if not is_wide(step.scene.gap.size):
            step = step.with_fields()  # on wide grids a field had anew by parts costs less than its memory
        shown, window = step.shown, self.profile.window
        contact = shown.contact.positive()
        count = int(np.count_nonzero(contact))
        touching = count * step.scene.operator.cell_area
        area = max(touching - staircase_area(contact, step.scene), 0.0)
        arrays: dict[str, Array] = {}
        if window.whole:
            arrays = {name: self._field(name, step, contact) for name in self._settings.fields if kept}
            mean_gap = self._mean_of_gap(step, contact, arrays.get("gap"))
        else:
            assert step.effective is not None, "a window asks for a memory of pressures"
            mean_gap = self._mean_gap(window, step.effective, step.level)
        if kept and step.scene.enlarge is not None and step.effective is not None:
            arrays |= {"source_pressure": shown.pressure, "source": step.effective}
        row: dict[str, Any] = {
            "force": shown.force,
            "approach": shown.approach,
            "work": step.work,
            "time_error": step.uncertainty.relative(*largest),
            "iterations": step.state.iterations,
            "convolutions": step.state.convolutions,
            "status": self._status(step, count),
            "contact_area": area,
            "contact_area_counted": touching,
            "contact_fraction": self.profile.contact_fraction(area),
            "mean_gap": mean_gap,
            **friction_columns(step),
        }
        if kept:
            row |= error_columns(step, self._choice.series_error, largest) | area_columns(step, contact, touching, area)
        facts = {
            "level": step.level,
            "corner": self.profile.corner,
            "shape": window.shape,
            "domain": window.domain,
        }
        return Row(shown.time, row, _copy_views(arrays), kept, state, facts, shown.time)

    def columns(self, columns: dict[str, Array]) -> dict[str, Array]:
        """What each row has cost, from the sums till then; and the nominal pressure."""
        for counter in ("iterations", "convolutions"):
            columns[counter] = np.diff(columns[counter], prepend=0)
        columns["nominal_pressure"] = columns["force"] / self.profile.nominal_area
        return columns

    def settled(self, records: RowStore, number: int) -> dict[str, Any]:
        """What is counted over the domain, where that has grown since the row was found."""
        row, facts = records.plain[number]["row"], records.plain[number]["facts"]
        if tuple(facts["domain"]) == self.profile.window.domain:
            return {}
        dx, dy = self.profile.spacing
        fraction = row["contact_area"] / (dx * dy * self.profile.height.size)
        if not records.plain[number]["kept"]:  # its pressure is not known any more
            return {"contact_fraction": fraction, "mean_gap": math.nan}
        source = records.arrays(number, "source")["source"]
        window = self.profile.window_at(facts["corner"], facts["shape"])
        if self.profile.all_present:
            mean_gap = self._mean_gap(window, source, facts["level"])
        else:
            gap = np.empty(window.domain)
            self._fill(records, "gap", number, window, gap)
            mean_gap = float(np.nanmean(gap))
        return {"contact_fraction": fraction, "mean_gap": mean_gap}

    def field(self, records: RowStore, name: str, number: int, out: Array) -> Array:
        """A field of a row over the final surface, written to ``out``, which holds zeros."""
        facts = records.plain[number]["facts"]
        window = self.profile.window_at(facts["corner"], facts["shape"])
        touched = out[window.cells] if name == "pressure" else out  # zeros that stay cost nothing
        self._fill(records, name, number, window, touched)
        return out

    def attributes(self, dataset: xr.Dataset) -> dict[str, Any]:
        """Return the memory model, numbers for an audit, and warnings; warnings are logged too."""
        scene, choice, profile, settings = self._scene, self._choice, self.profile, self._settings
        approach = float(np.fmax.reduce(dataset["approach"].values))
        repeats = settings.boundary == "periodic"
        warnings = {
            "slope": slope_note(
                profile.height[profile.window.cells],
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
        stated["material"] = table_note(self._problem.body.materials)
        # of what was pressed, a series or not; of layers those of the top one
        pressed = {"compliance_at_once": scene.compliance(0.0), "compliance_at_end": scene.final}
        return {
            "memory": choice.note,
            "series_error": choice.series_error,
            "warnings": warnings_text(stated | warnings),
            **({} if isinstance(choice.memory, WaveMemory) else pressed),
        }

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
                left = {speed: creep_left(scene.compliance(period / speed), scene.final) for _, speed in strokes}
                notes.append(wake_note(left, period))
        return " ".join(filter(None, notes))

    def _field(self, name: str, step: Step, contact: NDArray[np.bool_]) -> Array:
        """A field of a step on the whole domain, in memory that nobody changes."""
        if name == "pressure":
            return step.shown.pressure
        if name == "displacement":
            return step.displacement
        gap = np.empty(contact.shape)

        def fill(rows: slice) -> None:
            gap[rows] = self._gap(step, contact, rows)

        over_rows(fill, contact.shape, step.scene.operator.threads)
        return gap

    def _gap(self, step: Step, contact: NDArray[np.bool_], rows: slice) -> Array:
        """Some rows of the gap on the whole domain, missing at absent cells. [m]"""
        gap = self.profile.gap[rows] + step.on_rows(step.displaced, rows)
        self._clip_gap(gap, step.level, rows)
        gap[contact[rows]] = 0.0
        return gap

    def _mean_of_gap(self, step: Step, contact: NDArray[np.bool_], known: Array | None) -> float:
        """Its mean over the present cells, from some rows at a time where it is not known. [m]"""
        present = self.profile.present

        def total(rows: slice) -> float:
            gap = self._gap(step, contact, rows) if known is None else known[rows]
            return float(np.sum(gap, where=present[rows]))

        gaps = over_rows(total, contact.shape, step.scene.operator.threads)
        return sum(gaps) / np.count_nonzero(present)

    def _mean_gap(self, window: Window, source: Array, level: float) -> float:
        """Mean gap over a domain without absent cells, from the effective pressure in a window of it. [m]"""
        return self.profile.mean_gap + float(np.sum(source * self._mean_influence(window))) - level

    def _fill(self, records: RowStore, name: str, index: int, window: Window, out: Array) -> None:
        """Write a field over the domain, the pressure over the window alone."""
        if window.whole:
            out[...] = records.arrays(index, name)[name]
            return
        arrays = records.arrays(index, "source_pressure", "source")
        if name == "pressure":
            out[...] = arrays["source_pressure"]
            return
        for rows, displacement in self._reach(window).rows(arrays["source"]):
            if name == "displacement":
                out[rows] = displacement
            else:
                np.add(displacement, self.profile.gap[rows], out=out[rows])
                self._clip_gap(out[rows], records.plain[index]["facts"]["level"], rows)
        if name == "gap":
            out[window.cells][arrays["source_pressure"] > 0] = 0.0

    def _clip_gap(self, gap: Array, level: float, rows: slice = slice(None)) -> None:
        """Bring some rows of a gap to the level of the approach; it is missing at absent cells. [m]"""
        gap -= level
        np.maximum(gap, 0.0, out=gap)  # below the solver's tolerance inside the contact
        if not self.profile.all_present:
            gap[~self.profile.present[rows]] = np.nan

    def _status(self, step: Step, count: int) -> int:
        if step.shown.force == 0:
            meaning = "open"
        elif self.profile.window.whole and count == np.count_nonzero(self.profile.present):
            meaning = "full_contact"
        else:
            meaning = "converged"
        return STATUS_MEANINGS.index(meaning)


def _copy_views(arrays: dict[str, Array]) -> dict[str, Array]:
    """The arrays; what is a part of a larger one is copied, once, since it would keep all of that in memory."""
    own: dict[int, Array] = {}
    for array in arrays.values():
        if id(array) not in own:
            whole = array.base is None or array.base.nbytes == array.nbytes
            own[id(array)] = array if whole else array.copy()
    return {name: own[id(array)] for name, array in arrays.items()}
