r"""Layers on a half-space: a coating, a rubber on a polymer, skin on tissue.

Each wave of pressure is a problem of plane strain. It is displaced by :math:`2 C(q) / |q|` times the pressure, with an
effective contact compliance ``C(q)``. If the materials creep, each wave has its own creep compliance, a positive
sum of exponentials. All waves share the times, so that each exponential is one kernel:

.. math:: C(q, t) = C_0(q) + \varphi(q) t + \sum_m C_m(q) (1 - e^{-t/\tau_m}).

Elastic layers are this series without terms. Space and time separate if the compliances of all materials are in
proportion.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.body import HALF_SPACE, Body, Kernel
from roughvisc.mechanics.half_space import corner_sum, love_kernel
from roughvisc.mechanics.materials.creep import Material, check_material
from roughvisc.mechanics.materials.prony import Prony
from roughvisc.mechanics.materials.series import (
    complex_compliance,
    laplace_compliance,
    lattice,
    nonnegative,
    over_frequencies,
)
from roughvisc.mechanics.quadrature import cell_mean
from roughvisc.units import Quantity, format_quantity, quantities

Array = NDArray[np.float64]

# Matrices of more waves than this are computed in parts: they take many times the memory of the waves.
_WAVES_TOGETHER = 1 << 16
# Wave number times the thickness of the thinnest layer from which on a wave depends on the top layer alone, to 1e-11.
# Number of decades of the wave number times the whole thickness, below one, searched for waves that depend on the
# half-space alone.
_SHORT, _DECADES = 15.0, 9
# Numbers of waves per decade at which a series is computed: the first whose interpolant is accurate enough is used. And
# error of the interpolant, as a part of the tolerance.
_WAVES_PER_DECADE, _INTERPOLATED = (10, 14, 20, 30, 45), 0.2
# Relative error of the interpolant of elastic layers.
_ELASTIC = 1e-6
# Nodes of the inverse Laplace transform on one side of the real axis: 5e-10 (measured).
_NODES = 12
# Ages per decade at which the compliance is fitted.
_AGES_PER_DECADE = 8
# Retardation times per decade to try in a fit, and factor by which their range exceeds the range of ages.
_OFFERED, _BEYOND = (0, 1, 1.5, 2, 3, 4, 5, 6, 8, 10, 12, 14, 17, 20, 24, 28, 34, 40, 48, 57, 68), 10.0
# Times per decade at which the signs of moduli are compared.
_SIGNS = 100
# Terms whose part of the compliance is below this at all ages are left out.
_UNSEEN = 1e-9
# Depths of images per decade, from this part of the thinnest layer's thickness on. The response of elastic layers is
# right to 1e-5 for moduli up to 1,000 apart and to 1e-4 for moduli up to 100,000 apart (measured).
_IMAGES_PER_DECADE, _SHALLOWEST = 14, 0.8
# Instantaneous compliances below this part of the final one need not be relatively accurate.
_LEAST = 1e-6
# Distance from the loaded cell, in cell sides, up to which its displacement is computed in closed form. Number of
# Gauss points a side used beyond this distance.
_NEAR_CELLS, _GAUSS_POINTS = 12.0, 4
# Distances per decade at which images are added up.
_DISTANCES = 400
# Ages at which compliances are compared, the first at which all are known and none is zero or infinite. [s]
_AGES = (math.inf, 0.0, 1.0, 1e-3, 1e-6)
# Largest relative difference of compliances that are in proportion.
_ROUNDING = 1e-12


# ------------------------------------------------------------------------------------------------------------- waves


def effective_compliance(
    q: ArrayLike, thicknesses: Sequence[float], poissons: Sequence[float], shear_compliances: Sequence[ArrayLike]
) -> NDArray[Any]:
    r"""Return the contact compliance of a half-space with the same response to a wave of pressure as a layered body.

    Parameters
    ----------
    q : array_like
        Wave numbers, positive. [1/m]
    thicknesses : sequence of float
        Thicknesses of the layers, from the top. [m]
    poissons : sequence of float
        Poisson's ratios of the layers and of the half-space below them.
    shear_compliances : sequence of array_like
        Shear compliances of the layers and of the half-space: real, or complex if pressure oscillates. They broadcast
        with the wave numbers. [1/Pa]

    Returns
    -------
    ndarray
        ``C(q)``: the displacement is :math:`2 C(q) / |q|` times the pressure. [1/Pa]

    Notes
    -----
    In a layer of shear modulus ``G`` the field of a wave is a sum of two terms that decay with the depth ``z`` and two
    that grow. With ``s = q z`` and ``k = 3 - 4 nu`` the decaying terms are

    .. math::
        \begin{aligned}
        U &= (A + B s) e^{-s}, & W &= (A + B (k + s)) e^{-s}, \\
        \sigma_{zz} &= -2 G q (A + B (2 - 2\nu + s)) e^{-s}, & \sigma_{xz} &= -2 G q (A + B (1 - 2\nu + s)) e^{-s}
        \end{aligned}

    The growing terms are the same with the other sign of ``s``, of ``W`` and of the shear stress. The material below
    reflects the decaying terms into the growing ones, which return to the top reduced by :math:`e^{-2 q h}`. The
    computation contains decaying exponentials only and is stable for any thickness.

    References
    ----------
    .. [1] K. L. Johnson, *Contact Mechanics*, CUP, 1985, section 5.8.
    """
    q = np.asarray(q, dtype=float)
    shape = np.broadcast_shapes(q.shape, *(np.shape(compliance) for compliance in shear_compliances))
    if math.prod(shape) > _WAVES_TOGETHER and shape[0] > 1:
        halves = (np.array_split(np.broadcast_to(one, shape), 2) for one in (q, *shear_compliances))
        parts = zip(*halves, strict=True)
        return np.concatenate([effective_compliance(one, thicknesses, poissons, rest) for one, *rest in parts])
    layers = [np.asarray(compliance)[..., None, None] for compliance in shear_compliances]
    down, down_stress, _, _ = _partial_waves(poissons[-1])
    # displacements over tractions, the tractions over 2 q
    below = layers[-1] * (down @ np.linalg.inv(down_stress))
    for h, poisson, compliance in zip(thicknesses[::-1], poissons[-2::-1], layers[-2::-1], strict=True):
        down, down_stress, up, up_stress = _partial_waves(poisson)
        reflected = _inverse(compliance * up - below @ up_stress) @ (below @ down_stress - compliance * down)
        x = q * h
        way = np.zeros((*x.shape, 2, 2))
        way[..., 0, 0] = way[..., 1, 1] = np.exp(-x)
        way[..., 0, 1] = x * np.exp(-x)
        there, back = way, way * np.array([[1, -1], [1, 1]])
        returned = back @ reflected @ there
        below = compliance * ((down + up @ returned) @ _inverse(down_stress + up_stress @ returned))
    return np.asarray(np.broadcast_to(-below[..., 1, 1] / 4, shape))


def _partial_waves(poisson: float) -> tuple[Array, Array, Array, Array]:
    """Return displacement ``(U, W)`` and traction over ``2 q`` of unit waves: decaying ones, then growing ones."""
    k, b, c = 3 - 4 * poisson, 1 - 2 * poisson, 2 - 2 * poisson
    down, down_stress = np.array([[1, 0], [1, k]]), -np.array([[1, b], [1, c]])
    turned = np.array([[1, -1], [-1, 1]])
    return down, down_stress, down * turned, -down_stress * turned


def _inverse(matrix: NDArray[Any]) -> NDArray[Any]:
    """Return inverses of matrices of two by two."""
    (a, b), (c, d) = np.moveaxis(matrix, (-2, -1), (0, 1))
    adjugate = np.moveaxis(np.array([[d, -b], [-c, a]]), (0, 1), (-2, -1))
    return np.asarray(adjugate / (a * d - b * c)[..., None, None])


@dataclass(frozen=True)
class Layers:
    """Layers on a half-space, whose materials are exponential series.

    Attributes
    ----------
    thicknesses : tuple of float
        Thicknesses of the layers, from the top. [m]
    materials : tuple of Prony
        Materials of the layers and of the half-space.
    """

    thicknesses: tuple[float, ...]
    materials: tuple[Prony, ...]

    @property
    def poissons(self) -> tuple[float, ...]:
        """Poisson's ratios."""
        return tuple(one.poisson for one in self.materials)

    def at_once(self, q: Array) -> Array:
        """Return the instantaneous effective contact compliance of waves. [1/Pa]"""
        shear = [one.glassy for one in self.materials]
        rigid = shear.index(0.0) if 0.0 in shear else len(shear) - 1  # layers below a rigid one have no influence
        if rigid == 0:
            return 0 * q
        thicknesses, poissons = self.thicknesses[:rigid], self.poissons[: rigid + 1]
        return np.asarray(effective_compliance(q, thicknesses, poissons, shear[: rigid + 1]))

    def creep(self, q: Array, t: Array) -> Array:
        """Return the effective contact compliance of waves after some times, shape ``(waves, times)``. [1/Pa]

        Notes
        -----
        The inverse Laplace transform on Talbot's contour with the parameters of [1]_.

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
        """Return possible retardation times of waves: the times of the materials, and a number per decade between.

        If the moduli of all materials have the same sign at the complex frequency ``-1/tau``, no wave has the time
        ``tau``. The limits represent all times beyond them.
        """
        place = lattice(shortest, longest, _SIGNS)
        with np.errstate(divide="ignore"):  # at a retardation time of the material
            signs = np.sign([laplace_compliance(one, -1 / place) for one in self.materials])
        apart = (signs != signs[0]).any(axis=0)
        apart[1:] |= apart[:-1].copy()
        apart[:-1] |= apart[1:].copy()
        found = {min(max(time, shortest), longest) for one in self.materials for time in one.times}
        ends = np.flatnonzero(np.diff(np.concatenate([[False], apart, [False]]).astype(int)))
        for first, end in zip(place[ends[::2]], place[ends[1::2] - 1], strict=True):
            found |= {float(first), float(end)} if per_decade == 0 else set(lattice(first, end, per_decade).tolist())
        return np.array(sorted(found))


# ------------------------------------------------------------------------------------------------- kernels and series


@dataclass(frozen=True)
class LayerKernel(Kernel):
    r"""Kernel of a layered body: :math:`2 C(q) / |q|`.

    Parameters
    ----------
    q : tuple of float
        Wave numbers, ascending. Longer and shorter waves have the compliance of the first and of the last. [1/m]
    compliance : tuple of float
        Effective compliance of these waves; not negative.
    scale : tuple of float
        Compliance that errors are relative to, in free space.

    Notes
    -----
    In free space the kernel is Love's with the compliance of short waves, and a sum of images :math:`w_j / (\pi
    \sqrt{r^2 + b_j^2})` averaged over the loaded cell. An image contributes :math:`w_j e^{-q b_j}` to the
    compliance of a wave. The weights are linear in the compliance. Their sum gives the compliance of long waves, so
    that the far field is the field of the half-space.
    """

    q: tuple[float, ...]
    compliance: tuple[float, ...]
    scale: tuple[float, ...]

    def transfer(self, qx: ArrayLike, qy: ArrayLike) -> Array:
        """Return ``2 C(|q|) / |q|``; zero at ``q = 0``, as for a half-space. [m]"""
        q = np.asarray(np.hypot(qx, qy), dtype=float)
        acts = q > 0
        q = np.where(acts, q, 1.0)
        return np.where(acts, 2 / q * self._along(np.log(np.clip(q, self.q[0], self.q[-1]))), 0.0)

    def influence(self, shape: tuple[int, int], spacing: tuple[float, float]) -> Array:
        """Return Love's kernel and the images, for cells of any length. [m]"""
        shallowest, deepest = _SHALLOWEST * _SHORT / self.q[-1], 1 / self.q[0]
        depths = np.geomspace(shallowest, deepest, math.ceil(_IMAGES_PER_DECADE * math.log10(deepest / shallowest)))
        q, short = np.geomspace(self.q[0], self.q[-1], 3 * depths.size), self.compliance[-1]
        # the last equation is the limit of long waves
        scale = np.append(np.interp(np.log(q), np.log(self.q), self.scale), self.scale[0])
        wanted = (np.append(self._along(np.log(q)), self.compliance[0]) - short) / scale
        rows = np.vstack([np.exp(-np.outer(q, depths)), np.ones(depths.size)]) / scale[:, None]
        weights = np.linalg.lstsq(rows, wanted, rcond=1e-13)[0]
        return short * love_kernel(shape, spacing) + image_influence(shape, spacing, depths, weights)

    @cached_property
    def _along(self) -> Any:
        from scipy.interpolate import CubicSpline  # slow to import

        return CubicSpline(np.log(self.q), self.compliance)


def image_influence(shape: tuple[int, int], spacing: tuple[float, float], depths: Array, weights: Array) -> Array:
    r"""Return the displacement of cells due to the images of a cell under unit pressure.

    Parameters
    ----------
    shape, spacing : tuple
        Numbers of cells, counted from the one at the origin, and their sides. [m]
    depths, weights : ndarray, shape (n,)
        Images :math:`w_j / (\pi \sqrt{r^2 + b_j^2})`. [m], [-]

    Returns
    -------
    ndarray, shape (nx, ny)
        Averages over the loaded cell: near it in closed form, beyond by Gauss quadrature. [m]
    """
    from scipy.interpolate import CubicSpline  # slow to import

    (dx, dy), unit = spacing, float(depths[0])
    x, y = dx * np.arange(shape[0])[:, None], dy * np.arange(shape[1])[None, :]
    near = np.hypot(x, y) <= _NEAR_CELLS * max(spacing)
    rows, columns = np.nonzero(near)
    found = np.zeros(shape)
    for depth, weight in zip(depths, weights, strict=True):
        found[near] += weight / math.pi * corner_sum(x[rows, 0], y[0, columns], dx, dy, depth)
    if near.all():
        return found
    farthest = math.hypot(shape[0] * dx, shape[1] * dy)
    at = unit * np.geomspace(1, 1 + farthest / unit, math.ceil(_DISTANCES * math.log10(1 + farthest / unit)) + 8) - unit
    along = CubicSpline(np.log1p(at / unit), (weights / np.sqrt(at[:, None] ** 2 + depths**2)).sum(axis=1) / math.pi)
    mean = cell_mean(lambda r: along(np.log1p(r / unit)), x, y, spacing, (_GAUSS_POINTS, _GAUSS_POINTS))
    return np.where(near, found, mean * (dx * dy))


@dataclass(frozen=True, eq=False)
class LayerSeries:
    """Effective contact compliance of the waves of a layered body: exponentials with the same times for all waves.

    Attributes
    ----------
    q : ndarray, shape (n,)
        Wave numbers, ascending; longer and shorter waves have the compliance of the first and of the last. [1/m]
    times : tuple of float
        ``tau_m``. [s]
    at_once : ndarray, shape (n,)
        ``C_0``. [1/Pa]
    compliances : ndarray, shape (m, n)
        ``C_m`` [1/Pa], and last the fluidity, if there is one [1/(Pa s)].
    flows : bool
        Whether there is a fluidity.
    duration : float
        Longest age. [s]
    error : float
        Largest relative error from the shortest age to the longest, measured at these waves and between them.
    """

    q: Array
    times: tuple[float, ...]
    at_once: Array
    compliances: Array
    flows: bool
    duration: float
    error: float

    def kernel(self, weights: ArrayLike = (), at_once: float = 1.0) -> LayerKernel:
        """Return the kernel of ``C_0`` times a number plus the weighted sum of the terms. Default: without terms."""
        weights = np.asarray(weights, dtype=float)
        final = self.at_once + self.crept(self.duration) @ self.compliances
        if not weights.any():
            compliance, scale = at_once * self.at_once, np.maximum(self.at_once, _LEAST * final)
        else:
            compliance, scale = at_once * self.at_once + weights @ self.compliances, final
        scale = scale if scale.any() else np.ones_like(scale)
        return LayerKernel(tuple(self.q.tolist()), tuple(compliance.tolist()), tuple(scale.tolist()))

    def fastest_wave(self, longest: float, shortest: float) -> Prony:
        """Return the series of the wave that creeps most, relative to its instantaneous compliance.

        Parameters
        ----------
        longest, shortest : float
            Limits of the wave numbers. [1/m]
        """
        q = np.clip(np.geomspace(longest, shortest, 50), self.q[0], self.q[-1])
        at_once, terms = self._interpolant(np.log(q))[0], self._interpolant(np.log(q))[1:]
        crept = self.crept(self.duration) @ terms
        wave = int(np.argmax(crept / np.maximum(at_once, 1e-12 * crept)))
        own = np.maximum(terms[:, wave], 0.0) * 4.0  # contact compliances are a quarter of the shear's at nu = 1/2
        fluidity = max(float(own[-1]), 1e-300) if self.flows else 0.0
        return Prony(4.0 * float(at_once[wave]), fluidity, tuple(own[: len(self.times)].tolist()), self.times)

    def crept(self, t: float) -> Array:
        """Return ``1 - exp(-t / tau_m)`` for each term, and the time itself for a fluidity. [s]"""
        retarded = -np.expm1(-t / np.array(self.times)) if self.times else np.zeros(0)
        return np.append(retarded, t) if self.flows else retarded

    @cached_property
    def _interpolant(self) -> Any:
        from scipy.interpolate import CubicSpline  # slow to import

        return CubicSpline(np.log(self.q), np.vstack([self.at_once, self.compliances]), axis=1)


@lru_cache(maxsize=8)
def layer_series(layers: Layers, shortest: float, duration: float, tolerance: float) -> LayerSeries:
    """Return the series of the waves of a layered body.

    Parameters
    ----------
    layers : Layers
        Thicknesses and materials.
    shortest, duration : float
        Ages between which the compliance is needed, besides zero; without a duration the series has no terms. [s]
    tolerance : float
        Relative error. The error of the series may be larger; it is an attribute of the series.

    Notes
    -----
    A non-negative least-squares fit in time at some waves. Between them the compliances are interpolated in the
    logarithm of the wave number. The interpolant is linear in the compliances, so that the sum of the terms is as
    accurate as the compliances themselves.
    """
    t = lattice(shortest, duration, _AGES_PER_DECADE) if duration > 0 else np.zeros(0)
    q, between, error = _known_waves(layers, t, tolerance)
    at_once = layers.at_once(q)
    if not t.size:
        return LayerSeries(q, (), at_once, np.zeros((0, q.size)), False, 0.0, error)
    exact, expected = layers.creep(q, t), layers.creep(between, t)
    first, last = shortest / _BEYOND, duration * _BEYOND
    flows = any(one.fluidity > 0 for one in layers.materials)
    best: LayerSeries | None = None
    for per_decade in _OFFERED:
        times = layers.times(first, last, per_decade)
        columns = -np.expm1(-t[:, None] / times)
        if flows or last in times:
            columns = np.column_stack([columns, t])
        weights = np.zeros((q.size, columns.shape[1]))
        if columns.size:
            pairs = zip(at_once, exact, strict=True)
            weights = np.array([nonnegative(columns, row - instantaneous, row) for instantaneous, row in pairs])
        used = (weights[:, None] * columns / exact[..., None]).max(axis=(0, 1), initial=0.0) > _UNSEEN
        weights, columns = weights[:, used], columns[:, used]
        fluid = used.size > times.size and bool(used[-1])  # the fluidity comes last
        kept = tuple(times[used[: times.size]].tolist())
        found = LayerSeries(q, kept, at_once, np.ascontiguousarray(weights.T), fluid, duration, math.inf)
        there = found._interpolant(np.log(between))
        error = max(
            np.abs((at_once[:, None] + weights @ columns.T) / exact - 1).max(),
            np.abs((there[0][:, None] + there[1:].T @ columns.T) / expected - 1).max(),
        )
        if best is None or error < best.error:
            best = replace(found, error=float(error))
        if error <= tolerance:
            break
    assert best is not None
    return best


def _known_waves(layers: Layers, t: Array, tolerance: float) -> tuple[Array, Array, float]:
    """Return wave numbers to interpolate between, others between them [1/m], and the error of the interpolant."""
    from scipy.interpolate import CubicSpline  # slow to import

    whole, thinnest = sum(layers.thicknesses), min(layers.thicknesses)
    few = t[:: max(t.size // 4, 1)]

    def known(q: NDArray[Any]) -> Array:
        return np.column_stack([layers.at_once(q), layers.creep(q, few)])

    decades = 10.0 ** -np.arange(1, _DECADES + 1) / whole
    found, base = known(decades), layers.materials[-1]
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
        error = float((off / np.maximum(scale, 1e-300)).max())
        if error <= _INTERPOLATED * tolerance:
            break
    return q, between, error


# -------------------------------------------------------------------------------------------------------------- bodies


@dataclass(frozen=True, repr=False)
class LayeredBody(Body):
    """Layers on a half-space, see :func:`layer`; `material` is the material of the top layer.

    Parameters
    ----------
    below : tuple of Material
        Materials of the lower layers and of the half-space, from the top.
    thicknesses : tuple of float
        Thicknesses of the layers, from the top. [m]
    """

    below: tuple[Material, ...] = ()
    thicknesses: tuple[float, ...] = ()

    def __repr__(self) -> str:
        text = repr(self.below[-1])
        for material, h in zip(self.materials[-2::-1], self.thicknesses[::-1], strict=True):
            text = f"layer({material!r}, thickness={format_quantity(h, 'm')}, on={text})"
        return text

    @property
    def materials(self) -> tuple[Material, ...]:
        """Materials from the top."""
        return (self.material, *self.below)

    @property
    def separates(self) -> bool:
        """Whether space and time separate: the compliances of all materials are in proportion."""
        return all(in_proportion(one, self.materials[0]) for one in self.materials)

    def over_frequencies(self, frequency: ArrayLike, tolerance: float) -> LayeredBody:
        """Return the body with materials that represent its own at some frequencies. [1/s]"""
        top, *below = (over_frequencies(one, frequency, tolerance) for one in self.materials)
        return replace(self, material=top, below=tuple(below))

    def waves(self, qx: Array, qy: Array, frequency: Array) -> tuple[Array, NDArray[np.complex128]]:
        """Return the kernel of a half-space [m], and the effective contact compliance of each wave. [1/Pa]"""
        q = np.hypot(qx, qy)
        contact = [complex_compliance(one, frequency) for one in self.materials]
        poissons = [one.poisson for one in self.materials]
        flows = np.any([~np.isfinite(one) for one in contact], axis=0)
        shear = [2 / (1 - poisson) * np.where(flows, 1.0, one) for poisson, one in zip(poissons, contact, strict=True)]
        found = effective_compliance(np.where(q > 0, q, 1.0), self.thicknesses, poissons, shear)
        return HALF_SPACE.transfer(qx, qy), np.where(flows, complex(math.inf, 0.0), found)

    def facts(self, end: float) -> dict[str, Any]:
        """Return the compliances of the top layer [1/Pa], and the body in words."""
        return super().facts(end) | {"kernel": repr(self)}


@quantities(thickness="m")
def layer(material: Material, thickness: Quantity, *, on: Any) -> Body:
    """Return a layer of a material, bonded to a half-space of another one or to another layer.

    Parameters
    ----------
    material : Material
        Material of one body with a Poisson's ratio that is constant in time.
    thickness : float or str
        Thickness of the layer; infinite for a half-space of its material. [m]
    on : Material or Body
        Material of the half-space below, or another layer.

    Returns
    -------
    Body
        A body, which functions accept as `material`.

    Raises
    ------
    InputError
        If the thickness is not positive; if a material describes two bodies, or its Poisson's ratio is negative or
        changes in time; if the layer lies on a sheet or a body of your own.

    Notes
    -----
    The response depends on the wavelength of the pressure, see
    :func:`~roughvisc.mechanics.layer.effective_compliance`: short waves depend on the layer alone, waves much
    longer than its thickness on the material below.

    Examples
    --------
    >>> import roughvisc as rv
    >>> lacquer, rubber = rv.elastic(1e9, poisson=0.35), rv.elastic(1e6)
    >>> coated = rv.layer(lacquer, "20 um", on=rubber)
    >>> ball = rv.sphere(radius=1e-3, size=2e-4, shape=45)
    >>> press = rv.Program().load(1e-4, over=0)
    >>> ds = rv.simulate(ball, coated, press, progress=False)
    >>> bare = rv.simulate(ball, rubber, press, progress=False)
    >>> bool(ds.approach[-1] < bare.approach[-1])
    True
    """
    if not (isinstance(thickness, int | float) and thickness > 0):
        raise InputError(key="thickness", found=thickness, expected="a positive number [m]")
    _check("material", material)
    thicknesses: tuple[float, ...] = (float(thickness),)
    if isinstance(on, LayeredBody):
        below, thicknesses = (on.material, *on.below), (*thicknesses, *on.thicknesses)
    else:
        below = (on.material if isinstance(on, Body) and on.kernel == HALF_SPACE else on,)
        _check("on", below[0])
    if thickness == math.inf:
        return Body(material)
    # the kernel is of the final state, or of an earlier one if it is unknown or infinite, per unit of the top
    materials = (material, *below)
    for age in _AGES:
        with suppress(InputError):  # a table ends earlier
            shear = [float(one.contact_compliance(age)) * 2 / (1 - one.poisson) for one in materials]
            if all(0 < one < math.inf for one in shear):
                break
    unit = 0.5 * (1 - material.poisson) * shear[0]
    elastic = tuple(Prony(one / unit, poisson=of.poisson) for one, of in zip(shear, materials, strict=True))
    kernel = layer_series(Layers(thicknesses, elastic), 0.0, 0.0, _ELASTIC).kernel()
    return LayeredBody(material, kernel, below, thicknesses)


def _check(name: str, material: Any) -> None:
    """Check that an argument is a material of one body with a constant Poisson's ratio of 0 to 1/2."""
    if isinstance(material, Body):
        raise InputError(key=name, found=material, expected="a material" + " or a layer" * (name == "on"))
    amiss = check_material(material).stands_for
    if amiss:
        raise InputError(key=name, found=amiss, expected="one body, Poisson's ratio constant")
    poisson = material.poisson
    if not 0 <= poisson <= 0.5:
        raise InputError(key=name, found=poisson, expected="Poisson's ratio from 0 to 1/2 in a layered body")


def in_proportion(material: Material, other: Material) -> bool:
    """Return whether the compliances of two materials have the same ratio at all times."""
    if not (isinstance(material, Prony) and isinstance(other, Prony)):
        return bool(material == other)
    if material.times != other.times:
        return False
    mine, theirs = (np.array([one.glassy, one.fluidity, *one.compliances]) for one in (material, other))
    ratio = float(mine.sum() / theirs.sum())
    return bool(np.all(np.abs(mine - ratio * theirs) <= _ROUNDING * mine.max()))
