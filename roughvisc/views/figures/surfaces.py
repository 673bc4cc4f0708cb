"""Quick look at a height grid: map, profile, distribution of heights, power spectrum."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from roughvisc.errors import InputError
from roughvisc.topography.bandwidth import off_plane
from roughvisc.topography.grid import cell_edges, spacing
from roughvisc.topography.spectrum import psd
from roughvisc.variables import VARIABLES
from roughvisc.views.figures.axes import (
    BLUE,
    VERMILION,
    Unit,
    letter_panels,
    new_figure,
    spread_axis,
    styled,
    unit_for,
)
from roughvisc.views.figures.fields import draw_map, label_plane, plane_ratio, plane_unit


def _checked(height: xr.DataArray) -> xr.DataArray:
    if isinstance(height, xr.Dataset):
        if "height" not in height:
            raise InputError("the Dataset holds no 'height'")
        height = height["height"]
    if not isinstance(height, xr.DataArray) or set(height.dims) != {"x", "y"}:
        found = height.dims if isinstance(height, xr.DataArray) else type(height).__name__
        raise InputError(f"expected heights with dimensions x and y, found {found}")
    height = height.transpose("x", "y").load().rename("height")
    if not np.isfinite(height).any():
        raise InputError("the surface is all missing: nothing to draw")
    return height


@styled
def surface(height: xr.DataArray) -> Figure:
    """Quick look at a surface: map, profile through its middle, distribution of heights, power spectrum.

    Parameters
    ----------
    height : xarray.DataArray, dims (x, y), or a Dataset that holds one as ``height``
        Heights, peaks up; missing points are drawn in light grey and counted. [m]

    Returns
    -------
    matplotlib.figure.Figure

    Notes
    -----
    Map and profile show the heights as they are; distribution and spectrum those less their mean plane. The
    distribution is shown with the normal one of the same Sq. The spectrum is that of :func:`roughvisc.psd` under a
    Hann window, missing points on the plane: a quick look, not a measurement.
    """
    height = _checked(height)
    unit, plane = unit_for(height - height.mean(), "m"), plane_unit(height)
    figure, panels = _panels(plane_ratio(height))
    on_map = panels["map"]
    image = draw_map(on_map, height, unit, plane)
    flat = plane_ratio(height) < 0.4
    bar = figure.colorbar(image, ax=on_map, location="top" if flat else "right", pad=0.02, aspect=50 if flat else 20)
    bar.set_label(unit.label(VARIABLES["height"].label))
    label_plane(on_map, height, plane)
    missing = float(height.isnull().mean())
    if missing:
        figure.suptitle(f"{100 * missing:.2g} % of the points are missing (grey)", fontsize=8.5)
    _draw_profile(panels["profile"], on_map, height, unit, plane)
    levelled = off_plane(height)
    _draw_heights(panels["heights"], levelled, unit_for(levelled, "m"))
    _draw_spectrum(panels["spectrum"], levelled)
    letter_panels(list(panels.values()))
    return figure


def _panels(ratio: float) -> tuple[Figure, dict[str, Axes]]:
    """Figure and its panels, arranged so that a map of these proportions has room."""
    rows, size, heights = (("map", "profile"), ("heights", "spectrum")), (7.0, 5.2), (1, 1)
    if ratio < 0.4:
        rows, size = (("map", "map"), ("profile", "profile"), ("heights", "spectrum")), (6.4, 6.0)
        heights = (0.8, 1, 1.3)
    elif ratio > 1.7:
        rows, size = (("map", "profile"), ("map", "heights"), ("map", "spectrum")), (6.4, 6.4)
        heights = (1, 1, 1)
    figure = new_figure(*size)
    panels = figure.subplot_mosaic(rows, height_ratios=heights)
    return figure, panels


def _draw_profile(ax: Axes, on_map: Axes, height: xr.DataArray, unit: Unit, plane: Unit) -> None:
    middle = height.sizes["y"] // 2
    ax.plot(plane(height["x"]), unit(height.isel(y=middle)), color=BLUE, lw=0.9)
    place = float(height["y"][middle])
    on_map.axhline(plane(place), color="w", lw=0.8, ls=(0, (4, 2)))
    limits = plane(cell_edges(height["x"]))
    ax.set_xlim(limits[0], limits[-1])
    ax.set_title(f"y = {plane.text(place)}", loc="right")
    ax.set_xlabel(plane.label("x"))
    ax.set_ylabel(unit.label(VARIABLES["height"].label))
    ax.grid(color="0.9", lw=0.5)


def _draw_heights(ax: Axes, levelled: xr.DataArray, unit: Unit) -> None:
    values = unit(levelled.values[np.isfinite(levelled.values)])
    deviation = float(values.std())
    bins = int(np.clip(math.sqrt(values.size) / 1.5, 8, 100))
    if deviation == 0:
        ax.text(0.5, 0.5, "flat: one height", transform=ax.transAxes, ha="center", va="center", color="0.4")
        ax.set_xlabel(unit.label("Height, levelled"))
        ax.set_yticks([])
        return
    ax.hist(values, bins=bins, density=True, color=BLUE, alpha=0.45, histtype="stepfilled", label="measured")
    shown = np.linspace(values.min(), values.max(), 200)
    bell = np.exp(-(((shown - values.mean()) / deviation) ** 2) / 2) / (deviation * math.sqrt(2 * math.pi))
    ax.plot(shown, bell, color=VERMILION, lw=1, label=f"normal, Sq = {unit.text(deviation * unit.factor)}")
    ax.set_ylim(0, 1.45 * ax.get_ylim()[1])
    ax.legend(loc="upper right", handlelength=1.2)
    ax.set_xlabel(unit.label("Height, levelled"))
    ax.set_ylabel(f"Density [1/{unit.symbol}]")


def _draw_spectrum(ax: Axes, levelled: xr.DataArray) -> None:
    ax.set_xlabel("Wavevector [rad/m]")
    ax.set_ylabel("Power spectral density [m⁴]")
    drawn = False
    if min(levelled.shape) >= 8:
        spectrum = psd(levelled.fillna(0.0), window="hann")
        spectrum = spectrum.sel(wavevector=slice(np.pi / max(spacing(levelled))))  # rings that are seen whole
        wavevector, density = spectrum["wavevector"].values, spectrum["psd"].values
        scale = {"m": 1.0, "mm": 1e-3, "µm": 1e-6, "nm": 1e-9}
        symbol = "µm" if wavevector[-1] > 1e4 else "mm"
        symbol = "nm" if wavevector[-1] > 1e8 else symbol
        shown = density > 0
        if shown.any():
            x, y = wavevector[shown] * scale[symbol], density[shown] / scale[symbol] ** 4
            ax.plot(x, y, color=BLUE, lw=1)
            spread_axis(ax.xaxis, x, always=True)
            spread_axis(ax.yaxis, y, always=True)
            ax.set_xlabel(f"Wavevector [rad/{symbol}]")
            ax.set_ylabel(f"Power spectral density [{symbol}⁴]")
            ax.grid(color="0.9", lw=0.5)
            drawn = True
    if not drawn:
        ax.text(0.5, 0.5, "too small or too flat", transform=ax.transAxes, ha="center", va="center", color="0.4")
        ax.set_xticks([])
        ax.set_yticks([])
