"""Rows of a result: each kept instant with its stated errors, and the Dataset that they form."""

from __future__ import annotations

import math
from functools import lru_cache, partial
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.labels import annotate
from roughvisc.mechanics.contact.neighbours import staircase
from roughvisc.mechanics.fields import passes
from roughvisc.mechanics.fields.threads import is_wide
from roughvisc.mechanics.halfspace.window import FarFieldDisplacement, Window, mean_influence
from roughvisc.mechanics.stepping.attempt import segment_number
from roughvisc.mechanics.stepping.domain import at_border
from roughvisc.mechanics.stepping.scene import Scene, Step
from roughvisc.study.simulation.friction_rows import friction_row
from roughvisc.study.simulation.mirror import quarter, unfold
from roughvisc.study.simulation.scene import Ground
from roughvisc.study.simulation.stated import area_columns, error_columns
from roughvisc.study.statement.settings import Settings
from roughvisc.study.storage.records import RowStore
from roughvisc.topography.grid import TAPER
from roughvisc.variables import RESULT_FORMAT, STATUS_MEANINGS, STEPPED, of_step

#: A row that states more than so many tolerances is none where every step is kept and the row is not asked for.
_AT_MOST = 3.0
#: Tolerance from which single precision, 1e-6 of a displacement, is precise enough.
_SINGLE = 1e-4

Array = NDArray[np.float64]


