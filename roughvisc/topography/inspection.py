"""What a scan has to be treated for before it is pressed: spikes, holes, tilt, form, borders that jump, noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import scipy.ndimage
import xarray as xr

from roughvisc.topography.borders import BorderMismatch, border_mismatch
from roughvisc.topography.cards import condition
from roughvisc.topography.conditioning import crop, fill, gaussian_filter, level, mask_outliers
from roughvisc.topography.grid import cell_edges, checked, filled_points, nominal_area, require_heights, spacing
from roughvisc.topography.missing_points import in_large_holes
from roughvisc.topography.parameters import parameters
from roughvisc.topography.spectrum import psd

#: Share of the surface in large holes from which a part without them is proposed.
_HOLES = 0.01
#: Beyond this share of the points, what looks like spikes may be the surface itself.
MOST_SPIKES = 0.02
#: Share of the mean square height that a curved form has from which it is called one.
FORM = 0.5
#: A white tail of the spectrum falls no steeper than this power of the wavevector over the last octave; and where
#: the spectrum is less than so many times the tail, noise is as strong as the surface.
_WHITE, _ABOVE = -1.5, 2.0
#: A floor this far below the root mean square height is rounding; one that has no more of the mean square slope than
#: this is left in.
_ROUNDING, _HARMLESS = 1e-6, 0.02
#: Share of the points that may be missing where a spectrum is taken.
_MOST_MISSING = 0.5
#: Hiding as many points again raises a floor by more than this factor if the filled points made it.
_OF_GAPS = 1.5
#: Waves of fewer cells than this are not resolved in contact.
RESOLVED = 8


@dataclass(frozen=True)
class Noise:
    """Short-wave end of the spectrum of a scan.

    Filled points raise it. Noise of 2 % of the rms height is overestimated by up to a third where 10 % of the points
    are missing; weaker noise by more.

    Attributes
    ----------
    rms : float
        Root mean square of white noise as strong as the spectrum at its short-wave end. [m]
    floor : bool
        Whether the spectrum is flat there: whether `rms` is the noise, and not a bound of it.
    wavelength : float
        The shortest wave that stands above the noise; two cells where no floor is seen. [m]
    fine_slopes : float
        Share of the mean square slope that waves shorter than eight cells have. [-]
    noisy_slopes : float
        Share of the mean square slope that waves below the floor have. [-]
    """

    rms: float
    floor: bool
    wavelength: float
    fine_slopes: float
    noisy_slopes: float


@dataclass(frozen=True)
class Inspection:
    """What is seen in a scan, and the conditioning steps that follow from it.

    Attributes
    ----------
    points, missing, spikes : int
        Number of points of the part that is proposed, how many are missing, how many are spikes.
    holes : float
        Share of the whole scan that lies in large holes. [-]
    rms_raw, rms_levelled, rms_despiked, rms_flat : float
        Root mean square height less its mean; less its plane; without spikes; less its quadratic form. [m]
    tilt : pair of float
        Slope of the mean plane along x and y. [-]
    borders : BorderMismatch
        How opposite borders differ after levelling.
    noise : Noise or None
        None where the scan is flat, or too small for a spectrum.
    rms_slope, kurtosis : float
        Of the surface after the steps; Gaussian heights have a kurtosis of 3. [-]
    area : float
        Of the surface after the steps. [m2]
    shape : pair of int
        Points of the surface after the steps.
    steps : dict
        Conditioning steps as surface cards and studies write them.
    boundary : {"periodic", "mirror"}
        Boundary with which the surface repeats without a step.
    """

    points: int
    missing: int
    spikes: int
    holes: float
    rms_raw: float
    rms_levelled: float
    rms_despiked: float
    rms_flat: float
    tilt: tuple[float, float]
    borders: BorderMismatch
    noise: Noise | None
    rms_slope: float
    kurtosis: float
    area: float
    shape: tuple[int, int]
    steps: dict[str, Any]
    boundary: Literal["periodic", "mirror"]

    @property
    def form_share(self) -> float:
        """Share of the mean square height, less its plane, that a quadratic form has. [-]"""
        return 1 - (self.rms_flat / self.rms_despiked) ** 2 if self.rms_despiked > 0 else 0.0


def inspect_scan(h: xr.DataArray) -> Inspection:
    """What is to be seen in a scan, and what to do with it before it is pressed.

    Parameters
    ----------
    h : xarray.DataArray, dims (x, y)
        Heights as read, NaN where missing. [m]

    Returns
    -------
    Inspection

    Raises
    ------
    InputError
        If all points are missing, or those present determine no plane.
    """
    h = checked(h, "inspect_scan")
    limits, holes = _without_holes(h)
    part = crop(h, **limits) if limits else h
    missing, spikes, rms_levelled, tilt, kept = _despiked(part)
    doubtful = spikes > MOST_SPIKES * part.size
    straight, flat = _rms(level(kept)), _rms(level(kept, 2)) if min(part.shape) > 2 else np.nan
    curved = flat < np.sqrt(1 - FORM) * straight
    steps: dict[str, Any] = {"crop": limits} if limits else {}
    steps |= {"level": 2 if curved else _order(part, kept)}
    steps |= {"outliers": True} if spikes and not doubtful else {}
    steps |= {"fill": "harmonic"} if missing or "outliers" in steps else {}
    points, rms_raw = part.size, _rms(part)
    if steps["level"] == 1 and not doubtful:  # these steps are done
        treated = fill(kept) if "fill" in steps else kept
    else:
        treated = condition(h, steps)
    borders = border_mismatch(treated)
    noise = _noise(treated)
    if noise is not None and noise.noisy_slopes > _HARMLESS and noise.wavelength >= 3 * max(spacing(treated)):
        steps["filter"] = float(f"{noise.wavelength:.2g}")
        steps["filter"] = max(steps["filter"], 3.001 * max(spacing(treated)))
        treated = gaussian_filter(treated, steps["filter"])
    measures = parameters(treated)
    return Inspection(
        points=points,
        missing=missing,
        spikes=spikes,
        holes=holes,
        rms_raw=rms_raw,
        rms_levelled=rms_levelled,
        rms_despiked=straight,
        rms_flat=flat,
        tilt=tilt,
        borders=borders,
        noise=noise,
        rms_slope=float(measures["Sdq"]),
        kurtosis=float(measures["Sku"]),
        area=nominal_area(treated),
        shape=(treated.shape[0], treated.shape[1]),
        steps=steps,
        boundary="mirror" if borders.jumps else "periodic",
    )


def _despiked(part: xr.DataArray) -> tuple[int, int, float, tuple[float, float], xr.DataArray]:
    """Missing points and spikes, rms height [m] and tilt of a scan, and the scan less its plane.

    It is without the spikes, unless they are so many that they may be the surface.
    """
    missing = int(part.isnull().sum())
    levelled = level(part)
    rms, tilt = _rms(levelled), _tilt(part, levelled)
    masked = mask_outliers(levelled)
    spikes = int(masked.isnull().sum()) - missing
    return missing, spikes, rms, tilt, levelled if spikes > MOST_SPIKES * part.size else masked


def _order(part: xr.DataArray, levelled: xr.DataArray) -> int:
    """Order of the polynomial to take off: a plane, unless that would tear open a surface that repeats as it is."""
    return 0 if border_mismatch(levelled).jumps and not border_mismatch(part).jumps else 1


def _rms(h: xr.DataArray) -> float:
    require_heights(h, "inspect_scan")
    return float(np.nanstd(h.values))


def _tilt(before: xr.DataArray, after: xr.DataArray) -> tuple[float, float]:
    """Slopes of the plane that was taken off, from some of its points. [-]"""
    plane = before.values - after.values
    i, j = np.nonzero(np.isfinite(plane))
    some = slice(None, None, max(1, i.size // 10_000))
    i, j = i[some], j[some]
    values = plane[i, j] - plane[i, j].mean()
    slopes = np.linalg.lstsq(np.stack([np.ones(i.size), i, j], axis=1), values, rcond=None)[0][1:]
    return float(slopes[0] / spacing(before)[0]), float(slopes[1] / spacing(before)[1])


def _without_holes(h: xr.DataArray) -> tuple[dict[str, tuple[float, float]], float]:
    """Limits of the largest rectangle without large holes [m], empty if there are none, and the share in them."""
    if not h.isnull().any():
        return {}, 0.0
    void = in_large_holes(np.isnan(h.values))
    share = float(void.mean())
    if share < _HOLES:
        return {}, share
    block = [max(1, n // 128) for n in h.shape]
    coarse = np.logical_or.reduceat(void, np.arange(0, h.shape[0], block[0]), axis=0)
    coarse = np.logical_or.reduceat(coarse, np.arange(0, h.shape[1], block[1]), axis=1)
    rows, columns = _largest_rectangle(~coarse)
    limits = {}
    for axis, (first, last), step in zip(("x", "y"), (rows, columns), block, strict=True):
        first, last = first * step, min(last * step, h.sizes[axis])
        if last - first < 16:
            return {}, share
        edges = cell_edges(h[axis])
        limits[axis] = (float(f"{edges[first]:.6g}"), float(f"{edges[last]:.6g}"))
    return limits, share


def _largest_rectangle(present: np.ndarray) -> tuple[tuple[int, int], tuple[int, int]]:
    """Rows and columns, the last excluded, of the rectangle of the most cells of which all are present."""
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


def _noise(h: xr.DataArray) -> Noise | None:
    """Short-wave end of the spectrum; None where few points were measured, or the surface is flat."""
    values, sides, gaps = h.values, spacing(h), _unmeasured(h)
    if min(h.shape) < 16 or np.count_nonzero(gaps) > _MOST_MISSING * h.size:
        return None
    rms = float(np.nanstd(values))
    if not rms > 1e-12 * max(1e-300, np.nanmax(np.abs(values))):
        return None
    q, density, modes = _short_waves(h, gaps)
    octave = q > q[-1] / 2
    tail = float(np.median(density[octave]))
    power = float(np.polyfit(np.log(q[octave]), np.log(np.maximum(density[octave], 1e-300)), 1)[0])
    smooth = scipy.ndimage.median_filter(density, 5, mode="nearest")
    below = np.flatnonzero(smooth < _ABOVE * tail)
    strength = float(np.sqrt(tail / (sides[0] * sides[1])))
    floor = bool(power > _WHITE and below.size and below[0] > 0 and strength > _ROUNDING * rms)
    floor = floor and not _grows_with_gaps(h, gaps, tail)
    shortest = float(2 * np.pi / q[below[0] - 1]) if floor else 2 * max(sides)
    slopes = density * modes * q**2

    def share(wavelength: float) -> float:
        return float(slopes[q > 2 * np.pi / wavelength].sum() / slopes.sum())

    if not floor:
        strength = float(np.sqrt(np.median(density[q > 0.8 * q[-1]]) / (sides[0] * sides[1])))
    return Noise(strength, floor, shortest, share(RESOLVED * max(sides)), share(shortest) if floor else 0.0)


def _unmeasured(h: xr.DataArray) -> np.ndarray:
    """Mask of the points that were missing or filled in, or lie in a large hole or on its rim.

    Points that instruments give inside a large hole or on its rim are usually artefacts.
    """
    missing, filled = np.isnan(h.values), filled_points(h)
    if filled is not None:
        missing |= filled
    return missing | scipy.ndimage.binary_dilation(in_large_holes(missing)) if missing.any() else missing


def _short_waves(h: xr.DataArray, gaps: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Wavevector [rad/m], density [m4] and number of waves of the complete rings, with a membrane over the gaps."""
    spectrum = psd(fill(h.where(~gaps)) if gaps.any() else h, "hann")
    seen = spectrum["wavevector"].values <= np.pi / max(spacing(h))
    q, density, modes = (spectrum[name].values[seen] for name in ("wavevector", "psd", "modes"))
    return q, density, modes


def _grows_with_gaps(h: xr.DataArray, gaps: np.ndarray, tail: float) -> bool:
    """Whether a floor [m4] comes from the filled gaps, and is no noise: with as many gaps again it is larger."""
    if not gaps.any():
        return False
    more = gaps | np.roll(gaps, [n // 2 for n in gaps.shape], (0, 1))
    if np.count_nonzero(more) > _MOST_MISSING * h.size:
        return False
    q, density, _ = _short_waves(h, more)
    return float(np.median(density[q > q[-1] / 2])) > _OF_GAPS * tail
