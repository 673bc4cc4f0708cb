"""Inspection of scans: findings, each with the conditioning step that it calls for."""

from __future__ import annotations

import json
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
from roughvisc.topography.grid import checked, nominal_area, rms_slope, spacing
from roughvisc.topography.scans import written_quantity
from roughvisc.topography.spectrum import psd
from roughvisc.units import unit_for

#: Share of the surface in large holes from which they are reported.
_HOLES = 0.01
#: Largest number of blocks along a side that are searched for a part without holes; least share of this part, and its
#: fewest points along a side.
_BLOCKS = 128
_LEAST_PART = 0.1
_FEWEST = 16
#: Beyond this share of the points, spikes may be the surface itself.
_MOST_SPIKES = 0.02
#: Part of the plane in the rms height, and share of a quadratic form in its square, from which they are subtracted.
_TILTED = 0.01
_FORM = 0.5
#: Root mean square slopes above and below which a unit or the spacing is probably wrong. [-]
_STEEP = 1.0
_FLAT = 1e-4
#: A white tail of the spectrum falls no steeper than this power of the wavevector over the last octave. If the spectrum
#: is below this multiple of the tail, noise is at least as strong as the surface.
_WHITE = -1.5
_ABOVE = 2.0
#: A noise floor below this part of the rms height is rounding. Noise below this share of the mean square slope is not
#: filtered.
_ROUNDING = 1e-6
_HARMLESS = 0.02
#: Largest share of missing points for which noise is measured.
_MOST_MISSING = 0.25
#: Twice the missing points raise a true noise floor by a factor of at most 1.2, an artefact of interpolation by a
#: factor of at least 2.
_OF_GAPS = 1.5


@dataclass(frozen=True)
class Property:
    """One property of a scan.

    Attributes
    ----------
    seen : str
        The result in words.
    advice : str
        What to do; empty if nothing has to be done.
    step : dict
        Conditioning steps that follow, in the notation of surface cards and studies.
    values : dict
        The numbers, in SI.
    """

    seen: str
    advice: str
    step: dict[str, Any]
    values: dict[str, Any]


@dataclass(frozen=True)
class Inspection:
    """Findings in a scan, and the conditioning steps that follow from them.

    Attributes
    ----------
    findings : dict of str to Property
        By the names of the properties.
    steps : dict
        Conditioning steps of all findings, in order.
    boundary : {"periodic", "mirror"}
        Boundary without a step between a surface and its repetition.
    area, rms_slope : float
        Of the surface after the steps. [m2, -]
    """

    findings: dict[str, Property]
    steps: dict[str, Any]
    boundary: Literal["periodic", "mirror"]
    area: float
    rms_slope: float


def inspect(h: xr.DataArray) -> xr.Dataset:
    """Inspect a scan and recommend conditioning steps, as ``roughvisc scan`` prints them.

    Parameters
    ----------
    h : xarray.DataArray, dims (x, y)
        Heights as read, NaN where missing. [m]

    Returns
    -------
    xarray.Dataset
        Over ``property``: ``finding``, in words; ``advice``, empty if nothing has to be done; ``step``, the
        conditioning step that follows, as JSON. Scalars: ``area`` [m2] and ``rms_slope`` [-] after the steps.
        Attributes: ``steps``, all steps as JSON, and ``boundary``, without a step between a surface and its repetition.

    Raises
    ------
    InputError
        If all points are missing, or the points present do not determine a plane.

    See Also
    --------
    roughvisc.parameters, roughvisc.level

    Examples
    --------
    >>> import roughvisc as rv
    >>> found = rv.inspect(rv.open_scan(rv.example_scan()))
    >>> found.attrs["steps"]
    '{"level": 1, "filter": 2.2e-06}'
    >>> found.finding.sel(property="Missing points").item()
    '0 (0 %)'
    """
    inspection = inspection_of(h)
    columns = {
        "finding": [finding.seen for finding in inspection.findings.values()],
        "advice": [finding.advice for finding in inspection.findings.values()],
        "step": [json.dumps(finding.step) if finding.step else "" for finding in inspection.findings.values()],
    }
    variables: dict[str, Any] = {name: ("property", values) for name, values in columns.items()}
    variables["area"] = ((), inspection.area, {"units": "m^2", "long_name": "area after the steps"})
    variables["rms_slope"] = ((), inspection.rms_slope, {"units": "1", "long_name": "rms slope after the steps"})
    attributes = {"steps": json.dumps(inspection.steps), "boundary": inspection.boundary}
    return xr.Dataset(variables, {"property": list(inspection.findings)}, attributes)


