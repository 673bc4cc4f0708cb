"""Inspection of scans: findings, each with the conditioning step that it calls for."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import scipy  # imports its submodules on first use: scipy.ndimage takes 0.1 s
import xarray as xr

from roughvisc.topography.borders import JUMP, border_mismatch
from roughvisc.topography.conditioning import STEPS
from roughvisc.topography.filters import fill, gaussian_filter, in_large_holes, level, mask_outliers
from roughvisc.topography.framing import crop
from roughvisc.topography.grid import cell_edges, checked, nominal_area, spacing
from roughvisc.topography.parameters import rms_slope
from roughvisc.topography.spectrum import psd
from roughvisc.units import unit_for

#: Share of the surface in large holes from which a crop without large holes is recommended.
_HOLES = 0.01
#: Beyond this share of the points, spikes may be the surface itself.
_MOST_SPIKES = 0.02
#: Share of a quadratic form in the mean square height from which its removal is recommended.
_FORM = 0.5
#: Root mean square slope above which a unit or the spacing is probably wrong. [-]
_STEEP = 1.0
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
    step : dict
        Conditioning steps that follow, in the notation of surface cards and studies.
    values : dict
        The numbers, in SI.
    """

    name: str
    seen: str
    advice: str
    step: dict[str, Any]
    values: dict[str, Any]


@dataclass(frozen=True)
class Inspection:
    """Findings in a scan, and the conditioning steps that follow from them.

    Attributes
    ----------
    findings : dict of str to Finding
        By their names.
    steps : dict
        Conditioning steps of all findings, in order.
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
    '0 (0 %)'
    """
    h = checked(h, "inspect")
    findings: dict[str, Finding] = {}

    def find(name: str, seen: str, advice: str = "", step: dict[str, Any] | None = None, **values: Any) -> None:
        findings[name] = Finding(name, seen, advice, step or {}, values)

    void = in_large_holes(np.isnan(h.values))
    if share := float(void.mean()):
        limits = _largest_part(h, void) if share >= _HOLES else {}
        h = crop(h, **limits) if limits else h
        advice = "too small to crop; fill them with the other missing points"
        if limits:
            part = f"{h.shape[0]} x {h.shape[1]} points, to which the findings below refer"
            advice = f'crop to the largest part without holes, {part}; missing = "absent" if they contain no material'
        seen = f"{_percent(share)} of the scan lies in holes wider than a few points"
        find("Holes", seen, advice, {"crop": limits} if limits else {}, share=share)

    missing = int(h.isnull().sum())
    seen, advice, step = f"{missing} ({_percent(missing / h.size)})", "", {}
    if missing:
        advice, step = "fill = true; the result marks the filled points", {"fill": True}
    find("Missing points", seen, advice, step, points=missing)

    levelled = level(h)
    kept = mask_outliers(levelled)
    spikes = int(kept.isnull().sum()) - missing
    kept = kept if 0 < spikes <= _MOST_SPIKES * h.size else levelled
    rms_levelled, rms = (float(np.nanstd(one.values)) for one in (levelled, level(kept)))
    seen, advice, step = f"{spikes} ({_percent(spikes / h.size)})", "", {}
    if kept is not levelled:
        seen += f": Sq is {_length(rms_levelled)} with and {_length(rms)} without them"
        advice, step = "outliers = true; otherwise the spikes carry the load", {"outliers": True, "fill": True}
    elif spikes:
        seen += " differ strongly from their neighbours"
        advice = "too many to be spikes: check the picture; outliers = true only if the surface has no such features"
    find("Spikes", seen, advice, step, points=spikes, rms_with=rms_levelled, rms_without=rms)

    rms_flat = float(np.nanstd(level(kept, 2).values)) if min(h.shape) > 2 else rms
    form = 1 - (rms_flat / rms) ** 2 if rms > 0 else 0.0
    repeats = max(border_mismatch(kept)) > JUMP >= max(border_mismatch(h))  # a plane would break the periodicity
    order = 2 if form > _FORM else 0 if repeats else 1
    treated = kept if order == 1 else level(h, order).where(kept.notnull())
    slopes = tuple(float(np.nanmean((h - levelled).diff(axis))) / d for axis, d in zip("xy", spacing(h), strict=True))
    along_x, along_y = (f"{math.degrees(math.atan(abs(one))):.3f}°" for one in slopes)
    seen = f"{along_x} along x, {along_y} along y: Sq is {_length(rms_levelled)} without the plane"
    advice = f"level = {order} subtracts the plane" + " and the form" * (order == 2)
    advice = advice if order else "level = 0 subtracts the mean only; a plane would break the periodicity"
    find("Tilt", seen, advice, {"level": order}, slopes=slopes)
    seen = f"a quadratic form accounts for {_percent(form)} of Sq squared; Sq is {_length(rms_flat)} without it"
    advice = 'level = 2 for the roughness alone; level = 1 and boundary = "free" for contact with the form'
    find("Form", seen, advice if order == 2 else "", share=form, rms_without=rms_flat)

    treated = fill(treated) if treated.isnull().any() else treated
    borders = border_mismatch(treated)
    boundary: Literal["periodic", "mirror"] = "mirror" if max(borders) > JUMP else "periodic"
    seen = f"opposite borders differ {borders[0]:.2f} (x) and {borders[1]:.2f} times (y) as much as neighbouring rows"
    why = '; with "periodic" the step at the seam carries load' if boundary == "mirror" else ""
    find("Borders", seen, f'boundary = "{boundary}"{why}', of_neighbours=borders)

    noise, cell, step = _noise(treated), max(spacing(treated)), {}
    seen, advice = "not known: the scan is flat, smaller than 16 points, or mostly missing", ""
    if noise and noise["floor"]:
        part = f"{_percent(noise['noisy_slopes'])} of the mean square slope"
        seen = f"{_length(noise['rms'])} rms: wavelengths below {_length(noise['wavelength'])} are noise, {part}"
    elif noise:
        seen = f"no noise floor down to two cells; noise is below {_length(noise['rms'])} rms"
    if noise and noise["noisy_slopes"] > _HARMLESS and noise["wavelength"] >= 3 * cell:
        step = {"filter": max(float(f"{noise['wavelength']:.2g}"), 3.001 * cell)}
        advice, treated = "filter out these wavelengths", gaussian_filter(treated, step["filter"])
    find("Noise", seen, advice, step, **noise)

    slope = rms_slope(treated)
    advice = "steeper than almost any measured surface: check unit, spacing and height_scale"
    find("Slope", f"{slope:.2g} rms after these steps", advice if slope > _STEEP else "", rms_slope=slope)

    proposed = {name: value for one in findings.values() for name, value in one.step.items()}
    steps = {name: proposed[name] for name in STEPS if name in proposed}
    return Inspection(findings, steps, boundary, treated.shape, nominal_area(treated), slope)


