"""Self-affine parameters fitted to a scan, from which an ensemble of surfaces is generated."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import scipy.optimize
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.topography.bandwidth import level
from roughvisc.topography.grid import checked, like, require_complete, spacing
from roughvisc.topography.spectrum import hann, modes

#: Rings a decade of wavevector, and Hurst exponents tried.
_RINGS, _HURSTS = 24, np.linspace(0.02, 1.0, 99)
#: Most that a texture may be drawn out.
_LONGEST = 20.0
#: Modes that are enough to find a direction by.
_ENOUGH = 200_000
#: Modes that a ring counts for at most, since no measured spectrum is a power law to a few per cent; and what a ring
#: costs that is not on the power law.
_MOST, _PRICE = 200.0, 6.0
#: How far the spectrum leaves its power law, as a factor, where the short cut-off is accepted.
_DEPARTURE = 2.0


def fit_self_affine(
    h: xr.DataArray, *, meet: Literal["rms_slope", "rms_height"] = "rms_slope", periodic: bool = False
) -> dict[str, float | None]:
    r"""Fit the parameters of self-affine roughness to the spectrum of a scan.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y), without missing points, with at least 16 cells along each axis. [m]
    meet : {"rms_slope", "rms_height"}, default "rms_slope"
        Which of the two is returned: the slope, which determines the contact area, or the height.
    periodic : bool, default False
        Whether the surface is periodic. Otherwise a plane is subtracted, and a Hann window reduces the weight of the
        border.

    Returns
    -------
    dict
        ``hurst`` [-], ``rolloff`` [m], or None if the power law reaches the longest wavelength, ``shortcut`` [m],
        ``anisotropy`` [-], and ``rms_slope`` [-] of the wavelengths above the short cut-off, or ``rms_height`` [m]: the
        arguments of :func:`roughvisc.self_affine`, as in ``self_affine(size, shape, **fit_self_affine(h), seed=1)``.

    Raises
    ------
    InputError
        If points are missing (fill them first), the scan is flat or too small, or `meet` is neither.

    Notes
    -----
    The model is :math:`C = c \max(q, q_r)^{-2 - 2H}` for :math:`q < q_s`, and arbitrary beyond :math:`q_s`. It is
    fitted to the power of the modes by Whittle's likelihood, :math:`\sum \ln C + |\tilde h|^2 / C`, over rings of
    :math:`q = |(\sqrt a\, q_x, q_y / \sqrt a)|`, with the anisotropy :math:`a` for which no direction is preferred. The
    short cut-off is the wavelength below which the spectrum deviates from the power law by a factor of two or more,
    downwards (resolution of the instrument) or upwards (noise); otherwise it is two cells.

    References
    ----------
    .. [1] P. Whittle, Ark. Mat. 2 (1953) 423-434.
    """
    h = checked(h, "fit_self_affine")
    if meet not in ("rms_slope", "rms_height"):
        raise InputError(f"fit_self_affine: meet is {meet!r}: expected 'rms_slope' or 'rms_height'")
    require_complete(h, "fit_self_affine")
    if min(h.shape) < 16:
        raise InputError(f"fit_self_affine: found {h.shape[0]} x {h.shape[1]} cells: expected at least 16 each way")
    h = like(h, h.values - h.values.mean()) if periodic else level(h)
    if not h.values.std() > 1e-12 * np.abs(h.values).max(initial=1e-300):
        raise InputError("fit_self_affine: the surface is flat: expected roughness")
    modes = _Modes.of(h, periodic)
    anisotropy, cutoff_q = 1.0, math.inf
    for _ in range(4):  # the direction shows only below the cut-off, which is sharp only in the right direction
        anisotropy = modes.anisotropy(cutoff_q)
        rings = _rings(modes, anisotropy)
        rolloff, hurst, last = _segments(rings)
        cutoff_q = _cutoff(rings, rolloff, hurst, last)
    hurst, rolloff_q = _refined(rings, rolloff, hurst, last)
    seen = modes.stretched(anisotropy) < cutoff_q * (1 - 1e-12)
    value = modes.rms_slope(seen) if meet == "rms_slope" else math.sqrt(np.mean(h.values**2))
    return {
        "hurst": float(hurst),
        "rolloff": None if rolloff_q is None else float(2 * np.pi / rolloff_q),
        "shortcut": float(2 * np.pi / cutoff_q),
        "anisotropy": float(anisotropy),
        meet: float(value),
    }


@dataclass(frozen=True)
class _Modes:
    """Modes of a surface: wavevectors [rad/m], variances [m2], and how many each stands for."""

    q_x: np.ndarray
    q_y: np.ndarray
    power: np.ndarray
    count: np.ndarray
    size: tuple[float, float]
    finest: tuple[float, float]

    @classmethod
    def of(cls, h: xr.DataArray, periodic: bool) -> _Modes:
        """Modes of levelled heights, under a Hann window unless they repeat."""
        cells, shape = spacing(h), h.shape
        q_x, q_y, power, count = modes(h.values if periodic else hann(h.values), cells, norm="forward")
        power[0, 0] = 0.0
        size = (shape[0] * cells[0], shape[1] * cells[1])
        return cls(q_x, q_y, power, count, size, cells)

    def stretched(self, anisotropy: float) -> np.ndarray:
        """Modulus of the wavevectors of the isotropic surface that this one is stretched from. [rad/m]"""
        return np.hypot(self.q_x * math.sqrt(anisotropy), self.q_y / math.sqrt(anisotropy))

    def nyquist(self, anisotropy: float) -> float:
        """Highest wavevector seen whole, as `shortcut` of self_affine defaults to. [rad/m]"""
        root = math.sqrt(anisotropy)
        return np.pi / max(self.finest[0] / root, self.finest[1] * root)

    def lowest(self, anisotropy: float) -> float:
        """Step of the wavevectors, the coarser of the two directions. [rad/m]"""
        root = math.sqrt(anisotropy)
        return 2 * np.pi * max(root / self.size[0], 1 / (root * self.size[1]))

    def rms_slope(self, seen: np.ndarray) -> float:
        """Root mean square slope of some of the modes."""
        return math.sqrt(float((self.count * self.power * (self.q_x**2 + self.q_y**2))[seen].sum()))

    def anisotropy(self, cutoff_q: float) -> float:
        """How many times longer the texture is along x: stretched back, the rings have no preferred direction."""
        relevant = np.flatnonzero(self.power > 1e-12 * self.power.max())  # not rounding
        if relevant.size > _ENOUGH:
            relevant = np.random.default_rng(0).choice(relevant, _ENOUGH, replace=False)
        row, column = np.unravel_index(relevant, self.power.shape)
        x2, y2 = self.q_x[row, 0] ** 2, self.q_y[0, column] ** 2
        count, power = self.count[row, column], (self.count * self.power)[row, column]

        def preference(logarithm: float) -> float:
            ratio = math.exp(logarithm)
            q2 = ratio * x2 + y2 / ratio
            edges = _edges(self, ratio)
            ring = np.digitize(q2, edges**2)
            ring[(ring == len(edges)) | (q2 > cutoff_q**2)] = 0
            mean = np.bincount(ring, power, len(edges)) / np.maximum(np.bincount(ring, count, len(edges)), 1)
            # cos of twice the angle, each ring weighed by its modes: the few strong long waves would drown the rest
            weight = np.where(ring > 0, power / np.where(mean > 0, mean, 1.0)[ring], 0.0)
            total = float(weight.sum())  # zero where no ring lies in the ellipse
            return float((weight * (2 * ratio * x2 / q2 - 1)).sum()) / total if total else math.nan

        tried = np.linspace(-math.log(_LONGEST), math.log(_LONGEST), 13)
        found = np.array([preference(logarithm) for logarithm in tried])
        rises = np.flatnonzero((found[:-1] < 0) & (found[1:] >= 0))
        if not rises.size:
            raise InputError("fit_self_affine: the surface is lines along one axis: expected roughness both ways")
        low = rises[np.argmin(np.abs(tried[rises] + tried[rises + 1]))]  # the least stretched, where noise has several
        return math.exp(scipy.optimize.brentq(preference, tried[low], tried[low + 1], xtol=1e-3))


@dataclass(frozen=True)
class _Rings:
    """Rings of modes: their edges and mean wavevectors [rad/m], mean power [m2], and weights."""

    edges: np.ndarray
    q: np.ndarray
    power: np.ndarray
    count: np.ndarray


def _edges(modes: _Modes, anisotropy: float) -> np.ndarray:
    """Edges of rings of equal width on the logarithmic scale, up to the last one that is seen whole. [rad/m]"""
    low, top = 0.75 * modes.lowest(anisotropy), modes.nyquist(anisotropy)
    if top < 2 * low:
        return np.array([low, max(top, 1.01 * low)])
    return np.geomspace(low, top, max(4, round(_RINGS * math.log10(top / low))) + 1)


def _rings(modes: _Modes, anisotropy: float) -> _Rings:
    q, edges = modes.stretched(anisotropy), _edges(modes, anisotropy)
    wanted = len(edges) - 1
    ring = np.digitize(q.ravel(), edges) - 1
    ring[ring < 0] = wanted
    count = np.bincount(ring, modes.count.ravel(), wanted + 1)[:-1]
    centre = np.bincount(ring, (modes.count * q).ravel(), wanted + 1)[:-1]
    power = np.bincount(ring, (modes.count * modes.power).ravel(), wanted + 1)[:-1]
    held = count > 0
    if held.sum() < 6:
        raise InputError(f"fit_self_affine: the scan holds {held.sum()} rings of waves: expected a larger one")
    count, centre, power = count[held], centre[held] / count[held], power[held] / count[held]
    edges = np.r_[edges[:-1][held], edges[-1]]
    power = np.maximum(power, 1e-14 * power.max())
    return _Rings(edges, centre, power, np.minimum(count, _MOST))


def _segments(rings: _Rings) -> tuple[int, float, int]:
    """Ring of the roll-off, Hurst exponent, and number of rings below the short cut-off, of the best likelihood.

    For every roll-off and Hurst exponent, running sums over the rings give the likelihoods of all cut-offs at once.
    A ring beyond has a power of its own, at a price.
    """
    n, log_q = len(rings.q), np.log(rings.q)
    own = np.cumsum(rings.count * (np.log(rings.power) + 1) + _PRICE)
    best, whole = (math.inf, 0, 0.5, n), (math.inf, 0, 0.5, n)
    for rolloff in range(n - 3):
        below = _likelihood(rings.power, rings.count, _law(_HURSTS[:, None], log_q, log_q[rolloff]))
        total = (below + own[-1] - own)[:, rolloff + 2 :]  # a power law of three rings at least
        i, k = np.unravel_index(np.argmin(total), total.shape)
        best = min(best, (float(total[i, k]), rolloff, float(_HURSTS[i]), int(k) + rolloff + 3))
        i = np.argmin(below[:, -1])
        whole = min(whole, (float(below[i, -1]), rolloff, float(_HURSTS[i]), n))
    if best[3] < n and _departs(rings, *best[1:]):
        return best[1], best[2], max(best[3] - 1, best[1] + 3)  # the last one may hold the cut-off already
    return whole[1:]


def _law(hurst: Any, log_q: np.ndarray, log_rolloff: float) -> np.ndarray:
    """Logarithm of the power law, of free level."""
    return -(2 + 2 * hurst) * np.maximum(log_q, log_rolloff)


def _departs(rings: _Rings, rolloff: int, hurst: float, last: int) -> bool:
    """Whether the spectrum is away from the power law for good where it has left it."""
    departure = np.log(rings.power[last:] / _expected(rings, rolloff, hurst, last)[last:])
    return bool(abs(np.mean(departure[-max(1, len(departure) // 3) :])) > math.log(_DEPARTURE))


def _expected(rings: _Rings, rolloff: int, hurst: float, last: int) -> np.ndarray:
    """Power of all rings by the law that fits the first ones. [m2]"""
    log_q = np.log(rings.q)
    law = np.exp(_law(hurst, log_q, log_q[rolloff]) - _law(hurst, log_q[last - 1], log_q[rolloff]))
    return law * (rings.count * rings.power / law)[:last].sum() / rings.count[:last].sum()


def _cutoff(rings: _Rings, rolloff: int, hurst: float, last: int) -> float:
    """Wavevector up to which the power law holds: the rings that hold the cut-off are full up to it. [rad/m]"""
    square = rings.edges[last] ** 2
    share = (rings.power / _expected(rings, rolloff, hurst, last))[last : last + 3]
    for i, filled in enumerate(share):
        square += min(filled, 1.0) * (rings.edges[last + i + 1] ** 2 - rings.edges[last + i] ** 2)
    return math.sqrt(square)


def _likelihood(power: np.ndarray, count: np.ndarray, law: np.ndarray) -> np.ndarray:
    """Whittle's likelihood (less is better) of a law of free level over the first k rings, for every k."""
    modes = np.cumsum(count)
    level_ = np.cumsum(count * power * np.exp(-law), axis=-1) / modes
    return modes * (np.log(level_) + 1) + np.cumsum(count * law, axis=-1)


def _refined(rings: _Rings, rolloff: int, hurst: float, last: int) -> tuple[float, float | None]:
    """Hurst exponent and roll-off [rad/m] between the values tried; None where the roll-off is at the lowest ring."""
    power, count, log_q = rings.power[:last], rings.count[:last], np.log(rings.q[:last])

    def cost(parameters: Any) -> float:
        return float(_likelihood(power, count, _law(parameters[0], log_q, parameters[1]))[-1])

    near = (log_q[max(rolloff - 1, 0)], log_q[min(rolloff + 1, last - 3)])
    bounds = [(max(hurst - 0.1, 0.01), min(hurst + 0.1, 1.0)), near]
    found = scipy.optimize.minimize(cost, [hurst, log_q[rolloff]], method="Nelder-Mead", bounds=bounds).x
    lowest = log_q[0] + math.log(1.1)
    return float(found[0]), None if rolloff == 0 or found[1] < lowest else math.exp(found[1])