def inspection_of(h: xr.DataArray) -> Inspection:
    """Return the findings in a scan; see :func:`inspect`."""
    h = checked(h, "inspect")
    findings: dict[str, Property] = {}
    missing = int(h.isnull().sum())
    holes = in_large_holes(np.isnan(h.values))
    seen = f"{missing} ({_percent(missing / h.size)})"
    advices = list[str]()
    step = dict[str, Any]()
    has_holes = bool(holes.mean() > _HOLES)
    if has_holes and (clear_part := _clear_part(h, holes)):
        h = crop(h, x=clear_part.get("x"), y=clear_part.get("y"))
        step["crop"] = clear_part
        limits = [f"{axis} from {_length(low)} to {_length(high)}" for axis, (low, high) in clear_part.items()]
        advices.append(f"crop to the largest part without these holes, {' and '.join(limits)}")
    if gaps := int(h.isnull().sum()):
        step["fill"] = True
        advices.append("fill = true; the result marks the filled points")
    if has_holes:
        seen += f", {_percent(holes.mean())} of the scan in holes wider than a few points"
        advices.append('if there is no material in the holes, missing = "absent" instead')
    findings["Missing points"] = Property(seen, "; ".join(advices), step, {"points": missing})

    levelled = level(h)
    masked = mask_outliers(levelled)
    spikes = int(masked.isnull().sum()) - gaps
    few = 0 < spikes <= _MOST_SPIKES * h.size
    kept = masked if few else levelled
    rms_levelled, rms = (float(np.nanstd(surface.values)) for surface in (levelled, level(kept)))
    seen = f"{spikes} ({_percent(spikes / h.size)})"
    advice = "too many to be spikes: check the picture" * (spikes > 0)
    if few:
        seen += f": Sq is {_length(rms_levelled)} with and {_length(rms)} without them"
        advice = "outliers = true; otherwise the spikes carry the load"
    step = {"outliers": True, "fill": True} if few else {}
    findings["Spikes"] = Property(seen, advice, step, {"points": spikes, "rms_with": rms_levelled, "rms_without": rms})

    plane = h - levelled
    slopes = tuple(float(np.nanmean(plane.diff(axis))) / d for axis, d in zip("xy", spacing(h), strict=True))
    rms_flat = float(np.nanstd(level(kept, 2).values)) if min(h.shape) > 2 else rms
    form = 1 - (rms_flat / rms) ** 2 if rms > 0 else 0.0
    repeats = max(border_mismatch(kept)) > JUMP >= max(border_mismatch(h))  # a plane would break the periodicity
    order = 2 if form > _FORM else int(not repeats and np.nanstd(plane.values) > _TILTED * rms)
    treated = (level(h, order) if order else h).where(kept.notnull())
    along_x, along_y = (f"{math.degrees(math.atan(abs(slope))):.2g}°" for slope in slopes)
    seen = f"{along_x} along x, {along_y} along y; a quadratic form accounts for {_percent(form)} of Sq squared"
    with_form = 'level = 2 for the roughness alone; level = 1 and boundary = "free" for contact with the form'
    advice = ("", "level = 1 subtracts the plane", with_form)[order]
    values = {"slopes": slopes, "share": form, "rms_without": rms_flat}
    findings["Tilt and form"] = Property(seen, advice, {"level": order} if order else {}, values)

    treated = fill(treated) if treated.isnull().any() else treated
    borders = border_mismatch(treated)
    boundary: Literal["periodic", "mirror"] = "mirror" if max(borders) > JUMP else "periodic"
    seen = f"opposite borders differ {borders[0]:.2g} (x) and {borders[1]:.2g} times (y) as much as neighbouring rows"
    findings["Borders"] = Property(seen, f'boundary = "{boundary}"', {}, {"of_neighbours": borders})

    findings["Noise"] = noise = _noise(treated)
    treated = gaussian_filter(treated, noise.step["filter"]) if noise.step else treated
    slope = rms_slope(treated)
    kind = "steeper" if slope > _STEEP else "flatter" if slope < _FLAT else ""
    advice = f"{kind} than almost any measured surface: check unit, spacing and height_scale" * bool(kind)
    findings["Slope"] = Property(f"{slope:.2g} rms after these steps", advice, {}, {"rms_slope": slope})

    proposed = {name: value for finding in findings.values() for name, value in finding.step.items()}
    steps = {name: proposed[name] for name in STEPS if name in proposed}
    return Inspection(findings, steps, boundary, nominal_area(treated), slope)


