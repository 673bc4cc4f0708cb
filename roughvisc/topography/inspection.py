"""Inspection of scans: findings, each with the conditioning step that it calls for."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import scipy  # imports its submodules on first use: scipy.ndimage takes 0.1 s
import xarray as xr

from roughvisc.topography.borders import border_mismatch
from roughvisc.topography.conditioning import crop, fill, gaussian_filter, level, mask_outliers
from roughvisc.topography.grid import cell_edges, checked, filled_points, nominal_area, require_heights, spacing
from roughvisc.topography.missing_points import in_large_holes
from roughvisc.topography.parameters import parameters
from roughvisc.topography.spectrum import psd
from roughvisc.units import unit_for

#: Share of the surface in large holes from which a crop without large holes is recommended.
_HOLES = 0.01
#: Beyond this share of the points, spikes may be the surface itself.
_MOST_SPIKES = 0.02
#: Share of a quadratic form in the mean square height from which its removal is recommended.
_FORM = 0.5
#: Root mean square slope above which a unit or the spacing is probably wrong, and range of the kurtosis of samples of
#: Gaussian heights. [-]
_STEEP, _GAUSSIAN = 1.0, (2.4, 4.0)
#: A white tail of the spectrum falls no steeper than this power of the wavevector over the last octave. If the spectrum
#: is below this multiple of the tail, noise is at least as strong as the surface.
_WHITE, _ABOVE = -1.5, 2.0
#: A noise floor below this part of the rms height is rounding. Noise below this share of the mean square slope is not
#: filtered.
_ROUNDING, _HARMLESS = 1e-6, 0.02
#: Largest share of missing points for which a spectrum is computed.
_MOST_MISSING = 0.5
#: Twice the missing points raise a true noise floor by a factor of at most 1.2, an artefact of interpolation by a
#: factor of at least 2.
_OF_GAPS = 1.5
#: Waves shorter than this number of cells are not resolved in contact.
_RESOLVED = 8


@dataclass(frozen=True)
class Finding:
    """One property of a scan.

    Attributes
    ----------
    name : str
        Name of the property.
    seen : str
        The result in words.
    advice : str
        What to do; empty if nothing has to be done.
    values : dict
        The numbers, in SI.
    """

    name: str
    seen: str
    advice: str = ""
    values: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Inspection:
    """Findings in a scan, and the conditioning steps that follow from them.

    Attributes
    ----------
    findings : dict of str to Finding
        By their names.
    steps : dict
        Conditioning steps in the notation of surface cards and studies.
    boundary : {"periodic", "mirror"}
        Boundary without a step between a surface and its repetition.
    shape, area, rms_slope : tuple of int, float, float
        Of the surface after the steps. [-, m2, -]
    """

    findings: dict[str, Finding]
    steps: dict[str, Any]
    boundary: Literal["periodic", "mirror"]
    shape: tuple[int, int]
    area: float
    rms_slope: float


def inspect(h: xr.DataArray) -> Inspection:
    """Inspect a scan and recommend conditioning steps, as ``roughvisc scan`` prints them.

    Parameters
    ----------
    h : xarray.DataArray, dims (x, y)
        Heights as read, NaN where missing. [m]

    Returns
    -------
    Inspection
        Findings, each with its numbers and the advice that follows, and the steps together.

    Raises
    ------
    InputError
        If all points are missing, or the points present do not determine a plane.

    Examples
    --------
    >>> import roughvisc as rv
    >>> found = rv.inspect(rv.open_scan(rv.example_scan()))
    >>> found.steps
    {'level': 1, 'filter': 2.2e-06}
    >>> found.findings["Missing points"].seen
    'none'
    """
    h = checked(h, "inspect")
    found: list[Finding] = []
    steps: dict[str, Any] = {}

    limits, share = _without_holes(h)
    if limits:
        steps["crop"] = limits
        h = crop(h, **limits)
    if share:
        advice = (
            f"crop to the largest part without holes, {h.shape[0]} x {h.shape[1]} points (the findings below refer to "
            'it); or keep the whole scan with missing = "absent" if the holes contain no material'
        )
        advice = advice if limits else "too small to crop; fill them with the other missing points"
        seen = f"{_percent(share)} of the scan lies in holes wider than a few points"
        found.append(Finding("Holes", seen, advice, {"share": share}))

    missing = int(h.isnull().sum())
    seen = f"{missing} ({_percent(missing / h.size)})" if missing else "none"
    advice = 'fill = "harmonic"; the result marks the filled points' if missing else ""
    found.append(Finding("Missing points", seen, advice, {"points": missing}))

    levelled = level(h)
    masked = mask_outliers(levelled)
    spikes = int(masked.isnull().sum()) - missing
    doubtful = spikes > _MOST_SPIKES * h.size
    kept = levelled if doubtful else masked
    rms_raw, rms_levelled = _rms(h), _rms(levelled)
    straight, flat = _rms(level(kept)), _rms(level(kept, 2)) if min(h.shape) > 2 else math.nan
    seen, advice = "none", ""
    if spikes:
        seen = f"{spikes} point{'s' * (spikes > 1)} ({_percent(spikes / h.size)})"
    if spikes and doubtful:
        seen += " differ strongly from their neighbours"
        advice = (
            "too many to be spikes: check the picture; set outliers = true only if the surface has no such features"
        )
    elif spikes:
        seen += f": Sq is {_length(rms_levelled)} with and {_length(straight)} without them"
        advice = "outliers = true; otherwise the spikes carry the load"
    values: dict[str, Any] = {"points": spikes, "rms_with": rms_levelled, "rms_without": straight}
    found.append(Finding("Spikes", seen, advice, values))

    form = 1 - (flat / straight) ** 2 if straight > 0 else 0.0
    curved = form > _FORM
    tears = border_mismatch(kept).jumps and not border_mismatch(h).jumps  # a plane would break the periodicity
    steps["level"] = 2 if curved else 0 if tears else 1
    steps |= {"outliers": True} if spikes and not doubtful else {}
    steps |= {"fill": "harmonic"} if missing or "outliers" in steps else {}
    tilt = _tilt(h, levelled)
    angles = " and ".join(f"{_angle(slope)} along {axis}" for slope, axis in zip(tilt, "xy", strict=True))
    seen = f"{angles}: Sq is {_length(rms_raw)} before and {_length(rms_levelled)} after levelling"
    advice = "level = 0 subtracts the mean only; subtracting a plane would break the periodicity"
    if steps["level"]:
        advice = f"level = {steps['level']} subtracts the plane{' too' if curved else ''}"
    found.append(Finding("Tilt", seen, advice, {"slopes": tilt}))

    seen, advice = f"a quadratic form accounts for {_percent(form)} of Sq squared", ""
    if curved:
        seen += f"; Sq is {_length(flat)} without it"
        advice = 'level = 2 for the roughness alone; level = 1 and boundary = "free" for contact with the form'
    found.append(Finding("Form", seen, advice, {"share": form, "rms_without": flat}))

    if steps["level"] == 1 and not doubtful:  # these steps are already done
        treated = kept
    else:
        treated = level(h, steps["level"])
        treated = mask_outliers(treated) if "outliers" in steps else treated
    treated = fill(treated) if "fill" in steps else treated
    borders = border_mismatch(treated)
    (x, y), (nx, ny) = borders.of_rms, borders.of_neighbours
    seen = (
        f"opposite borders differ by {x:.2g} Sq along x and {y:.2g} Sq along y: {nx:.2g} and {ny:.2g} times the "
        "difference of neighbouring rows"
    )
    advice = 'boundary = "mirror"; with "periodic" the step at the seam carries load'
    advice = advice if borders.jumps else 'boundary = "periodic"'
    found.append(Finding("Borders", seen, advice, {"of_neighbours": borders.of_neighbours}))

    noise, cell = _noise(treated), max(spacing(treated))
    if noise is not None and noise["noisy_slopes"] > _HARMLESS and noise["wavelength"] >= 3 * cell:
        steps["filter"] = max(float(f"{noise['wavelength']:.2g}"), 3.001 * cell)
        treated = gaussian_filter(treated, steps["filter"])
    measures = parameters(treated)
    slope, kurtosis = float(measures["Sdq"]), float(measures["Sku"])
    found += [*_of_the_heights(slope, kurtosis), *_of_the_noise(noise, steps, cell)]
    return Inspection(
        {one.name: one for one in found},
        steps,
        "mirror" if borders.jumps else "periodic",
        (treated.shape[0], treated.shape[1]),
        nominal_area(treated),
        slope,
    )


def _of_the_heights(slope: float, kurtosis: float) -> Iterator[Finding]:
    seen, advice = f"the rms slope is {slope:.2g} after these steps", ""
    if slope > _STEEP:
        seen += ", which is steeper than 45°, unlike almost any measured surface"
        advice = (
            "check the spacing and the units of x, y and height (unit, spacing, height_scale): one of them is probably "
            "wrong; if all are right, the half-space model does not hold, since it assumes small slopes"
        )
    yield Finding("Slope", seen, advice, {"rms_slope": slope})
    low, high = _GAUSSIAN
    seen, advice = f"their kurtosis is {kurtosis:.2g} (3: Gaussian)", ""
    if kurtosis < low or kurtosis > high:
        why = "plateaus, or few long waves" if kurtosis < low else "outlying summits or pits"
        seen += f": {why}; the spectrum alone may not determine its contact"
        advice = "realisations = 24 in [sweep] compares the scan with random surfaces of the same spectrum"
    yield Finding("Heights", seen, advice, {"kurtosis": kurtosis})


def _of_the_noise(noise: dict[str, Any] | None, steps: dict[str, Any], cell: float) -> Iterator[Finding]:
    if noise is None:
        yield Finding("Noise", "not known: the scan is flat, smaller than 16 points, or mostly missing")
        return
    wavelength, advice = noise["wavelength"], ""
    seen = f"no noise floor down to two cells; noise is below {_length(noise['rms'])} rms"
    if noise["floor"]:
        seen = (
            f"noise floor of {_length(noise['rms'])} rms; wavelengths below {_length(wavelength)} are noise and make "
            f"{_percent(noise['noisy_slopes'])} of the mean square slope"
        )
        advice = "filter out these wavelengths" if "filter" in steps else ""
    yield Finding("Noise", seen, advice, noise)
    seen = (
        f"the shortest resolved wavelength is {_length(wavelength)}; wavelengths below {_RESOLVED} cells make "
        f"{_percent(noise['fine_slopes'])} of the mean square slope"
    )
    advice = ""
    if noise["fine_slopes"] > 0.5 and wavelength < _RESOLVED * cell:
        width = "less than 4 cells" if "filter" in steps else "about one cell"
        advice = f"contact spots will be {width} wide: set grid_error = true, or filter to longer wavelengths"
    yield Finding("Resolution", seen, advice, {"wavelength": wavelength, "fine_slopes": noise["fine_slopes"]})


def _rms(h: xr.DataArray) -> float:
    require_heights(h, "inspect")
    return float(np.nanstd(h.values))


def _tilt(before: xr.DataArray, after: xr.DataArray) -> tuple[float, float]:
    """Return the slopes of the plane that was subtracted, from some of its points. [-]"""
    plane = before.values - after.values
    i, j = np.nonzero(np.isfinite(plane))
    some = slice(None, None, max(1, i.size // 10_000))
    i, j = i[some], j[some]
    values = plane[i, j] - plane[i, j].mean()
    slopes = np.linalg.lstsq(np.stack([np.ones(i.size), i, j], axis=1), values, rcond=None)[0][1:]
    return float(slopes[0] / spacing(before)[0]), float(slopes[1] / spacing(before)[1])


def _without_holes(h: xr.DataArray) -> tuple[dict[str, tuple[float, float]], float]:
    """Return the limits of the largest rectangle without large holes [m], empty if none, and the share in holes."""
    if not h.isnull().any():
        return {}, 0.0
    void = in_large_holes(np.isnan(h.values))
    share = float(void.mean())
    if share < _HOLES:
        return {}, share
    block = [max(1, n // 128) for n in h.shape]
    coarse = np.logical_or.reduceat(void, np.arange(0, h.shape[0], block[0]), axis=0)
    coarse = np.logical_or.reduceat(coarse, np.arange(0, h.shape[1], block[1]), axis=1)
    limits = {}
    for axis, (first, last), step in zip(("x", "y"), _largest_rectangle(~coarse), block, strict=True):
        first, last = first * step, min(last * step, h.sizes[axis])
        if last - first < 16:
            return {}, share
        edges = cell_edges(h[axis])
        limits[axis] = (float(f"{edges[first]:.6g}"), float(f"{edges[last]:.6g}"))
    return limits, share


def _largest_rectangle(present: np.ndarray) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the rows and the columns (end excluded) of the largest rectangle without missing cells."""
    best, found = 0, ((0, 0), (0, 0))
    run = np.zeros(present.shape[1], dtype=int)  # cells present above, up to this row
    for row, line in enumerate(present):
        run = np.where(line, run + 1, 0)
        for height in np.unique(run[run > 0]):
            labels, count = scipy.ndimage.label(run >= height)
            for (piece,) in scipy.ndimage.find_objects(labels, count):
                size = int(height) * (piece.stop - piece.start)
                if size > best:
                    best, found = size, ((row + 1 - int(height), row + 1), (piece.start, piece.stop))
    return found


