"""Rows of a curve of friction: each speed with its steady state, and the Dataset that they form."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.mechanics.materials.frequency import over_frequencies
from roughvisc.mechanics.materials.models import Material
from roughvisc.mechanics.sliding.persson import persson
from roughvisc.mechanics.sliding.steady import SteadyState
from roughvisc.study.simulation.faces import AxisTransform, SlidingGrid, areas, on_rows
from roughvisc.study.simulation.friction_grid_error import CoarserFaces
from roughvisc.study.simulation.scene import Ground
from roughvisc.study.simulation.wake import contact_stands_alone, creep_left, surface_stands_alone, wake_note
from roughvisc.study.statement.curve import SteadySliding
from roughvisc.study.statement.settings import Settings
from roughvisc.study.storage.records import RowStore
from roughvisc.topography.grid import TAPER
from roughvisc.variables import STATUS_MEANINGS

Array = NDArray[np.float64]


class Speeds:
    """Steady states of one curve, from the lowest speed to the highest.

    Parameters
    ----------
    ground : Ground
        The surface.
    material : Material
        Of the body.
    curve : Curve
        What is asked.
    settings : Settings
        Tolerance, fields, whether the grid's error is asked for.
    store : RowStore
        Where the rows are kept; those in it are of lower speeds.
    """

    def __init__(
        self,
        ground: Ground,
        material: Material,
        curve: SteadySliding,
        settings: Settings,
        store: RowStore,
    ) -> None:
        self._ground, self._material, self._curve, self._settings, self._store = (
            ground,
            material,
            curve,
            settings,
            store,
        )
        self._turn = AxisTransform.of(curve.direction)
        self._force = curve.force(ground.nominal_area)
        self._face = SlidingGrid.of(ground, self._turn)
        #: Attributes of the result that say what was computed beside the curve.
        self.told: dict[str, str] = {}
        self._alone = surface_stands_alone(ground.height)
        self._smooth: SlidingGrid | None = None
        if curve.last_octave:
            self._smooth, shortest = self._face.smooth()
            self.told["last_octave"] = f"waves shorter than {shortest:.4g} m"
        self._coarser = CoarserFaces(self._face) if settings.grid_error else None

    def add(self, number: int, clock: Callable[[], float]) -> None:
        """Slide at the speed of that number; the clock gives the time spent. [s]"""
        speed, tolerance = self._curve.asked[number], self._settings.tolerance
        # once a speed: a table takes a fit
        law = over_frequencies(self._material, speed * self._face.waves, 0.1 * tolerance)
        sliding = self._face.sliding(speed, law)
        found = self._face.slide(sliding, self._force, tolerance)
        row, fields = self._row(found, speed)
        row["friction_force_across"] = sliding.force_across(on_rows(found.pressure, sliding))
        theory = persson(sliding, on_rows(self._face.gap, sliding), row["nominal_pressure"])
        row["persson_friction_coefficient"] = theory.friction_coefficient
        row["persson_contact_fraction"] = theory.contact_fraction
        if self._smooth is not None:
            row |= self._added(row, found, self._smooth.slide(sliding, self._force, tolerance))
        if self._coarser is not None:
            row |= self._coarser.errors(found, speed, law, self._force, tolerance)
        row["wall_time"] = clock()
        self._store.append({"number": number, "row": row, "creep_left": self._creep_left(found, speed, law)}, fields)

    def _row(self, found: SteadyState, speed: float) -> tuple[dict[str, Any], dict[str, Array]]:
        """Numbers and fields of a state, in the frame of the profile."""
        ground, force = self._ground, self._force
        pressure, displacement = self._turn.back(found.pressure), self._turn.back(found.displacement)
        contact = pressure > 0
        counted, area = areas(contact, ground.spacing)
        gap = np.maximum(ground.gap + displacement - found.approach, 0.0)
        gap[contact] = 0.0
        whole = "full_contact" if contact.all() else "converged"
        row = {
            "force": force,
            "nominal_pressure": force / ground.nominal_area,
            "approach": found.approach,
            "contact_area": area,
            "contact_area_counted": counted,
            "contact_fraction": ground.contact_fraction(contact, area),
            "mean_gap": float(gap.mean()),
            "friction_coefficient": found.power_force / force,
            "friction_force": found.power_force,
            "dissipated_power": found.power_force * speed,
            "loss_tangent": found.loss_tangent,
            "pressure_residual": found.residual,
            "friction_residual": found.friction_residual,
            "iterations": found.vectors,
            "outer_iterations": found.iterations,
            "status": STATUS_MEANINGS.index(whole if found.converged else "not_converged"),
        }
        fields = {"pressure": np.ascontiguousarray(pressure), "gap": gap}
        return row, {name: fields[name] for name in self._settings.fields}

    def _creep_left(self, found: SteadyState, speed: float, law: Material) -> float:
        """Part of the creep that has not recovered where the next contact comes; 0 unless the contact stands alone."""
        if not (contact_stands_alone(found.pressure, 0) if self._alone is None else self._alone):
            return 0.0
        return creep_left(*(float(law.contact_compliance(t)) for t in (self._face.period / speed, np.inf)))

    def wake_note(self) -> str:
        """What to say of a contact that runs into the wake of the one before, at all speeds; empty if none does."""
        left = {self._curve.asked[plain["number"]]: plain["creep_left"] for plain in self._store.plain}
        return wake_note(left, self._face.period)

    def _added(self, row: dict[str, Any], found: SteadyState, without: SteadyState) -> dict[str, float]:
        """What the shortest octave of waves adds, relative to what there is with it."""
        if not (found.converged and without.converged and found.power_force > 0):
            return {"last_octave_friction": np.nan, "last_octave_area": np.nan}
        area = areas(without.pressure > 0, self._ground.spacing)[1]
        return {
            "last_octave_friction": 1 - without.power_force / found.power_force,
            "last_octave_area": 1 - area / row["contact_area"],
        }

    def dataset(self) -> xr.Dataset:
        """All rows, in the order in which the speeds were given; fields in a file are read when they are asked for."""
        height = self._ground.height
        numbers = [plain["number"] for plain in self._store.plain]
        order = [int(one) for one in np.argsort(numbers)]
        rows = [self._store.plain[place]["row"] for place in order]
        variables: dict[str, Any] = {name: (("speed",), np.array([row[name] for row in rows])) for name in rows[0]}
        for name in self._settings.fields:
            frames = self._store.stacked(partial(self._frame, name), order, (height.shape[0], height.shape[1]))
            variables[name] = (("speed", "x", "y"), frames)
        highest = {"highest": self._ground.highest}
        variables["height"] = (("x", "y"), np.asarray(height.values, dtype=float), highest)
        if "filled" in height.coords:
            variables["filled"] = (("x", "y"), height["filled"].values)
        coords = {"speed": ("speed", np.array(self._curve.asked)), "x": height["x"].values, "y": height["y"].values}
        coords |= {name: height[name].variable for name in TAPER if name in height.coords}
        return xr.Dataset(variables, coords=coords)

    def _frame(self, name: str, row: int, out: Array) -> Array:
        """A field at one speed, written to ``out``."""
        out[...] = self._store.arrays(row, name)[name]
        return out
