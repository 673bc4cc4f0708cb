"""What a surface's heights say of the validity of its contact: slopes, curvature, waves, borders."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import xarray as xr

from roughvisc.topography.borders import border_mismatch
from roughvisc.topography.grid import spacing, taper_weights
from roughvisc.topography.parameters import parameters, rms_slope
from roughvisc.topography.spectrum import hann, last_octave, modes
from roughvisc.topography.synthesis import is_analytic


@dataclass(frozen=True)
class Texture:
    """Measures of a surface.

    Attributes
    ----------
    size : tuple of float
        Sides. [m]
    analytic : bool
        Whether it is an indenter or a wave by its recipe, which has no other waves.
    slope, laplacian : float
        Root mean squares of slope and Laplacian of the whole surface. [-], [1/m]
    roughness : float
        Sum of ``|q| |h_q|^2`` over its waves; NaN where points are absent. [m]
    last_octave : float
        Part of the rms slope that its shortest octave of waves adds; NaN where points are absent. [-]
    shortest : float
        Longest wavelength of that octave. [m]
    mismatch : float
        Difference of opposite borders over that of neighbouring rows, along the worse axis. [-]
    taper : float
        Margin of a taper over the side, along the worse axis; zero of a surface that was not tapered. [-]
    """

    size: tuple[float, float]
    analytic: bool
    slope: float
    laplacian: float
    roughness: float
    last_octave: float
    shortest: float
    mismatch: float
    taper: float = 0.0

    @property
    def smooth(self) -> bool:
        """Whether there is form alone: a recipe's, or waves longer than a quarter of the shorter side."""
        return self.analytic or self.shortest > min(self.size) / 2


def texture_of(height: xr.DataArray, boundary: str, recipe: str = "") -> Texture:
    """Measures of a surface under a boundary.

    Parameters
    ----------
    height : xarray.DataArray, dims (x, y)
        [m]
    boundary : {"free", "periodic"}
        In free space waves are those under a cosine window.
    recipe : str
        What the surface was made by; empty if it was measured.
    """
    height = height.transpose("x", "y")
    cells = spacing(height, "audit")
    periodic = boundary == "periodic"
    size = (height.sizes["x"] * cells[0], height.sizes["y"] * cells[1])
    measures = parameters(height, periodic)
    whole = {"roughness": math.nan, "last_octave": math.nan, "shortest": math.nan}
    if not height.isnull().any() and np.ptp(height.values) > 0:
        z = height.values - height.values.mean()
        whole = _spectral(z if periodic else hann(z), cells)
    return Texture(
        size=size,
        analytic=bool(recipe) and is_analytic(height.assign_attrs(recipe=recipe)),
        slope=float(measures["rms_slope"]),
        laplacian=2 * float(measures["rms_curvature"]),
        mismatch=max(border_mismatch(height).of_neighbours),
        taper=_taper_margin(height),
        **whole,
    )


def _taper_margin(height: xr.DataArray) -> float:
    """Margin of a taper over the side, along the worse axis, to two digits. [-]

    A margin ``w`` along each of two borders takes ``w`` off the integral of the weight along a side.
    """
    weights = taper_weights(height)
    return 0.0 if weights is None else float(f"{max(1 - one.mean() for one in weights):.2g}")


def loaded_slope(height: xr.DataArray, boundary: str, approach: float) -> float:
    """Root mean square slope where a surface may be loaded: in free space down to the largest approach. [-]

    Parameters
    ----------
    height : xarray.DataArray, dims (x, y)
        [m]
    boundary : {"free", "periodic"}
    approach : float
        The largest; NaN: the whole surface counts. [m]
    """
    periodic = boundary == "periodic"
    above = float(height.attrs.get("highest", height.max())) - float(height.max())
    return rms_slope(height, periodic, math.inf if periodic or math.isnan(approach) else approach - above)


def _spectral(z: np.ndarray, cells: tuple[float, float]) -> dict[str, float]:
    q_x, q_y, power, count = modes(z, cells, "forward")
    q = np.hypot(q_x, q_y)
    squares = count * q**2 * power
    begins = last_octave(q, squares)
    kept = float(squares[q <= begins].sum())
    return {
        "roughness": float((count * q * power).sum()),
        "last_octave": 1 - math.sqrt(kept / float(squares.sum())),
        "shortest": 2 * np.pi / begins if begins else 0.0,
    }
