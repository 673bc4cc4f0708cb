"""Surface, contact and bodies of a result, as an audit needs them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.observables.histories import history
from roughvisc.topography.borders import is_analytic
from roughvisc.topography.framing import mirror
from roughvisc.topography.grid import spacing
from roughvisc.topography.parameters import rms_slope
from roughvisc.topography.spectrum import hann, last_octave, modes
from roughvisc.variables import axis_of

Array = NDArray[np.float64]

#: Relative rounding of loads.
_ROUNDING = 1e-9


class NotKnown(Exception):
    """A number is not known; the message names the missing input."""


@dataclass(frozen=True)
class Scene:
    """Surface, contact and bodies of a result. A property that the result does not record raises :class:`NotKnown`.

    Attributes
    ----------
    dataset : xarray.Dataset
        Result of one case.
    given : mapping
        Stated properties, in SI.
    """

    dataset: xr.Dataset
    given: Mapping[str, Any]

    def need(self, *names: str) -> list[float]:
        """Return stated properties by name. [SI]"""
        if missing := [name for name in names if name not in self.given]:
            raise NotKnown("; ".join(f"{name} is not given" for name in missing) + ".")
        return [self.given[name] for name in names]

    @property
    def boundary(self) -> str:
        """``free``, ``periodic`` or ``mirror``."""
        return str(self.dataset.attrs["boundary"])

    # ---------------------------------------------------------------------------------------------------- surface

    @cached_property
    def height(self) -> xr.DataArray:
        """Heights over (x, y). [m]"""
        if "height" not in self.dataset:
            raise NotKnown("The result contains no heights.")
        return self.dataset["height"].transpose("x", "y").compute()

    @cached_property
    def period(self) -> xr.DataArray:
        """Heights of one period: with the mirror images under a mirror boundary. [m]"""
        return mirror(self.height) if self.boundary == "mirror" else self.height

    @property
    def cells(self) -> tuple[float, float]:
        """Cell sides. [m]"""
        return spacing(self.height, "audit")

    @property
    def sides(self) -> list[float]:
        """Sides of one period: with the mirror images under a mirror boundary. [m]"""
        return [count * side for count, side in zip(self.period.shape, self.cells, strict=True)]

    @cached_property
    def waves(self) -> tuple[float, float, float]:
        """``sum |q| |h_q|^2`` [m], part of the rms slope from the last octave [-], and its longest wavelength [m].

        In free space a cosine window is applied to the heights. NaN if the surface is flat or points are missing.
        """
        z = self.period.values - self.period.values.mean()
        if not np.ptp(z) > 0:
            return math.nan, math.nan, math.nan
        q_x, q_y, power, count = modes(hann(z) if self.boundary == "free" else z, self.cells)
        q = np.hypot(q_x, q_y)
        squares = count * q**2 * power
        begins = last_octave(q, squares)
        kept = float(squares[q <= begins].sum()) / float(squares.sum())
        return float((count * q * power).sum()), 1 - math.sqrt(kept), 2 * np.pi / begins if begins else 0.0

    @property
    def is_smooth(self) -> bool:
        """Whether the surface has no roughness: a smooth recipe, or wavelengths above a quarter of the shorter side."""
        return is_analytic(self.period) or self.waves[2] > min(self.sides) / 2

    @cached_property
    def loaded_slope(self) -> float:
        """Root mean square slope of the loaded surface: in free space, of the part above the largest approach. [-]"""
        depth = float(self.dataset["approach"].max()) if self.boundary == "free" else math.inf
        slope = rms_slope(self.height, self.boundary == "periodic", depth)
        if math.isnan(slope):
            raise NotKnown("The result contains no loaded heights.")
        return slope

    # ---------------------------------------------------------------------------------------------------- contact

    @cached_property
    def fullest(self) -> xr.Dataset:
        """Row with the largest force; among equal forces the last row with the largest contact area."""
        force, area = self.dataset["force"].values, self.dataset["contact_area"].values
        ranks = np.lexsort((np.nan_to_num(area), force >= force.max() * (1 - _ROUNDING)))  # NaN: not solved
        return self.dataset.isel({axis_of(self.dataset): ranks[-1]})

    @property
    def force(self) -> float:
        """Largest force. [N]"""
        if not self.fullest["force"] > 0:
            raise NotKnown("The result has no load, and therefore no contact.")
        return float(self.fullest["force"])

    def pressure_in(self, row: xr.Dataset) -> Array:
        """Return the pressure in a row with contact, zero at missing points. [Pa]"""
        pressure = np.nan_to_num(row["pressure"].transpose("x", "y").values) if "pressure" in row else np.zeros(1)
        if not pressure.any():
            raise NotKnown('Keep the pressure, fields = ["pressure"].')
        return pressure

    @cached_property
    def pressure(self) -> Array:
        """Pressure in the row with the largest force. [Pa]"""
        return self.pressure_in(self.fullest)

    @property
    def half_width(self) -> float:
        """Half the longer side of the contact in free space, otherwise half the longer side of the surface. [m]"""
        if self.boundary != "free":
            return max(self.sides) / 2
        spans = [np.ptp(at) + 1 for at in np.nonzero(self.pressure)]
        return max(count * side for count, side in zip(spans, self.cells, strict=True)) / 2

    @property
    def curvature(self) -> float:
        """Mean curvature of the profile over cells in contact with known neighbours; positive at summits. [1/m]"""
        z = self.height
        curvature = sum(
            (2 * z - z.shift({axis: 1}) - z.shift({axis: -1})) / (2 * side**2)
            for axis, side in zip(("x", "y"), self.cells, strict=True)
            if z.sizes[axis] > 1
        )
        return float(xr.DataArray(curvature).where(self.pressure > 0).mean())

    @cached_property
    def slide(self) -> tuple[float, float, xr.Dataset]:
        """Largest speed [m/s], largest friction power [W], and the row with this power; zeros if nothing slides."""
        if "speed" in self.dataset.dims:
            power = np.nan_to_num((self.dataset["friction_force"] * self.dataset["speed"]).values)  # NaN: not solved
            return float(self.dataset["speed"].max()), float(power.max()), self.dataset.isel(speed=power.argmax())
        if "sliding_distance" not in self.dataset:
            return 0.0, 0.0, self.fullest
        steps = history(self.dataset)
        lasting = np.diff(steps["time"]) > 0
        if not lasting.any():
            raise NotKnown("The speed of the slides is not known: audit the result with all of its steps.")
        speeds = np.diff(steps["sliding_distance"])[lasting] / np.diff(steps["time"])[lasting]
        power = steps["friction_force"].values[1:][lasting] * speeds
        return float(speeds.max()), float(np.max(power)), self.fullest

    # ----------------------------------------------------------------------------------------------------- bodies

    @property
    def facts(self) -> Mapping[Any, Any]:
        """Attributes of the result, with facts on material and program."""
        if "time_scale" not in self.dataset.attrs:
            raise NotKnown("The material is not stated: audit the file from run, or the Dataset from simulate.")
        return self.dataset.attrs

    @property
    def late(self) -> float:
        """Contact compliance at the end of the program. [1/Pa]"""
        if not self.facts["compliance_at_end"] > 0:
            raise NotKnown("The body does not deform by the end of the program.")
        return float(self.facts["compliance_at_end"])
