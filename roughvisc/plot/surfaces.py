"""Quick look at a height grid: map, profile, distribution of heights, power spectrum."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from roughvisc.errors import InputError
from roughvisc.plot import style
from roughvisc.plot.coarsened import drawn, stride
from roughvisc.plot.fields import (
    Scale,
    bar_side,
    colour_bar,
    draw_map,
    label_plane,
    measured_part,
    plane_ratio,
    plane_unit,
)
from roughvisc.topography.bandwidth import off_plane
from roughvisc.topography.grid import cell_edges, checked, spacing
from roughvisc.topography.missing_points import fill
from roughvisc.topography.spectrum import psd
from roughvisc.units import Unit, unit_for
from roughvisc.variables import VARIABLES

#: Robust standard deviations from the median to which the scale of heights reaches.
_REACH = 5.0
#: Part of its largest below which a power spectral density is rounding alone.
_NOTHING = 1e-14


def _checked(height: xr.DataArray | xr.Dataset) -> xr.DataArray:
    history = getattr(height, "attrs", {}).get("history")
    height = checked(height, "surface", least=1).rename("height")
    height = height.assign_attrs({"history": history} if history else {})  # of a result, whose heights may state none
    if not np.isfinite(height).any():
        raise InputError("the surface is all missing: nothing to draw")
    return height


def robust_limits(values: np.ndarray) -> tuple[float, float]:
    """Limits that hold the heights but for spikes: five deviations about the median, as the quartiles give them.

    Parameters
    ----------
    values : ndarray
        Heights, NaN where missing. [m]

    Returns
    -------
    tuple of float
        The lowest and the highest height where no point is beyond. [m]
    """
    lower, median, upper = np.nanpercentile(values, (25, 50, 75))
    reach = _REACH * (upper - lower) / 1.349  # the quartiles of the normal distribution are 1.349 deviations apart
    lowest, highest = float(np.nanmin(values)), float(np.nanmax(values))
    if not reach > 0:
        return lowest, highest
    return max(lowest, float(median - reach)), min(highest, float(median + reach))


def _beyond(values: np.ndarray, low: float, high: float) -> float:
    """Share of the points below and above limits."""
    return np.count_nonzero((values < low) | (values > high)) / values.size


@style.apply
def surface(height: xr.DataArray) -> Figure:
    """Quick look at a surface: map, profile through its middle, distribution of heights, power spectrum.

    Of a surface that was given its mirror images only the measured part is drawn.

    Parameters
    ----------
    height : xarray.DataArray, dims (x, y), or a Dataset that holds one as ``height``
        Heights, peaks up; missing points are drawn in grey and counted. The colours reach over five robust deviations
        at most: a spike does not flatten the rest. [m]

    Returns
    -------
    matplotlib.figure.Figure

    Notes
    -----
    Map and profile show the heights as they are; distribution and spectrum those less their mean plane. The
    distribution is shown with the normal one of the same Sq. The spectrum is that of :func:`roughvisc.psd` under a
    Hann window; missing points are filled for it.
    """
    whole = _checked(height)
    height = measured_part(whole)
    low, high = robust_limits(height.values)
    mean, ends = float(height.mean()), (float(height.min()), float(height.max()))
    unit, plane = unit_for([high - mean, low - mean], "m"), plane_unit(height)
    figure, panels = _panels(plane_ratio(height))
    on_map = panels["map"]
    image = draw_map(on_map, drawn(height), unit, plane, vmin=float(unit(low)), vmax=float(unit(high)))
    beyond = _beyond(height.values, low, high)
    scale = Scale("height", low, high, *ends, marked=False)
    levelled = ", levelled" if "levelled: polynomial" in str(height.attrs.get("history", "")) else ""
    colour_bar(figure, [image], scale, unit, VARIABLES["height"].label + levelled, bar_side(height))
    label_plane(on_map, height, plane)
    missing = float(height.isnull().mean())
    notes = ["measured area only; mirror images are not shown"] if height.size < whole.size else []
    notes += [f"{100 * missing:.2g} % of the points are missing (grey)"] if missing else []
    notes += [f"{100 * beyond:.2g} % lie beyond the scale of heights"] if beyond else []
    if (every := stride(height)) > 1:
        ends = " to ".join(unit.text(one) for one in ends)
        notes += [f"the map is of means of {every} × {every} points; heights are {ends}"]
    said = "; ".join(notes)
    style.note_below(figure, f"{said[:1].upper()}{said[1:]}." if said else "")
    _draw_profile(panels["profile"], on_map, height, unit, plane)
    height = off_plane(height)
    _draw_heights(panels["heights"], height, unit)
    _draw_spectrum(panels["spectrum"], height)
    style.letter_panels(list(panels.values()))
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
    figure = style.new_figure(*size)
    panels = figure.subplot_mosaic(rows, height_ratios=heights)
    return figure, panels


def _draw_profile(ax: Axes, on_map: Axes, height: xr.DataArray, unit: Unit, plane: Unit) -> None:
    middle = height.sizes["y"] // 2
    ax.plot(plane(height["x"]), unit(height.isel(y=middle)), color=style.BLUE, lw=0.9)
    if not height.isel(y=middle).notnull().any():
        style.say_inside(ax, "all missing")
    place = float(height["y"][middle])
    on_map.axhline(plane(place), color="w", lw=0.8, ls=(0, (4, 2)))
    limits = plane(cell_edges(height["x"]))
    ax.set_xlim(limits[0], limits[-1])
    ax.set_title(f"y = {plane.text(place)}", loc="right")
    ax.set_xlabel(plane.label("x"))
    ax.set_ylabel(unit.label(VARIABLES["height"].label))
    ax.grid(color="0.9", lw=0.5)


def _draw_heights(ax: Axes, levelled: xr.DataArray, unit: Unit) -> None:
    known = levelled.values[np.isfinite(levelled.values)]
    low, high = (float(unit(limit)) for limit in robust_limits(levelled.values))
    mean, deviation = float(unit(known.mean())), float(unit(known.std()))
    bins = int(np.clip(math.sqrt(known.size) / 1.5, 8, 100))
    if deviation == 0:
        style.say_inside(ax, "flat: one height")
        ax.set_xlabel(unit.label("Height, levelled"))
        ax.set_yticks([])
        return
    edges = np.linspace(low, high, bins + 1)
    found = np.histogram(unit(known), bins, (low, high))[0]
    ax.hist(
        edges[:-1],
        bins=edges,
        weights=found * bins / ((high - low) * known.size),
        color=style.BLUE,
        alpha=0.45,
        histtype="stepfilled",
        label="measured",
    )
    shown = np.linspace(low, high, 200)
    bell = np.exp(-(((shown - mean) / deviation) ** 2) / 2) / (deviation * math.sqrt(2 * math.pi))
    ax.plot(shown, bell, color=style.VERMILION, lw=1, label=f"normal, Sq = {unit.text(deviation * unit.factor)}")
    ax.set_ylim(bottom=0)
    ax.set_xlim(low - 0.04 * (high - low), high + 0.04 * (high - low))
    style.legend_over(ax, 2.4)
    ax.set_xlabel(unit.label("Height, levelled"))
    ax.set_ylabel(f"Density [1/{unit.symbol}]")


def _draw_spectrum(ax: Axes, levelled: xr.DataArray) -> None:
    wavevector, density = np.zeros(0), np.zeros(0)
    gaps = bool(levelled.isnull().any())
    if min(levelled.shape) >= 8:
        spectrum = psd(fill(levelled.drop_attrs()) if gaps else levelled, window="hann")
        spectrum = spectrum.sel(wavevector=slice(np.pi / max(spacing(levelled))))  # rings that are seen whole
        wavevector, density = spectrum["wavevector"].values, spectrum["psd"].values
    symbol, scale = "m", 1.0
    if (density > 0).any():
        highest = wavevector[-1]
        symbol, scale = ("nm", 1e-9) if highest > 1e8 else ("µm", 1e-6) if highest > 1e4 else ("mm", 1e-3)
        x, y = wavevector[density > 0] * scale, density[density > 0] / scale**4
        ax.plot(x, y, color=style.BLUE, lw=1)
        style.spread_axis(ax.xaxis, x, always=True)
        style.spread_axis(ax.yaxis, y, always=True)
        ax.set_ylim(bottom=max(ax.get_ylim()[0], _NOTHING * float(y.max())))
        ax.set_title("gaps filled" if gaps else "", loc="right")
        ax.grid(color="0.9", lw=0.5)
    else:
        style.say_inside(ax, "too small or too flat")
        ax.set_xticks([])
        ax.set_yticks([])
    ax.set_xlabel(f"Wavevector [rad/{symbol}]")
    ax.set_ylabel(f"Power spectral density\n[{symbol}⁴]")