def _largest_part(h: xr.DataArray, void: np.ndarray) -> dict[str, tuple[float, float]]:
    """Return the limits of the largest rectangle outside a mask [m]; empty if it is narrower than 16 points."""
    block = [max(1, n // 128) for n in h.shape]
    for axis in (0, 1):
        void = np.logical_or.reduceat(void, np.arange(0, void.shape[axis], block[axis]), axis=axis)
    best, found = 0, (slice(0), slice(0))
    for last in range(1, len(void) + 1):
        for first in reversed(range(last)):
            labels, _ = scipy.ndimage.label(~void[first:last].any(axis=0))
            for (piece,) in scipy.ndimage.find_objects(labels):
                if (size := (last - first) * (piece.stop - piece.start)) > best:
                    best, found = size, (slice(first, last), piece)
    limits = {}
    for axis, part, step in zip(("x", "y"), found, block, strict=True):
        edges = cell_edges(h[axis])[(part.start or 0) * step : part.stop * step + 1]
        if edges.size < 17:
            return {}
        limits[axis] = (float(f"{edges[0]:.6g}"), float(f"{edges[-1]:.6g}"))
    return limits


def _noise(h: xr.DataArray) -> dict[str, Any]:
    """Measure the short-wave end of the spectrum; nothing if too few points were measured or the surface is flat.

    Filled points raise this end of the spectrum. Noise of 2 % of the rms height is overestimated by up to a third if
    10 % of the points are missing, and weaker noise by more.

    Returns
    -------
    dict
        ``rms``: rms height of white noise as strong as the spectrum at its short-wave end [m]; ``floor``: whether the
        spectrum is flat there, so that `rms` is the noise and not an upper bound; ``wavelength``: the shortest wave
        above the noise, two cells without a floor [m]; ``noisy_slopes``: share of the waves below `wavelength` in the
        mean square slope [-].
    """
    gaps = h["filled"].values if "filled" in h.coords else np.zeros(h.shape, dtype=bool)
    # points inside or at the edge of large holes are usually artefacts
    gaps = gaps | scipy.ndimage.binary_dilation(in_large_holes(gaps))
    rms = float(h.values.std())
    if min(h.shape) < 16 or gaps.mean() > _MOST_MISSING or not rms > 1e-12 * np.abs(h.values).max():
        return {}
    q, density, modes = _short_waves(h, gaps)
    octave, area = q > q[-1] / 2, math.prod(spacing(h))
    tail = float(np.median(density[octave]))
    power = float(np.polyfit(np.log(q[octave]), np.log(np.maximum(density[octave], 1e-300)), 1)[0])
    below = np.flatnonzero(scipy.ndimage.median_filter(density, 5, mode="nearest") < _ABOVE * tail)
    floor = bool(power > _WHITE and below.size and below[0] > 0 and math.sqrt(tail / area) > _ROUNDING * rms)
    more = gaps | np.roll(gaps, [n // 2 for n in gaps.shape], (0, 1))
    if floor and gaps.any() and more.mean() <= _MOST_MISSING:
        q_more, density_more, _ = _short_waves(h, more)
        floor = not float(np.median(density_more[q_more > q_more[-1] / 2])) > _OF_GAPS * tail
    strength = tail if floor else float(np.median(density[q > 0.8 * q[-1]]))
    shortest = float(2 * np.pi / q[below[0] - 1]) if floor else 2 * max(spacing(h))
    slopes = density * modes * q**2
    noisy = float(slopes[q > 2 * np.pi / shortest].sum() / slopes.sum()) if floor else 0.0
    return {"rms": math.sqrt(strength / area), "floor": floor, "wavelength": shortest, "noisy_slopes": noisy}


def _short_waves(h: xr.DataArray, gaps: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return wavevector [rad/m], density [m4] and number of modes of the complete rings; a membrane fills the gaps."""
    spectrum = psd(fill(h.where(~gaps)), "hann")
    seen = spectrum["wavevector"].values <= np.pi / max(spacing(h))
    q, density, modes = (spectrum[name].values[seen] for name in ("wavevector", "psd", "modes"))
    return q, density, modes


def _length(value: float) -> str:
    return unit_for(value, "m").text(value) if np.isfinite(value) else "not known"


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %" if share < 0.995 else f"{100 * share:.0f} %"
