r"""Creep of a layered body: what each wave answers, as a series of exponentials with times that all waves share.

A body that dissipates answers a wave of any length by a creep compliance of its own, which is a positive sum of
exponentials. Where all materials of the body have moduli of one sign at the complex frequency ``-1/tau``, no wave has a
time ``tau``: the times of all waves lie between the relaxation and the retardation times of one material or the other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.mechanics.bodies.half_space import love_kernel
from roughvisc.mechanics.bodies.kernel import Kernel, half_space_transfer
from roughvisc.mechanics.bodies.layered import effective_compliance, image_depths, image_influence
from roughvisc.mechanics.materials.prony import Prony
from roughvisc.mechanics.materials.spectrum import lattice, nonnegative

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Nodes of the inverse Laplace transform on one side of the real axis: 5e-10 (measured).
_NODES = 12
# Waves at which the series is fitted, in a decade: the first of them whose interpolant is near enough; and what it may
# differ by, as a part of the error asked for.
_WAVES_PER_DECADE, _INTERPOLATED = (10, 14, 20, 30, 45), 0.2
# Wave number times the thinnest layer's thickness from which on a wave feels the top layer alone; and the decades of
# the wave number times the whole thickness below which it is to feel the half-space alone.
_SHORT, _DECADES = 15.0, 9
# Instants in a decade at which the compliance is fitted.
_INSTANTS = 8
# Times in a decade that are offered to a fit, where waves may have them; and how far they go beyond the ages asked for.
_OFFERED, _BEYOND = (0, 1, 1.5, 2, 3, 4, 5, 6, 8, 10, 12, 14, 17, 20, 24, 28, 34, 40, 48, 57, 68), 10.0
# Times in a decade at which the signs of the moduli are compared.
_SIGNS = 100
# Depths of images in a decade: right to 1e-5 in free space, in a third of the time that elastic layers take.
_IMAGES_PER_DECADE = 10
# How much more the limit of long waves counts than each wave, where images are fitted: it is the far field.
_LIMIT = 100.0
# A term that nowhere makes up more of the compliance than this is left out.
_UNSEEN = 1e-9


@dataclass(frozen=True)
class Strata:
    """Layers on a half-space, of series of exponentials.

    Attributes
    ----------
    thicknesses : tuple of float
        Of the layers, from the top. [m]
    materials : tuple of Prony
        Of the layers and of the half-space.
    """

    thicknesses: tuple[float, ...]
    materials: tuple[Prony, ...]

    @property
    def poissons(self) -> tuple[float, ...]:
        """Poisson's ratios."""
        return tuple(one.poisson for one in self.materials)

    def at_once(self, q: Array) -> Array:
        """Effective contact compliance of waves at once. [1/Pa]"""
        shear = [one.glassy for one in self.materials]
        rigid = shear.index(0.0) if 0.0 in shear else len(shear) - 1  # what lies below moves nothing
        if rigid == 0:
            return 0 * q
        thicknesses, poissons = self.thicknesses[:rigid], self.poissons[: rigid + 1]
        return np.asarray(effective_compliance(q, thicknesses, poissons, shear[: rigid + 1]))

    def creep(self, q: Array, t: Array) -> Array:
        """Effective contact compliance of waves after some times, shape ``(waves, times)``. [1/Pa]

        Notes
        -----
        By the inverse Laplace transform on Talbot's contour with the parameters of [1]_.

        References
        ----------
        .. [1] J. A. C. Weideman, SIAM J. Numer. Anal. 44 (2006) 2342.
        """
        count = 2 * _NODES
        angle = (2 * np.arange(_NODES) + 1) * math.pi / count
        cotangent, sine = 1 / np.tan(0.6407 * angle), np.sin(0.6407 * angle)
        z = count * (-0.4814 + 0.6122 * angle * cotangent + 0.2645j * angle)
        slope = 0.6122 * cotangent - 0.6122 * 0.6407 * angle / sine**2 + 0.2645j
        weights = 2 * np.exp(z) * slope / z
        shear = [laplace_compliance(one, z / t[:, None]) for one in self.materials]
        found = effective_compliance(q[:, None, None], self.thicknesses, self.poissons, shear)
        return np.asarray((found @ weights).imag)

    def times(self, shortest: float, longest: float, per_decade: float) -> Array:
        """Times that waves may have, between two limits that stand for all beyond them: own ones, and some between."""
        own = {time for one in self.materials for time in one.times}
        place = lattice(shortest, longest, _SIGNS)
        signs = np.sign([laplace_compliance(one, -1 / place) for one in self.materials])
        apart = (signs != signs[0]).any(axis=0)
        apart[1:] |= apart[:-1].copy()
        apart[:-1] |= apart[1:].copy()
        found = {min(max(time, shortest), longest) for time in own}
        ends = np.flatnonzero(np.diff(np.concatenate([[False], apart, [False]]).astype(int)))
        for first, end in zip(place[ends[::2]], place[ends[1::2] - 1], strict=True):
            found |= {float(first), float(end)} if per_decade == 0 else set(lattice(first, end, per_decade).tolist())
        return np.array(sorted(found))