class Rows:
    """Accepted steps of one march, in order: histories of all of them, fields of those that are kept.

    Where the march goes on in a window, or the grid may grow, a row keeps what was in contact and the effective
    pressure there, from which its fields over the final domain follow: nothing outside ever carried pressure.

    Parameters
    ----------
    ground : Ground
        The surface, which may grow meanwhile.
    settings : Settings
        Of the march: which fields are kept; and where the tolerance leaves room for single precision, what lies beyond
        a window is computed so.
    store : RowStore
        Where the rows are kept; what is in it counts as rows of an earlier part of the march.
    series_error : float
        Relative error of the series that stands for the material.
    """

    def __init__(self, ground: Ground, settings: Settings, store: RowStore, series_error: float = 0.0) -> None:
        self._ground = ground
        self._settings = settings
        self._store = store
        self.series_error = series_error
        earlier = (plain.get("border") for plain in store.plain)
        #: When contact was found at the border of a free-space domain first, where that is accepted. [s]
        self.border: float | None = next((time for time in earlier if time is not None), None)
        #: Whether the profile has a mean plane of its own: that of an indenter depends on how large its grid is.
        self._has_mean_plane = settings.boundary == "free" and not ground.can_grow()
        single = settings.tolerance >= _SINGLE
        self._reach = lru_cache(maxsize=2)(
            lambda window: FarFieldDisplacement(window, ground.spacing, ground.kernel, single=single)
        )
        self._mean_influence = lru_cache(maxsize=2)(
            lambda window: mean_influence(window, ground.spacing, ground.kernel)
        )

    def __len__(self) -> int:
        return len(self._kept())

    def watch_border(self, step: Step) -> None:
        """Note when contact comes to the border of a free-space domain, in a step that is kept or not."""
        if self.border is None and self._settings.edge == "accept" and at_border(step.scene, step.shown.contact):
            self.border = float(step.shown.time)

    def add(self, step: Step, converged: bool, wall_time: float, kept: bool = True) -> None:
        """Take up an accepted step; ``converged``: all of those since the last one that is kept."""
        if not is_wide(step.scene.gap.size):
            step = step.with_fields()  # on wide grids a field had anew by parts costs less than its memory
        shown, window = step.shown, self._ground.window
        contact = shown.contact.positive()
        touching = float(np.count_nonzero(contact)) * step.scene.halfspace.cell_area
        area = max(touching - staircase_area(contact, step.scene), 0.0)
        arrays: dict[str, Array] = {}
        if window.whole:
            mean_gap = self._mean_of_gap(step, contact)
            arrays = {name: self._field(name, step, contact) for name in self._settings.fields if kept}
        else:
            assert step.effective is not None, "a window asks for a memory of pressures"
            mean_gap = self._mean_gap(window, step.effective, step.level)
        if kept and step.scene.enlarge is not None and step.effective is not None:
            arrays |= {"source_pressure": shown.pressure, "source": step.effective}
        row = {
            "time": shown.time,
            "force": shown.force,
            "approach": shown.approach,
            "work": step.work,
            "stored_energy": step.stored,
            "dissipated_energy": step.dissipated,
            "time_error": step.time_error,
            "iterations": step.state.iterations,
            "convolutions": step.state.convolutions,
            "status": self._status(step, converged, contact),
            "wall_time": wall_time,
            "contact_area": area,
            "contact_area_counted": touching,
            "contact_fraction": self._ground.contact_fraction(contact, area),
            "mean_gap": mean_gap,
            **self._mean_plane(shown.approach),
            **friction_row(step),
        }
        if kept:
            row |= error_columns(step, self.series_error) | area_columns(step, contact, touching, area)
        grid = {"level": step.level, "corner": self._ground.corner, "shape": window.shape, "domain": window.domain}
        self._store.append({"row": row, "grid": grid, "kept": kept, "border": self.border}, _copy_views(arrays))

    def _kept(self) -> list[int]:
        """Numbers of the steps that are kept."""
        return [number for number, plain in enumerate(self._store.plain) if plain["kept"]]

    def dataset(self) -> xr.Dataset:
        """All rows, on the final domain; fields in a file are read when they are asked for."""
        height, kept = self._ground.height, self._kept()
        rows = [plain["row"] | self._rescaled_to_domain(i) for i, plain in enumerate(self._store.plain)]
        columns = {name: np.array([rows[number][name] for number in kept]) for name in rows[kept[0]]}
        for counter in ("iterations", "convolutions"):
            columns[counter] = np.diff(columns[counter], prepend=0)
        columns["nominal_pressure"] = columns["force"] / self._ground.nominal_area
        stamp = columns.pop("time")
        variables: dict[str, Any] = {name: (("time",), values) for name, values in columns.items()}
        if len(kept) < len(rows):
            for name in ("time", *(name for name in STEPPED if name in columns)):
                variables[of_step(name)] = (("step",), np.array([row[name] for row in rows]))
        for name in self._settings.fields:
            frames = self._store.stacked(partial(self._frame, name), kept, (height.shape[0], height.shape[1]))
            variables[name] = (("time", "x", "y"), frames)
        highest = {"highest": self._ground.highest}
        variables["height"] = (("x", "y"), np.asarray(height.values, dtype=float), highest)
        if "filled" in height.coords:
            variables["filled"] = (("x", "y"), height["filled"].values)
        taper = {name: height[name].variable for name in TAPER if name in height.coords}
        dataset = xr.Dataset(
            variables,
            coords={"time": ("time", stamp), "x": height["x"].values, "y": height["y"].values, **taper},
            attrs={
                "Conventions": "CF-1.11",
                "result_format": RESULT_FORMAT,
                **self._settings.to_attributes(),
                "history": str(height.attrs.get("history", "")),
            },
        )
        return annotate(dataset)

    def _window(self, index: int) -> Window:
        """The window of the final domain that a row was solved on."""
        grid = self._store.plain[index]["grid"]
        return self._ground.window_at(grid["corner"], grid["shape"])

    def _rescaled_to_domain(self, index: int) -> dict[str, float]:
        """What is counted over the domain, where that has grown since the row was taken up."""
        row, grid = (self._store.plain[index][part] for part in ("row", "grid"))
        if tuple(grid["domain"]) == self._ground.window.domain:
            return {}
        fraction = row["contact_area"] / self._area()
        if not self._store.plain[index]["kept"]:  # its pressure is not known any more
            return {"contact_fraction": fraction, "mean_gap": math.nan}
        source = self._store.arrays(index, "source")["source"]
        window = self._window(index)
        if self._ground.present.all():
            mean_gap = self._mean_gap(window, source, grid["level"])
        else:
            gap = np.empty(window.domain)
            self._fill("gap", index, window, gap)
            mean_gap = float(np.nanmean(gap))
        return {"contact_fraction": fraction, "mean_gap": mean_gap}

    def _field(self, name: str, step: Step, contact: NDArray[np.bool_]) -> Array:
        """A field of a step on the whole domain, in memory that nobody changes."""
        if name == "pressure":
            return step.shown.pressure
        if name == "displacement":
            return step.displacement
        found = np.empty(contact.shape)

        def fill(rows: slice) -> None:
            found[rows] = self._gap(step, contact, rows)

        passes.of_rows(fill, contact.shape, step.scene.halfspace.threads)
        return found

    def _gap(self, step: Step, contact: NDArray[np.bool_], rows: slice) -> Array:
        """Some rows of the gap on the whole domain, missing at absent cells. [m]"""
        gap = self._ground.gap[rows] + step.displacement_on(rows)
        self._clip_gap(gap, step.level, rows)
        gap[contact[rows]] = 0.0
        return gap

    def _mean_of_gap(self, step: Step, contact: NDArray[np.bool_]) -> float:
        """Its mean over the present cells, from some rows at a time. [m]"""
        present = self._ground.present

        def total(rows: slice) -> float:
            return float(np.sum(self._gap(step, contact, rows), where=present[rows]))

        gaps = passes.of_rows(total, contact.shape, step.scene.halfspace.threads)
        return sum(gaps) / np.count_nonzero(present)

    def _mean_gap(self, window: Window, source: Array, level: float) -> float:
        """Mean gap over a domain without absent cells, from the effective pressure in a window of it. [m]"""
        return self._ground.mean_gap + float(np.sum(source * self._mean_influence(window))) - level

    def _frame(self, name: str, index: int, out: Array) -> Array:
        """A field of a row over the final surface, written to ``out``, which holds zeros."""
        window = self._window(index)
        touched = out[window.surface_cells] if name == "pressure" else out  # zeros that stay cost nothing
        if self._ground.mirrored:
            self._fill(name, index, window, touched[quarter(touched.shape)])
            unfold(touched)
        else:
            self._fill(name, index, window, touched)
        return out

    def _fill(self, name: str, index: int, window: Window, out: Array) -> None:
        """Write a field over the domain, the pressure over the window alone."""
        if window.whole:
            out[...] = self._store.arrays(index, name)[name]
            return
        arrays = self._store.arrays(index, "source_pressure", "source")
        if name == "pressure":
            out[...] = arrays["source_pressure"]
            return
        for rows, displacement in self._reach(window).rows(arrays["source"]):
            if name == "displacement":
                out[rows] = displacement
            else:
                np.add(displacement, self._ground.gap[rows], out=out[rows])
                self._clip_gap(out[rows], self._store.plain[index]["grid"]["level"], rows)
        if name == "gap":
            out[window.cells][arrays["source_pressure"] > 0] = 0.0

    def _clip_gap(self, gap: Array, level: float, rows: slice = slice(None)) -> None:
        """Bring some rows of a gap to the level of the approach; it is missing at absent cells. [m]"""
        gap -= level
        np.maximum(gap, 0.0, out=gap)  # below the solver's tolerance inside the contact
        absent = ~self._ground.present[rows]
        if absent.any():
            gap[absent] = np.nan

    def _area(self) -> float:
        """Of the surface. [m2]"""
        dx, dy = self._ground.spacing
        return dx * dy * self._ground.height.size

    def _mean_plane(self, approach: float) -> dict[str, float]:
        """Separation of the mean plane of the profile and the undeformed plane in free space. [m]"""
        return {"mean_plane_separation": self._ground.mean_gap - approach} if self._has_mean_plane else {}

    def _status(self, step: Step, converged: bool, contact: NDArray[np.bool_]) -> int:
        if not converged:
            meaning = "not_converged"
        elif step.shown.force == 0:
            meaning = "open"
        elif self._ground.window.whole and np.count_nonzero(contact) == np.count_nonzero(self._ground.present):
            meaning = "full_contact"
        else:
            meaning = "converged"
        return STATUS_MEANINGS.index(meaning)


