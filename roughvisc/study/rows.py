"""From arrays to labels: each kept instant becomes a row of the result Dataset."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.mechanics.memory import padded
from roughvisc.mechanics.stepper import Scene, Step
from roughvisc.study.records import RowStore
from roughvisc.study.scene import Ground
from roughvisc.variables import STATUS_MEANINGS, annotate

#: Counted contact cells overestimate the area by this part of the staircase perimeter times the cell side; measured
#: on Hertz contacts of 6 to 200 cells' radius (0.080 to 0.092).
PERIMETER_CORRECTION = 0.088

Array = NDArray[np.float64]


class Rows:
    """Kept instants of one march, in order.

    Where the grid may grow, each row keeps the effective pressure too, so that what belongs to the larger grid is
    there in the end: nothing outside ever carried pressure.

    Parameters
    ----------
    ground : Ground
        The surface, which may grow meanwhile.
    fields : sequence of str
        Fields to keep.
    store : RowStore
        Where the rows are kept; what is in it counts as rows of an earlier part of the march.
    """

    def __init__(self, ground: Ground, fields: Sequence[str], store: RowStore) -> None:
        self._ground = ground
        self._fields = tuple(fields)
        self._store = store

    def __len__(self) -> int:
        return len(self._store.plain)

    def add(self, step: Step, worst_error: float, converged: bool, wall_time: float) -> None:
        """Take up an accepted step, with the worst of those since the last row."""
        shown = step.shown
        counted, frames = self._fields_of(step.scene, shown.pressure, shown.displacement, step.level)
        row = {
            "time": shown.time,
            "force": shown.force,
            "approach": shown.approach,
            "work": step.state.work,
            "iterations": step.state.iterations,
            "convolutions": step.state.convolutions,
            "residual": step.bound,
            "time_error": worst_error,
            "status": _status(step, converged, self._ground.present),
            "wall_time": wall_time,
            **counted,
        }
        grid = {"level": step.level, "corner": self._corner()}
        sources = {}
        if step.scene.enlarge is not None and shown.effective is not None:
            sources = {"source_pressure": shown.pressure, "source": shown.effective}
        self._store.append({"row": row, "grid": grid}, frames | sources)

    def dataset(self, scene: Scene, method: str) -> xr.Dataset:
        """All rows, on the grid of the final scene; fields in a file are read when they are asked for."""
        height = self._ground.height
        rows = [
            plain["row"] | ({} if self._is_settled(i) else self._settled(scene, i)[0])
            for i, plain in enumerate(self._store.plain)
        ]
        columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
        for counter in ("iterations", "convolutions"):
            columns[counter] = np.diff(columns[counter], prepend=0)
        stamp = columns.pop("time")
        variables: dict[str, Any] = {name: (("time",), values) for name, values in columns.items()}
        for name in self._fields:
            frames = self._store.stacked(partial(self._frame, scene, name), scene.halfspace.shape)
            variables[name] = (("time", "x", "y"), frames)
        variables["height"] = (("x", "y"), np.asarray(height.values, dtype=float))
        if "filled" in height.coords:
            variables["filled"] = (("x", "y"), height["filled"].values)
        dataset = xr.Dataset(
            variables,
            coords={"time": ("time", stamp), "x": height["x"].values, "y": height["y"].values},
            attrs={
                "Conventions": "CF-1.11",
                "boundary": scene.halfspace.boundary,
                "tolerance": scene.tolerance,
                "method": method,
                "history": str(height.attrs.get("history", "")),
            },
        )
        return annotate(dataset)

    def _frame(self, scene: Scene, name: str, index: int) -> Array:
        """A field of a row."""
        if self._is_settled(index):
            return self._store.arrays(index, name)[name]
        return self._settled(scene, index)[1][name]

    def _is_settled(self, index: int) -> bool:
        """Whether a row is on the final grid: every growth moves the corner."""
        return bool(self._store.plain[index]["grid"]["corner"] == self._corner())

    def _settled(self, scene: Scene, index: int) -> tuple[dict[str, float], dict[str, Array]]:
        """What is counted on the fields of a row of a smaller grid, and these, on the final one."""
        grid, arrays = self._store.plain[index]["grid"], self._store.arrays(index, "source_pressure", "source")
        axes = (self._ground.height[axis].values for axis in ("x", "y"))
        first = [int(np.searchsorted(axis, corner)) for axis, corner in zip(axes, grid["corner"], strict=True)]
        shape, offset = scene.halfspace.shape, (first[0], first[1])
        pressure = padded(arrays["source_pressure"], shape, offset)
        displacement = scene.halfspace.displacement(padded(arrays["source"], shape, offset))
        return self._fields_of(scene, pressure, displacement, grid["level"])

    def _corner(self) -> list[float]:
        """Centre of the first cell of the present grid. [m]"""
        return [float(self._ground.height[axis].values[0]) for axis in ("x", "y")]

    def _fields_of(
        self, scene: Scene, pressure: Array, displacement: Array, level: float
    ) -> tuple[dict[str, float], dict[str, Array]]:
        """What is counted on the fields, and those asked for."""
        present = self._ground.present
        area = scene.halfspace.cell_area
        contact = pressure > 0
        gap = scene.gap + displacement
        gap -= level
        np.maximum(gap, 0.0, out=gap)  # below the solver's tolerance inside the contact
        gap[contact] = 0.0
        gap[~present] = np.nan
        touching = float(np.count_nonzero(contact)) * area
        counted = {
            "contact_area": touching,
            "contact_area_corrected": max(touching - _staircase(contact, scene), 0.0),
            "contact_fraction": touching / (area * contact.size),
            "mean_gap": float(np.nanmean(gap)),
        }
        available = {"pressure": pressure, "gap": gap, "displacement": displacement}
        return counted, {name: available[name] for name in self._fields}


def _status(step: Step, converged: bool, present: NDArray[np.bool_]) -> int:
    if not converged:
        meaning = "not_converged"
    elif step.shown.force == 0:
        meaning = "open"
    elif (step.shown.pressure > 0)[present].all():
        meaning = "full_contact"
    else:
        meaning = "converged"
    return STATUS_MEANINGS.index(meaning)


def _staircase(contact: NDArray[np.bool_], scene: Scene) -> float:
    """Area by which counting cells is too large: a part of the perimeter's strip. [m2]"""
    dx, dy = scene.halfspace.spacing
    faces_x = np.count_nonzero(contact[1:] != contact[:-1])
    faces_y = np.count_nonzero(contact[:, 1:] != contact[:, :-1])
    if scene.halfspace.boundary == "periodic":
        faces_x += np.count_nonzero(contact[0] != contact[-1])
        faces_y += np.count_nonzero(contact[:, 0] != contact[:, -1])
    # a face across x is dy long and lies in a strip dx wide, and the other way round
    return PERIMETER_CORRECTION * dx * dy * (faces_x + faces_y)
