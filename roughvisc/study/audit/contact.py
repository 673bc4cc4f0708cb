"""The contact of one row as its pressures show it: spots, their curvature, the largest pressure of all rows."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import fft, ndimage

from roughvisc.mechanics.bodies.sheet import Sheet, complement
from roughvisc.topography.grid import spacing

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Contact:
    """What the pressures of a result show.

    Attributes
    ----------
    peak : float
        Largest pressure of all rows. [Pa]
    spots : int
        Connected regions in contact where the force is largest; one across a border that repeats counts twice.
    curvature : float
        Mean curvature of the profile over them, positive at summits. [1/m]
    half_width : float
        Half of what they extend over, along the longer side. [m]
    pressure : ndarray, shape (nx, ny)
        There. [Pa]
    cells : tuple of float
        Cell sides. [m]
    """

    peak: float
    spots: int
    curvature: float
    half_width: float
    pressure: Array
    cells: tuple[float, float]

    def relief(self, sheet: Sheet) -> float:
        """What the base of a sheet takes off the displacement under the pressure, over the compliance. [m Pa]

        The mean weighted by the pressure, with periodic boundaries, the sheet's own compression left out.
        """
        power = np.abs(fft.rfft2(self.pressure)) ** 2
        (nx, ny), (dx, dy) = self.pressure.shape, self.cells
        q = 2 * np.pi * np.hypot(fft.fftfreq(nx, dx)[:, None], fft.rfftfreq(ny, dy))
        power[0, 0], q[0, 0] = 0.0, 1.0
        power[:, 1 : (ny + 1) // 2] *= 2  # conjugates are not stored
        lost = power * 2 / q * complement(q * sheet.thickness, sheet.poisson, sheet.base)
        return float(lost.sum() / (nx * ny * self.pressure.sum()))


def contact_of(dataset: xr.Dataset, row: xr.Dataset) -> Contact | None:
    """The contact of a result in one of its rows; None if nothing touches.

    Parameters
    ----------
    dataset : xarray.Dataset
        With ``pressure``, which is read a frame at a time.
    row : xarray.Dataset
        The same in that row.
    """
    pressures = dataset["pressure"].transpose(..., "x", "y")
    peak = max(float(np.nanmax(frame.values)) for frame in pressures)
    pressure = np.nan_to_num(row["pressure"].transpose("x", "y").values)
    touching = pressure > 0
    if not touching.any():
        return None
    height = dataset["height"].transpose("x", "y")
    cells = spacing(height, "audit")
    extents = (np.ptp(at) + 1 for at in np.nonzero(touching))
    return Contact(
        peak=peak,
        spots=int(ndimage.label(touching, np.ones((3, 3)))[1]),
        curvature=_curvature(height.values, cells, touching),
        half_width=max(n * d for n, d in zip(extents, cells, strict=True)) / 2,
        pressure=pressure,
        cells=cells,
    )


def _curvature(z: Array, cells: tuple[float, float], where: NDArray[np.bool_]) -> float:
    """Mean of minus half the Laplacian over some cells whose neighbours are all there; NaN if none is."""
    padded = np.pad(z, [(1, 1) if n > 1 else (0, 0) for n in z.shape], constant_values=np.nan)
    curvature = np.zeros(z.shape)
    for axis, d in enumerate(cells):
        if z.shape[axis] > 1:
            across = 1 - axis
            inner = np.take(padded, range(1, padded.shape[across] - 1), across) if z.shape[across] > 1 else padded
            curvature -= np.diff(inner, 2, axis) / (2 * d**2)
    found = curvature[where & np.isfinite(curvature)]
    return float(found.mean()) if found.size else math.nan