def _clear_part(h: xr.DataArray, holes: np.ndarray) -> dict[str, Any]:
    """Return limits of the largest rectangle without large holes, as for :func:`roughvisc.crop`. [m]

    Empty if the rectangle is smaller than a tenth of the scan or than 16 points. The limits lie between two points, on
    numbers of few digits.

    Parameters
    ----------
    h : xarray.DataArray, dims (x, y)
        Heights. [m]
    holes : ndarray of bool, shape (nx, ny)
        Points in large holes.
    """
    side = math.ceil(max(h.shape) / _BLOCKS)  # points along the side of a block
    padded = np.pad(holes, [(0, -n % side) for n in h.shape])
    blocks = np.any(padded.reshape(padded.shape[0] // side, side, -1, side), axis=(1, 3))
    clear_below = np.zeros(blocks.shape[1], dtype=int)
    largest = (0, (0, 0), (0, 0))
    for row, has_hole in enumerate(blocks):
        clear_below = np.where(has_hole, 0, clear_below + 1)  # clear blocks in each column, up to this row
        open_columns: list[tuple[int, int]] = []  # first column and number of rows of each rectangle that may grow
        for column, count in enumerate([*clear_below.tolist(), 0]):
            first = column
            while open_columns and open_columns[-1][1] >= count:
                first, rows = open_columns.pop()
                largest = max(largest, (rows * (column - first), (row + 1 - rows, row + 1), (first, column)))
            open_columns.append((first, count))
    limits = {}
    for axis, d, n, (first, end) in zip("xy", spacing(h), h.shape, largest[1:], strict=True):
        first = first * side
        end = min(end * side, n)
        if end - first < min(n, _FEWEST):
            return {}
        if end - first < n:
            unit = 10.0 ** math.floor(math.log10(d / 2))
            edges = float(h[axis][first]) - d / 2, float(h[axis][end - 1]) + d / 2
            limits[axis] = [float(f"{round(edge / unit) * unit:.12g}") for edge in edges]
    return limits if largest[0] * side**2 >= _LEAST_PART * h.size else {}


def _noise(h: xr.DataArray) -> Property:
    """Measure the short-wave end of the spectrum, unless too few points were measured or the surface is flat.

    Filled points raise this end of the spectrum. Noise of 2 % of the rms height is overestimated by up to a third if
    10 % of the points are missing, and weaker noise by more.

    Returns
    -------
    Property
        Its values: ``rms``, the rms height of white noise as strong as the spectrum at its short-wave end [m];
        ``floor``, whether the spectrum is flat there, so that `rms` is the noise and not an upper bound; with a floor
        ``wavelength``, the shortest wave above the noise [m], and ``noisy_slopes``, the share of the shorter waves in
        the mean square slope [-]. Empty if nothing was measured.
    """
    gaps = h["filled"].values.astype(bool) if "filled" in h.coords else np.zeros(h.shape, dtype=bool)
    # points inside or at the edge of large holes are usually artefacts
    gaps = gaps | scipy.ndimage.binary_dilation(in_large_holes(gaps))
    rms = float(h.values.std())
    cell = max(spacing(h))
    if min(h.shape) < 16 or gaps.mean() > _MOST_MISSING or not rms > 1e-12 * np.abs(h.values).max():
        seen = "not known: the scan is flat, smaller than 16 points, or has too many missing points"
        return Property(seen, "", {}, {})
    spectrum = _spectrum(h, gaps)
    waves = _complete(spectrum, h)
    q = waves["wavevector"].values
    density = waves["psd"].values
    octave = q > q[-1] / 2
    area = math.prod(spacing(h))
    tail = float(np.median(density[octave]))
    power = float(np.polyfit(np.log(q[octave]), np.log(np.maximum(density[octave], 1e-300)), 1)[0])
    below = np.flatnonzero(scipy.ndimage.median_filter(density, 5, mode="nearest") < _ABOVE * tail)
    floor = bool(power > _WHITE and below.size and below[0] > 0 and math.sqrt(tail / area) > _ROUNDING * rms)
    if floor and gaps.any():
        more = gaps | np.roll(gaps, [n // 2 for n in gaps.shape], (0, 1))
        floor = float(np.median(_complete(_spectrum(h, more), h)["psd"].values[octave])) <= _OF_GAPS * tail
    if not floor:
        least = math.sqrt(float(np.median(density[q > 0.8 * q[-1]])) / area)
        seen = f"no noise floor down to two cells; noise is below {_length(least)} rms"
        return Property(seen, "", {}, {"rms": least, "floor": False})
    noise = math.sqrt(tail / area)
    cutoff = float(2 * np.pi / q[below[0] - 1])
    every = spectrum["wavevector"].values
    slopes = spectrum["psd"].values * spectrum["modes"].values * every**2
    noisy = float(slopes[every > 2 * np.pi / cutoff].sum() / slopes.sum())
    seen = f"{_length(noise)} rms: waves below {_length(cutoff)} are noise, {_percent(noisy)} of the mean square slope"
    is_harmful = noisy > _HARMLESS and cutoff >= 3 * cell
    step = {"filter": max(float(f"{cutoff:.2g}"), _rounded_up(3 * cell))} if is_harmful else {}
    values = {"rms": noise, "floor": True, "wavelength": cutoff, "noisy_slopes": noisy}
    advice = f'filter = "{written_quantity(step["filter"], "m")}" takes out these wavelengths' if is_harmful else ""
    return Property(seen, advice, step, values)


def _spectrum(h: xr.DataArray, gaps: np.ndarray) -> xr.Dataset:
    """Return the rings of the power spectrum down to two of the shorter cells; a membrane fills the gaps."""
    return psd(fill(h.where(~gaps)), "hann").sel(wavevector=slice(None, np.pi / min(spacing(h))))


def _complete(spectrum: xr.Dataset, h: xr.DataArray) -> xr.Dataset:
    """Return the complete rings of the power spectrum, down to two of the longer cells."""
    return spectrum.sel(wavevector=slice(None, np.pi / max(spacing(h))))


def _rounded_up(value: float) -> float:
    """Round a number up to three digits, without the effect of rounding errors."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return float(f"{math.ceil(value / unit - 1e-9) * unit:.12g}")


def _length(value: float) -> str:
    return unit_for(value, "m").text(value) if np.isfinite(value) else "not known"


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %" if share < 0.995 else f"{100 * share:.0f} %"
