"""Figure of a height grid: map, profile, distribution of heights, power spectrum."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from roughvisc.errors import InputError
from roughvisc.plot import style
from roughvisc.plot.maps import draw_map, drawn, plane_unit
from roughvisc.topography.bandwidth import off_plane
from roughvisc.topography.grid import cell_edges, checked, spacing
from roughvisc.topography.missing_points import fill
from roughvisc.topography.spectrum import psd
from roughvisc.units import unit_for
from roughvisc.variables import VARIABLES


def robust_limits(values: np.ndarray) -> tuple[float, float]:
    """Return the limits of the heights without spikes: at most five robust standard deviations from the median. [m]"""
    lower, median, upper = np.nanpercentile(values, (25, 50, 75))
    reach = 5 * (upper - lower) / 1.349  # quartiles of the normal distribution are 1.349 deviations apart
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    return (max(low, float(median - reach)), min(high, float(median + reach))) if reach > 0 else (low, high)


@style.apply
def surface(height: xr.DataArray | xr.Dataset) -> Figure:
    """Draw a surface: map, profile through its middle, distribution of heights, power spectrum.

    Parameters
    ----------
    height : xarray.DataArray, dims (x, y), or a Dataset with the variable ``height``
        Heights, peaks up; missing points are grey. The colour scale covers at most five robust standard deviations, so
        that a spike does not flatten the rest; an arrow at the colour bar marks heights beyond it. [m]

    Returns
    -------
    matplotlib.figure.Figure

    Notes
    -----
    Map and profile show the given heights. Distribution and spectrum show the heights minus their mean plane. The
    distribution is drawn with the normal distribution of the same Sq. :func:`roughvisc.psd` computes the spectrum with
    a Hann window, after missing points are filled.
    """
    height = checked(height, "surface", least=1).rename("height")
    if not np.isfinite(height).any():
        raise InputError("the surface is all missing: nothing to draw")
    low, high = robust_limits(height.values)
    unit, plane = unit_for(max(high - low, abs(low), abs(high)), "m"), plane_unit(height)
    ratio = float(np.ptp(cell_edges(height["y"])) / np.ptp(cell_edges(height["x"])))
    figure, axes = style.new_panels(4, 2, 2.4, 2.4 * float(np.clip(ratio, 0.5, 1.6)), between=1.65)
    on_map, profile, heights, spectrum = axes
    limits = (float(unit(low)), float(unit(high)) if high > low else float(unit(low)) + 1.0)
    image = draw_map(on_map, drawn(height), unit, "cividis", vmin=limits[0], vmax=limits[1])
    beyond = bool((height < low).any()), bool((height > high).any())
    extend = {(True, True): "both", (True, False): "min", (False, True): "max"}.get(beyond, "neither")
    style.colour_bar(image, [on_map], unit.label("Height"), extend=extend)
    line = height.isel(y=height.sizes["y"] // 2)
    profile.plot(plane(line["x"]), unit(line), color=style.BLUE, lw=0.9)
    on_map.axhline(plane(line["y"]), color="w", lw=0.8, ls=(0, (4, 2)))
    profile.set_title(f"y = {plane.text(float(line['y']))}", loc="right")
    profile.set_xlabel(plane.label("x"))
    profile.set_ylabel(unit.label(VARIABLES["height"].label))
    profile.grid()
    levelled = off_plane(height)
    _draw_heights(heights, levelled.values[np.isfinite(levelled.values)])
    _draw_spectrum(spectrum, levelled)
    style.letter_panels(axes)
    return figure


def _draw_heights(ax: Axes, known: np.ndarray) -> None:
    """Draw the histogram of the levelled heights, with the normal distribution of the same deviation."""
    low, high = robust_limits(known)
    unit, deviation = unit_for(max(abs(low), abs(high)), "m"), float(known.std())
    if deviation > 0:
        low, high, deviation = float(unit(low)), float(unit(high)), float(unit(deviation))
        bins = int(np.clip(np.sqrt(known.size) / 1.5, 8, 100))
        weights = np.full(known.size, bins / (known.size * (high - low)))
        look = {"color": style.BLUE, "alpha": 0.45, "histtype": "stepfilled", "label": "measured"}
        ax.hist(unit(known), bins, range=(low, high), weights=weights, **look)
        z = np.linspace(low, high, 200)
        normal = np.exp(-(((z - float(unit(known.mean()))) / deviation) ** 2) / 2) / (deviation * np.sqrt(2 * np.pi))
        ax.plot(z, normal, color=style.VERMILION, lw=1, label=f"normal, Sq = {deviation:.3g} {unit.symbol}")
        ax.set_ylim(0, 1.35 * ax.get_ylim()[1])
        ax.legend(loc="upper left", handlelength=1.4)
    ax.set_xlabel(unit.label("Height, levelled"))
    ax.set_ylabel(f"Density [1/{unit.symbol}]")


def _draw_spectrum(ax: Axes, levelled: xr.DataArray) -> None:
    """Draw the radial power spectral density of the levelled heights, up to the lower limit of both axes."""
    symbol, scale = "µm", 1e-6
    if min(levelled.shape) >= 8 and float(levelled.std()) > 0:
        gaps = bool(levelled.isnull().any())
        found = psd(fill(levelled.drop_attrs()) if gaps else levelled, window="hann")
        found = found.sel(wavevector=slice(np.pi / max(spacing(levelled))))  # rings inside the square of wavevectors
        q, density = found["wavevector"].values, found["psd"].values
        symbol, scale = ("nm", 1e-9) if q[-1] > 1e8 else ("µm", 1e-6) if q[-1] > 1e4 else ("mm", 1e-3)
        telling = density > 1e-14 * density.max()  # the rest is rounding
        ax.plot(q[telling] * scale, density[telling] / scale**4, color=style.BLUE, lw=1)
        style.log_axis(ax.xaxis, q[telling] * scale)
        style.log_axis(ax.yaxis, density[telling] / scale**4)
        ax.set_title("missing points filled" if gaps else "", loc="right")
        ax.grid()
    ax.set_xlabel(f"Wavevector [rad/{symbol}]")
    ax.set_ylabel(f"Power spectral density\n[{symbol}⁴]")
