"""From arrays to labels: each kept instant becomes a row of the result Dataset."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.mechanics.memory import padded
from roughvisc.mechanics.stepper import Scene, Step
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
    """

    def __init__(self, ground: Ground, scene: Scene, fields: Sequence[str]) -> None:
        self._ground = ground
        self._scene = scene
        self._fields = tuple(fields)
        self._rows: list[dict[str, Any]] = []
        self._sources: list[tuple[Array, Array, float, tuple[float, float]]] = []

    def __len__(self) -> int:
        return len(self._rows)

    def add(self, step: Step, wall_time: float) -> None:
        """Take up an accepted step."""
        shown, self._scene = step.shown, step.scene
        row = {
            "time": shown.time,
            "force": shown.force,
            "approach": shown.approach,
            "work": step.state.work,
            "iterations": step.state.iterations,
            "convolutions": step.state.convolutions,
            "residual": step.bound,
            "time_error": step.time_error,
            "status": _status(step, self._ground.present),
            "wall_time": wall_time,
        }
        self._rows.append(row | self._fields_of(shown.pressure, shown.displacement, step.level))
        if self._scene.enlarge is not None and shown.effective is not None:
            corner = tuple(float(self._ground.height[axis].values[0]) for axis in ("x", "y"))
            self._sources.append((shown.pressure, shown.effective, step.level, (corner[0], corner[1])))

    def dataset(self, method: str) -> xr.Dataset:
        """All rows, on the final grid."""
        self._settle()
        height, scene = self._ground.height, self._scene
        columns = {name: np.array([row[name] for row in self._rows]) for name in self._rows[0]}
        for counter in ("iterations", "convolutions"):
            columns[counter] = np.diff(columns[counter], prepend=0)
        stamp = columns.pop("time")
        variables: dict[str, Any] = {
            name: (("time", "x", "y") if name in self._fields else ("time",), values)
            for name, values in columns.items()
        }
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

    def _settle(self) -> None:
        """Bring the rows of smaller grids to the final one."""
        shape = self._scene.halfspace.shape
        x, y = self._ground.height["x"].values, self._ground.height["y"].values
        for row, (pressure, effective, level, corner) in zip(self._rows, self._sources, strict=bool(self._sources)):
            if pressure.shape != shape:
                offset = (int(np.searchsorted(x, corner[0])), int(np.searchsorted(y, corner[1])))
                displacement = self._scene.halfspace.displacement(padded(effective, shape, offset))
                row |= self._fields_of(padded(pressure, shape, offset), displacement, level)

    def _fields_of(self, pressure: Array, displacement: Array, level: float) -> dict[str, Any]:
        """The fields asked for, and what is counted on them."""
        scene, present = self._scene, self._ground.present
        area = scene.halfspace.cell_area
        contact = pressure > 0
        gap = scene.gap + displacement
        gap -= level
        np.maximum(gap, 0.0, out=gap)  # below the solver's tolerance inside the contact
        gap[contact] = 0.0
        gap[~present] = np.nan
        counted = float(np.count_nonzero(contact)) * area
        available = {"pressure": pressure, "gap": gap, "displacement": displacement}
        return {
            "contact_area": counted,
            "contact_area_corrected": max(counted - _staircase(contact, scene), 0.0),
            "contact_fraction": counted / (area * contact.size),
            "mean_gap": float(np.nanmean(gap)),
            **{name: available[name] for name in self._fields},
        }


def _status(step: Step, present: NDArray[np.bool_]) -> int:
    if not step.converged:
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