def laplace_compliance(material: Prony, s: NDArray[Any]) -> NDArray[Any]:
    """Shear compliance of a series under a pressure that grows as ``exp(s t)``. [1/Pa], [1/s]"""
    found = material.glassy + material.fluidity / s
    for compliance, time in zip(material.compliances, material.times, strict=True):
        with np.errstate(divide="ignore"):  # at a time of its own
            found = found + compliance / (1 + s * time)
    return np.asarray(found)


@dataclass(frozen=True, eq=False)
class WaveSeries:
    r"""Effective contact compliance of waves, :math:`C(q, t) = C_0 + \varphi t + \sum_m C_m (1 - e^{-t/\tau_m})`.

    Attributes
    ----------
    q : ndarray, shape (n,)
        Wave numbers, ascending; longer and shorter waves have the compliance of the first and the last. [1/m]
    times : tuple of float
        ``tau_m``. [s]
    at_once : ndarray, shape (n,)
        ``C_0``. [1/Pa]
    compliances : ndarray, shape (m, n)
        ``C_m``, [1/Pa]; the fluidity comes last where there is one, [1/(Pa s)].
    flows : bool
        Whether there is one.
    error : float
        Largest relative error at the times asked for, measured at these waves and between them.
    """

    q: Array
    times: tuple[float, ...]
    at_once: Array
    compliances: Array
    flows: bool
    error: float

    def kernel(self, weights: Array, at_once: float = 1.0) -> WaveKernel:
        """Of a sum of the terms times some weights, and of ``C_0`` times a number."""
        return WaveKernel(self.q, at_once * self.at_once + weights @ self.compliances)

    def material(self, longest: float, shortest: float, duration: float) -> Prony:
        """The wave that creeps most, relative to what it does at once, of those within limits [1/m], in a time. [s]

        It stands for all where a step is judged: none needs shorter steps.
        """
        q = np.clip(np.geomspace(longest, shortest, 50), self.q[0], self.q[-1])
        at_once, terms = self._interpolant(np.log(q))[0], self._interpolant(np.log(q))[1:]
        crept = self.crept(duration) @ terms
        wave = int(np.argmax(crept / np.maximum(at_once, 1e-12 * crept)))
        own = np.maximum(terms[:, wave], 0.0) * 4.0  # contact compliances are a quarter of the shear's at nu = 1/2
        fluidity = max(float(own[-1]), 1e-300) if self.flows else 0.0
        return Prony(4.0 * float(at_once[wave]), fluidity, tuple(own[: len(self.times)].tolist()), self.times)

    def crept(self, t: float) -> Array:
        """What the terms have come to after a time, of their weight."""
        retarded = -np.expm1(-t / np.array(self.times)) if self.times else np.zeros(0)
        return np.append(retarded, t) if self.flows else retarded

    @cached_property
    def _interpolant(self) -> Any:
        from scipy.interpolate import CubicSpline  # slow to import

        return CubicSpline(np.log(self.q), np.vstack([self.at_once, self.compliances]), axis=1)


@dataclass(frozen=True, eq=False)
class WaveKernel(Kernel):
    """A kernel by the effective compliance of waves.

    Attributes
    ----------
    q : ndarray, shape (n,)
        Wave numbers, ascending. [1/m]
    compliance : ndarray, shape (n,)
        The kernel is ``2 C / |q|``; shorter and longer waves have the last and the first one.
    """

    q: Array
    compliance: Array

    def transfer(self, qx: ArrayLike, qy: ArrayLike) -> Array:
        """``2 C(|q|) / |q|``; zero at ``q = 0``."""
        return half_space_transfer(lambda q: self._along(np.log(np.clip(q, self.q[0], self.q[-1]))), qx, qy)

    def influence(self, shape: tuple[int, int], spacing: tuple[float, float]) -> Array:
        """That of a half-space as short waves feel it, and images, as of a layered elastic one."""
        depths, q, inverse = _images(float(self.q[0]), float(self.q[-1]))
        short = self.compliance[-1]
        wanted = np.append(self._along(np.log(q)), _LIMIT * self.compliance[0]) - np.append(
            np.full(q.size, short), _LIMIT * short
        )
        return short * love_kernel(shape, spacing) + image_influence(shape, spacing, depths, inverse @ wanted)

    @cached_property
    def _along(self) -> Any:
        from scipy.interpolate import CubicSpline  # slow to import

        return CubicSpline(np.log(self.q), self.compliance)


