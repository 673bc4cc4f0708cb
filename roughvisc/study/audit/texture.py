"""Measures of a surface that an audit needs: slopes, its shortest waves, and how well it repeats."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.topography.borders import border_mismatch, is_analytic
from roughvisc.topography.framing import mirror
from roughvisc.topography.grid import spacing
from roughvisc.topography.parameters import parameters, rms_slope
from roughvisc.topography.spectrum import hann, last_octave, modes

#: Part of the mean square slope beyond the shortest wave of a recipe, up to which it is the recipe's surface.
_SHORTER = 1e-6


@dataclass(frozen=True)
class Stated:
    """The shortest wave that a recipe states, along the axis on which it has the fewest cells.

    Attributes
    ----------
    wavelength : float
        [m]
    cells : float
        Of the grid, in one such wave.
    """

    wavelength: float
    cells: float


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
    stated : Stated or None
        The shortest wave by the recipe, if it has waves and there are no shorter ones.
    """

    size: tuple[float, float]
    analytic: bool
    slope: float
    laplacian: float
    roughness: float
    last_octave: float
    shortest: float
    mismatch: float
    stated: Stated | None = None

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
    boundary : {"free", "periodic", "mirror"}
        In free space waves are those under a cosine window. With mirror images the surface is unfolded.
    recipe : str
        What the surface was made by; empty if it was measured.
    """
    height = height.transpose("x", "y")
    if boundary == "mirror":
        height, boundary = mirror(height), "periodic"
    cells = spacing(height, "audit")
    periodic = boundary == "periodic"
    size = (height.sizes["x"] * cells[0], height.sizes["y"] * cells[1])
    measures = parameters(height, periodic)
    whole = {"roughness": math.nan, "last_octave": math.nan, "shortest": math.nan}
    if not height.isnull().any() and np.ptp(height.values) > 0:
        z = height.values - height.values.mean()
        whole = _spectral(z if periodic else hann(z), cells)
    analytic = bool(recipe) and is_analytic(height.assign_attrs(recipe=recipe))
    return Texture(
        size=size,
        analytic=analytic,
        stated=_stated_waves(recipe, height, cells, analytic),
        slope=float(measures["Sdq"]),
        laplacian=2 * float(measures["rms_curvature"]),
        mismatch=max(border_mismatch(height).of_neighbours),
        **whole,
    )


def loaded_slope(height: xr.DataArray, boundary: str, approach: float) -> float:
    """Root mean square slope where a surface may be loaded: in free space down to the largest approach. [-]

    Parameters
    ----------
    height : xarray.DataArray, dims (x, y)
        [m]
    boundary : {"free", "periodic", "mirror"}
    approach : float
        The largest; NaN: the whole surface counts. [m]
    """
    periodic = boundary == "periodic"
    above = float(height.attrs.get("highest", height.max())) - float(height.max())
    return rms_slope(height, periodic, math.inf if boundary != "free" or math.isnan(approach) else approach - above)


def _stated_waves(recipe: str, height: xr.DataArray, cells: tuple[float, float], analytic: bool) -> Stated | None:
    """The shortest wave by a recipe; None if that states none, or the heights hold shorter ones and are others now."""
    try:
        made = json.loads(recipe or "{}")
        waves = _shortest_along(made["name"], made["parameters"])
    except (KeyError, TypeError, ValueError):
        return None
    if waves is None or height.isnull().any() or not (analytic or _without_shorter(height.values, cells, waves)):
        return None
    fewest = min(zip(waves, cells, strict=True), key=lambda along: along[0] / along[1])
    return Stated(fewest[0], fewest[0] / fewest[1])


def _shortest_along(name: str, parameters: Mapping[str, Any]) -> tuple[float, float] | None:
    """Shortest wavelength along x and along y that a recipe states; None of a form without waves. [m]"""
    if name == "wavy":
        wave = float(parameters["wavelength"])
        return (wave, wave if parameters["waves"] == 2 else math.inf)
    if name == "self_affine":
        wave, stretch = float(parameters["shortcut"]), math.sqrt(parameters["anisotropy"])
        return (wave * stretch, wave / stretch)
    return None


def _without_shorter(z: np.ndarray, cells: tuple[float, float], waves: tuple[float, float]) -> bool:
    """Whether heights that repeat have next to nothing beyond the ellipse of these wavelengths."""
    q_x, q_y, power, count = modes(z - z.mean(), cells, "forward")
    squares = count * (q_x**2 + q_y**2) * power
    # a profile that is the same along an axis has waves of infinite length there, and none that is shorter
    across = (
        np.multiply(q, wave, out=np.zeros_like(q), where=q != 0) for q, wave in zip((q_x, q_y), waves, strict=True)
    )
    beyond = np.hypot(*across) > 2 * np.pi * (1 + 1e-9)
    return bool(squares[beyond].sum() <= _SHORTER * squares.sum())


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