def _noise(h: xr.DataArray) -> dict[str, Any] | None:
    """Measure the short-wave end of the spectrum; None if too few points were measured or the surface is flat.

    Filled points raise this end of the spectrum. Noise of 2 % of the rms height is overestimated by up to a third if
    10 % of the points are missing, and weaker noise by more.

    Returns
    -------
    dict
        ``rms``: rms height of white noise as strong as the spectrum at its short-wave end [m]; ``floor``: whether the
        spectrum is flat there, so that `rms` is the noise and not an upper bound; ``wavelength``: the shortest wave
        above the noise, two cells without a floor [m]; ``fine_slopes``, ``noisy_slopes``: shares of the mean square
        slope of waves below eight cells, and of waves below `wavelength` [-].
    """
    missing, filled = np.isnan(h.values), filled_points(h)
    gaps = missing if filled is None else missing | filled
    if gaps.any():  # points inside or at the edge of large holes are usually artefacts
        gaps = gaps | scipy.ndimage.binary_dilation(in_large_holes(gaps))
    rms = float(np.nanstd(h.values))
    mostly_missing = np.count_nonzero(gaps) > _MOST_MISSING * h.size
    if min(h.shape) < 16 or mostly_missing or not rms > 1e-12 * max(1e-300, np.nanmax(np.abs(h.values))):
        return None
    sides = spacing(h)
    q, density, modes = _short_waves(h, gaps)
    octave = q > q[-1] / 2
    tail = float(np.median(density[octave]))
    power = float(np.polyfit(np.log(q[octave]), np.log(np.maximum(density[octave], 1e-300)), 1)[0])
    smooth = scipy.ndimage.median_filter(density, 5, mode="nearest")
    below = np.flatnonzero(smooth < _ABOVE * tail)
    strength = float(np.sqrt(tail / (sides[0] * sides[1])))
    floor = bool(power > _WHITE and below.size and below[0] > 0 and strength > _ROUNDING * rms)
    more = gaps | np.roll(gaps, [n // 2 for n in gaps.shape], (0, 1))
    if floor and gaps.any() and np.count_nonzero(more) <= _MOST_MISSING * h.size:
        q_more, density_more, _ = _short_waves(h, more)
        floor = not float(np.median(density_more[q_more > q_more[-1] / 2])) > _OF_GAPS * tail
    shortest = float(2 * np.pi / q[below[0] - 1]) if floor else 2 * max(sides)
    if not floor:
        strength = float(np.sqrt(np.median(density[q > 0.8 * q[-1]]) / (sides[0] * sides[1])))
    slopes = density * modes * q**2
    fine, noisy = (
        float(slopes[q > 2 * np.pi / length].sum() / slopes.sum()) for length in (_RESOLVED * max(sides), shortest)
    )
    noise: dict[str, Any] = {"rms": strength, "floor": floor, "wavelength": shortest}
    return noise | {"fine_slopes": fine, "noisy_slopes": noisy if floor else 0.0}


def _short_waves(h: xr.DataArray, gaps: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return wavevector [rad/m], density [m4] and number of modes of the complete rings; a membrane fills the gaps."""
    spectrum = psd(fill(h.where(~gaps)) if gaps.any() else h, "hann")
    seen = spectrum["wavevector"].values <= np.pi / max(spacing(h))
    q, density, modes = (spectrum[name].values[seen] for name in ("wavevector", "psd", "modes"))
    return q, density, modes


def _length(value: float) -> str:
    return unit_for(value, "m").text(value) if np.isfinite(value) else "not known"


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %" if share < 0.995 else f"{100 * share:.0f} %"


def _angle(slope: float) -> str:
    degrees = math.degrees(math.atan(abs(slope)))
    return f"{degrees:.2g}°" if degrees >= 1e-3 else "less than 0.001°"