@lru_cache(maxsize=8)
def _images(longest: float, shortest: float) -> tuple[Array, Array, Array]:
    """Depths of images [m], wave numbers at which they are compared [1/m], and what gives their weights from there."""
    depths = image_depths(0.8 * _SHORT / shortest, 1 / longest, _IMAGES_PER_DECADE)
    q = np.geomspace(longest, shortest, 2 * depths.size)
    rows = np.vstack([np.exp(-np.outer(q, depths)), np.full(depths.size, _LIMIT)])
    return depths, q, np.linalg.pinv(rows, rcond=1e-13)


@lru_cache(maxsize=8)
def wave_series(strata: Strata, shortest: float, duration: float, tolerance: float) -> WaveSeries:
    """The series of the waves of a layered body.

    Parameters
    ----------
    strata : Strata
    shortest, duration : float
        Ages between which the compliance is asked for, beside zero; of programs of jumps alone both are zero. [s]
    tolerance : float
        Relative error that is asked for. What was reached is in the answer, and may be more.

    Returns
    -------
    WaveSeries

    Notes
    -----
    At some waves by non-negative least squares in time; between them by an interpolant in the logarithm of the wave
    number, which is linear in what it interpolates: the sum of the terms is as near there as the compliances are.
    """
    t = lattice(shortest, duration, _INSTANTS) if duration > 0 else np.zeros(0)
    q, between = _waves(strata, t, tolerance)
    exact, expected = strata.creep(q, t), strata.creep(between, t)
    at_once = strata.at_once(q)
    if not t.size:
        return WaveSeries(q, (), at_once, np.zeros((0, q.size)), False, 0.0)
    first, last = shortest / _BEYOND, duration * _BEYOND
    flows = any(one.fluidity > 0 for one in strata.materials)
    best: WaveSeries | None = None
    for per_decade in _OFFERED:
        times = strata.times(first, last, per_decade)
        found = _fitted(q, at_once, exact, t, times, flows or last in times, between, expected)
        if best is None or found.error < best.error:
            best = found
        if found.error <= tolerance:
            break
    assert best is not None
    return best


def _fitted(
    q: Array,
    at_once: Array,
    exact: Array,
    t: Array,
    times: Array,
    flows: bool,
    between: Array,
    expected: Array,
) -> WaveSeries:
    """The series with some times, its error measured at waves between too."""
    columns = -np.expm1(-t[:, None] / times)
    if flows:
        columns = np.column_stack([columns, t])
    weights = np.zeros((q.size, columns.shape[1]))
    for wave, (first, row) in enumerate(zip(at_once, exact, strict=True)):
        if columns.size:  # of none the fit would fail
            weights[wave] = nonnegative(columns, row - first, row)
    part = (weights[:, None] * columns / exact[..., None]).max(axis=(0, 1)) if columns.size else np.zeros(0)
    used = part > _UNSEEN
    weights, columns = weights[:, used], columns[:, used]
    flows = flows and bool(used[-1])
    kept = tuple(times[used[: times.size]].tolist())
    series = WaveSeries(q, kept, at_once, np.ascontiguousarray(weights.T), flows, math.inf)
    there = series._interpolant(np.log(between))
    off = max(
        np.abs((at_once[:, None] + weights @ columns.T) / exact - 1).max(),
        np.abs((there[0][:, None] + there[1:].T @ columns.T) / expected - 1).max(),
    )
    return WaveSeries(q, kept, at_once, series.compliances, flows, float(off))


def _waves(strata: Strata, t: Array, tolerance: float) -> tuple[Array, Array]:
    """Wave numbers at which the compliances are known well enough by an interpolant, and others between. [1/m]"""
    from scipy.interpolate import CubicSpline  # slow to import

    whole, thinnest = sum(strata.thicknesses), min(strata.thicknesses)
    few = t[:: max(t.size // 4, 1)]

    def known(q: NDArray[Any]) -> Array:
        return np.column_stack([strata.at_once(q), strata.creep(q, few)])

    decades = 10.0 ** -np.arange(1, _DECADES + 1) / whole
    found, base = known(decades), strata.materials[-1]
    alone = np.array([float(base.contact_compliance(time)) for time in (0.0, *few)])
    far = np.abs(found - alone) > _INTERPOLATED * 0.1 * tolerance * np.maximum(alone, 1e-300)
    near = ~far.any(axis=1)
    longest = float(decades[int(np.argmax(near))] if near.any() else decades[-1])
    for per_decade in _WAVES_PER_DECADE:
        q = lattice(longest, _SHORT / thinnest, per_decade)
        between = np.asarray(np.sqrt(q[1:] * q[:-1]), dtype=np.float64)
        expected = known(between)
        off = np.abs(CubicSpline(np.log(q), known(q))(np.log(between)) - expected)
        scale = np.abs(expected)
        scale[:, 0] = np.maximum(scale[:, 0], scale[:, 1] if few.size else 1e-300)  # zero of long waves on a rigid base
        if np.all(off <= _INTERPOLATED * tolerance * scale):
            break
    return q, between