def meets_tolerance(step: Step, series_error: float) -> bool:
    """Whether an accepted step is worth a row where every step is kept: what is promised of it is within the tolerance.

    Where hardly any compliance is there at once, pressure jumps in each cell that enters. Only the approach is
    promised there to the tolerance, and the rest to :data:`_AT_MOST` of it. The short steps that lead over such a jump
    are no rows; nor, under given approach, are those in which a cell has entered, since the force jumps with it.
    """
    scene, state = step.scene, step.state
    if scene.time_step is not None or in_slide(step):  # the steps are as long as they are
        return True
    found = error_columns(step, series_error)
    most = _AT_MOST * scene.tolerance
    if found["stated_error"] > most or found["work_error"] > most * state.largest_work:
        return False
    if not scene.lacks_instantaneous_compliance(scene.program.duration):
        return not found["stated_error"] > scene.tolerance
    since = state.now.time - state.began
    if state.before is not None and state.now.time - state.before.time < scene.tolerance * since:
        return False
    if step.control == "approach" and _entered(step):
        return False
    return not found["approach_error"] > scene.tolerance * state.largest_approach


def in_slide(step: Step) -> bool:
    """Whether an accepted step is one of a slide."""
    scene = step.scene
    return bool(scene.motions) and scene.program.segments[segment_number(step.state)].slide is not None


def is_end_value(step: Step) -> bool:
    """Whether pressure and force of an accepted step are those at its end.

    Where hardly any compliance is there at once they belong to the whole step, unless it is kept: what is given, the
    load or the approach, is right all the same.
    """
    state = step.state
    since = state.began if state.before is None else state.before.time
    return step.control == "load" or not step.scene.lacks_instantaneous_compliance(state.now.time - since)


def _entered(step: Step) -> bool:
    """Whether a cell has come into contact within a step."""
    before = step.state.before
    return before is not None and bool(np.any(step.state.now.pressure[before.pressure == 0] > 0))


def _copy_views(arrays: dict[str, Array]) -> dict[str, Array]:
    """The arrays; what is a part of a larger one is copied, once, since it would keep all of that in memory."""
    own: dict[int, Array] = {}
    for array in arrays.values():
        if id(array) not in own:
            whole = array.base is None or array.base.nbytes == array.nbytes
            own[id(array)] = array if whole else array.copy()
    return {name: own[id(array)] for name, array in arrays.items()}


def staircase_area(contact: NDArray[np.bool_], scene: Scene) -> float:
    """Area by which counting cells is too large: a part of the perimeter's strip. [m2]

    The perimeter is where contact ends although the material goes on. Where the material itself ends, at an absent
    cell or at the border of a scan in free space, the edge of the contact is known, and the count exact.
    """
    free = ~contact if scene.present is None else scene.present & ~contact
    periodic, mirrored = scene.halfspace.boundary == "periodic", scene.halfspace.mirrored
    goes_on = scene.outside < math.inf  # beyond the window, where nothing touches
    # beyond a mirror a cell's neighbour is its image
    outside = {"before": goes_on and not mirrored, "beyond": goes_on}
    return staircase(contact, free, scene.halfspace.cell_area, periodic and not mirrored, **outside)
