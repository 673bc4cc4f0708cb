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
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
import scipy  # which imports a submodule when it is first used
from numpy.typing import ArrayLike, NDArray

from roughvisc.mechanics.body import HALF_SPACE, Body, Kernel, cell_mean, check_one_body, corner_sum
from roughvisc.mechanics.materials.material import Material, Prony
from roughvisc.mechanics.materials.series import lattice, nonnegative, over_frequencies
from roughvisc.units import Quantity, format_quantity, number, quantities

Array = NDArray[np.float64]

# Matrices of more waves than this are computed in parts: they take many times the memory of the waves.
_WAVES_TOGETHER = 1 << 16
# Wave number times the thickness of the thinnest layer from which on a wave depends on the top layer alone, to 1e-11.
# Number of decades of the wave number times the whole thickness, below one, searched for waves that depend on the
# half-space alone.
_SHORT = 15.0
_DECADES = 9
# Numbers of waves per decade at which a series is computed: the first whose interpolant is accurate enough is used.
# Error of the interpolant, as a fraction of the tolerance.
_WAVES_PER_DECADE = (10, 14, 20, 30, 45)
_INTERPOLATED = 0.2
# Compliances of waves below this part of the largest one are compared with that part: on a base that is almost rigid
# the compliance of long waves is rounding. In free space the images fit compliances below the second part with the
# error of that part. Relative to smaller compliances the fit loses all digits.
_STIFF = 1e-9
_FAR = 1e-6
# Retardation times per decade to try in a fit, and factor by which their range exceeds the range of ages.
_OFFERED = (0, 1, 1.5, 2, 3, 4, 5, 6, 8, 10, 12, 14, 17, 20, 24, 28, 34, 40, 48, 57, 68)
_BEYOND = 10.0
# Depths of images per decade, from this part of the thinnest layer's thickness on. The response of elastic layers is
# right to 1e-5 for moduli up to 1,000 apart and to 1e-4 for moduli up to 100,000 apart (measured).
_IMAGES_PER_DECADE = 14
_SHALLOWEST = 0.8
# Distance from the loaded cell, in cell sides, up to which its displacement is computed in closed form. Number of
# Gauss points a side used beyond this distance.
_NEAR_CELLS = 12.0
_GAUSS_POINTS = 4


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
        halves = (np.array_split(np.broadcast_to(factor, shape), 2) for factor in (q, *shear_compliances))
        parts = zip(*halves, strict=True)
        return np.concatenate([effective_compliance(waves, thicknesses, poissons, rest) for waves, *rest in parts])
    layers = [np.asarray(compliance)[..., None, None] for compliance in shear_compliances]
    down, down_stress, _, _ = _partial_waves(poissons[-1])
    # displacements over tractions, the tractions over 2 q
    below = layers[-1] * (down @ np.linalg.inv(down_stress))
    for h, poisson, compliance in zip(thicknesses[::-1], poissons[-2::-1], layers[-2::-1], strict=True):
        down, down_stress, up, up_stress = _partial_waves(poisson)
        reflected = _inverse(compliance * up - below @ up_stress) @ (below @ down_stress - compliance * down)
        x = (q * h)[..., None, None]
        there = np.exp(-x) * (np.eye(2) + x * np.eye(2, k=1))
        back = there * np.array([[1, -1], [1, 1]])
        returned = back @ reflected @ there
        below = compliance * ((down + up @ returned) @ _inverse(down_stress + up_stress @ returned))
    return np.asarray(np.broadcast_to(-below[..., 1, 1] / 4, shape))


def _partial_waves(poisson: float) -> tuple[Array, Array, Array, Array]:
    """Return displacement ``(U, W)`` and traction over ``2 q`` of unit waves: decaying ones, then growing ones."""
    k = 3 - 4 * poisson
    b = 1 - 2 * poisson
    c = 2 - 2 * poisson
    down = np.array([[1, 0], [1, k]])
    down_stress = -np.array([[1, b], [1, c]])
    turned = np.array([[1, -1], [-1, 1]])
    return down, down_stress, down * turned, -down_stress * turned


def _inverse(matrix: NDArray[Any]) -> NDArray[Any]:
    """Return inverses of matrices of two by two."""
    (a, b), (c, d) = np.moveaxis(matrix, (-2, -1), (0, 1))
    adjugate = np.moveaxis(np.array([[d, -b], [-c, a]]), (0, 1), (-2, -1))
    return np.asarray(adjugate / (a * d - b * c)[..., None, None])


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
        return HALF_SPACE.transfer(qx, qy) * interpolated(np.hypot(qx, qy), self.q, self.compliance)

    def influence(self, shape: tuple[int, int], spacing: tuple[float, float]) -> Array:
        """Return Love's kernel and the images, for cells of any length. [m]"""
        shallowest = _SHALLOWEST * _SHORT / self.q[-1]
        deepest = 1 / self.q[0]
        depths = np.geomspace(shallowest, deepest, math.ceil(_IMAGES_PER_DECADE * math.log10(deepest / shallowest)))
        q = np.geomspace(self.q[0], self.q[-1], 3 * depths.size)
        short = self.compliance[-1]
        # the last equation is the limit of long waves
        scale = np.append(np.interp(np.log(q), np.log(self.q), self.scale), self.scale[0])
        wanted = (np.append(interpolated(q, self.q, self.compliance), self.compliance[0]) - short) / scale
        rows = np.vstack([np.exp(-np.outer(q, depths)), np.ones(depths.size)]) / scale[:, None]
        weights = np.linalg.lstsq(rows, wanted, rcond=1e-13)[0]
        return short * HALF_SPACE.influence(shape, spacing) + image_influence(shape, spacing, depths, weights)


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
    dx, dy = spacing
    unit = float(depths[0])
    x, y = np.broadcast_arrays(dx * np.arange(shape[0])[:, None], dy * np.arange(shape[1]))
    farthest = math.hypot(shape[0] * dx, shape[1] * dy)
    radii = unit * np.geomspace(1, 1 + farthest / unit, math.ceil(400 * math.log10(1 + farthest / unit)) + 8) - unit
    total = (weights / np.sqrt(radii[:, None] ** 2 + depths**2)).sum(axis=1) / math.pi
    along = scipy.interpolate.CubicSpline(np.log1p(radii / unit), total)
    influence = cell_mean(lambda r: along(np.log1p(r / unit)), x, y, spacing, (_GAUSS_POINTS, _GAUSS_POINTS)) * (
        dx * dy
    )
    near = np.hypot(x, y) <= _NEAR_CELLS * max(spacing)
    images = zip(depths, weights, strict=True)
    influence[near] = sum(weight / math.pi * corner_sum(x[near], y[near], dx, dy, depth) for depth, weight in images)
    return influence


def interpolated(q: Array, known: ArrayLike, values: ArrayLike) -> Array:
    """Return values of waves, interpolated in the logarithm of the wave number along the last axis.

    Parameters
    ----------
    q : ndarray
        Wave numbers. Longer and shorter waves than the known ones have the values of the first and of the last. [1/m]
    known : array_like, shape (n,)
        Wave numbers, ascending, of the values. [1/m]
    values : array_like, shape (..., n)
        Any values.
    """
    known = np.asarray(known)
    spline = scipy.interpolate.CubicSpline(np.log(known), values, axis=-1)
    return np.asarray(spline(np.log(np.clip(q, known[0], known[-1]))))


@dataclass(frozen=True, eq=False)
class LayerSeries:
    """Effective contact compliance of the waves of a layered body: exponentials with the same times for all waves.

    Attributes
    ----------
    q : ndarray, shape (n,)
        Wave numbers, ascending; longer and shorter waves have the compliance of the first and of the last. [1/m]
    times : tuple of float
        ``tau_m``; infinite for a fluidity, which is the last one. [s]
    compliances : ndarray, shape (m + 1, n)
        ``C_m`` [1/Pa], or the fluidity [1/(Pa s)], of each time, and last the instantaneous compliance. [1/Pa]
    duration : float
        Longest age. [s]
    error : float
        Largest relative error from the shortest age to the longest, measured at these waves and between them.
    """

    q: Array
    times: tuple[float, ...]
    compliances: Array
    duration: float
    error: float

    def kernel(self, weights: Array) -> LayerKernel:
        """Return the kernel of the weighted sum of the terms, of which the instantaneous compliance is the last."""
        scale = crept(self.times, self.duration) @ self.compliances
        if not weights[:-1].any():  # the instantaneous compliance may be far below the final one, or vanish
            scale = np.maximum(self.compliances[-1], _FAR * (scale if self.times else scale.max()))
        scale = np.maximum(scale, _FAR * scale.max()) if scale.any() else np.ones_like(scale)
        return LayerKernel(tuple(self.q), tuple(weights @ self.compliances), tuple(scale))

    def fastest_wave(self, longest: float, shortest: float) -> Prony:
        """Return the series of the wave that creeps most, relative to its instantaneous compliance.

        Parameters
        ----------
        longest, shortest : float
            Limits of the wave numbers. [1/m]
        """
        terms = interpolated(np.geomspace(longest, shortest, 50), self.q, self.compliances)
        final = crept(self.times, self.duration)[:-1] @ terms[:-1]
        wave = int(np.argmax(final / np.maximum(terms[-1], 1e-12 * final)))
        # contact compliances are a quarter of the shear's at nu = 1/2
        *own, at_once = (4.0 * np.maximum(terms[:, wave], 0.0)).tolist()
        fluidity = max(own.pop(), 1e-300) if math.inf in self.times else 0.0
        return Prony(at_once, fluidity, tuple(own), self.times[: len(own)])


def crept(times: ArrayLike, t: ArrayLike) -> Array:
    """Return the weights of the terms of a series at some ages, shape ``(..., m + 1)``.

    These are ``1 - exp(-t / tau_m)``, the age ``t`` itself for an infinite time, and last one.
    """
    age = np.asarray(t, dtype=float)[..., None]
    tau = np.append(times, 1.0)
    weights = np.where(np.isinf(tau), age, -np.expm1(-age / tau))
    weights[..., -1] = 1.0
    return weights


@lru_cache(maxsize=8)
def layer_series(body: LayeredBody, shortest: float, duration: float, tolerance: float) -> LayerSeries:
    """Return the series of the waves of a layered body, whose materials are series.

    Parameters
    ----------
    body : LayeredBody
        The body; its kernel is not used.
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
    t = lattice(shortest, duration, 8) if duration > 0 else np.zeros(0)
    q, between, error = _known_waves(body, t, tolerance)
    at_once = body.at_once(q)
    best = LayerSeries(q, (), at_once[None], duration, error if duration == 0 else math.inf)
    exact = body.creep(q, t)
    expected = body.creep(between, t)
    first = shortest / _BEYOND
    last = duration * _BEYOND
    if duration == 0:
        return best
    for per_decade in _OFFERED:
        times = body.times(first, last, per_decade)
        if last in times or any(material.fluidity > 0 for material in body.materials):
            times = np.append(times, math.inf)
        terms = crept(times, t)[:, :-1]
        weights = np.array([nonnegative(terms, row - zero, row) for zero, row in zip(at_once, exact, strict=True)])
        used = (weights[:, None] * terms / exact[..., None]).max(axis=(0, 1)) > 1e-9
        fitted = replace(best, times=tuple(times[used]), compliances=np.vstack([weights[:, used].T, at_once]))
        course = crept(fitted.times, t)
        of_waves = (fitted.compliances, exact), (interpolated(between, q, fitted.compliances), expected)
        error = max(
            float(
                (np.abs((course @ compliances).T / known - 1) * np.minimum(known / (_STIFF * known.max()), 1.0)).max()
            )
            for compliances, known in of_waves
        )
        best = replace(fitted, error=error) if error < best.error else best
        if error <= tolerance:
            break
    return best


def _known_waves(body: LayeredBody, t: Array, tolerance: float) -> tuple[Array, Array, float]:
    """Return wave numbers to interpolate between, others between them [1/m], and the error of the interpolant."""
    whole = sum(body.thicknesses)
    thinnest = min(body.thicknesses)
    few = t[:: max(t.size // 4, 1)]

    def known(q: NDArray[Any]) -> Array:
        return np.vstack([body.at_once(q), body.creep(q, few).T])

    decades = 10.0 ** -np.arange(1, _DECADES + 1) / whole
    alone = body.materials[-1].contact_compliance(np.append(0.0, few))
    is_near = (np.abs(known(decades).T - alone) <= 0.1 * _INTERPOLATED * tolerance * alone).all(axis=1)
    longest = decades[np.argmax(np.append(is_near[:-1], True))]
    for per_decade in _WAVES_PER_DECADE:
        q = lattice(longest, _SHORT / thinnest, per_decade)
        between = np.asarray(np.sqrt(q[1:] * q[:-1]), dtype=np.float64)
        expected = known(between)
        scale = np.maximum(np.abs(expected), _STIFF * expected.max(axis=1, keepdims=True) + 1e-300)
        scale[0] = scale[:2].max(axis=0)  # next to zero: of long waves on a rigid base
        error = float((np.abs(interpolated(between, q, known(q)) - expected) / scale).max())
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
    def materials(self) -> tuple[Any, ...]:
        """Materials from the top."""
        return (self.material, *self.below)

    @property
    def poissons(self) -> tuple[float, ...]:
        """Poisson's ratios from the top."""
        return tuple(material.poisson for material in self.materials)

    @property
    def separates(self) -> bool:
        """Whether space and time separate: the compliances of all materials have the same ratios at all times."""
        if not all(
            isinstance(material, Prony) and material.times == self.materials[0].times for material in self.materials
        ):
            return all(material == self.material for material in self.below)
        terms = np.array([[material.glassy, material.fluidity, *material.compliances] for material in self.materials])
        shares = terms / terms.sum(axis=1, keepdims=True)
        return bool(np.all(np.abs(shares - shares[0]) <= 1e-12 * shares[0].max()))  # up to rounding

    def of(self, materials: Iterable[Material]) -> LayeredBody:
        """Return the body with other materials, from the top."""
        top, *below = materials
        return replace(self, material=top, below=tuple(below))

    def over_frequencies(self, frequency: ArrayLike, tolerance: float) -> LayeredBody:
        """Return the body with materials that represent its own at some frequencies. [1/s]"""
        return self.of(over_frequencies(material, frequency, tolerance) for material in self.materials)

    def waves(self, qx: Array, qy: Array, frequency: Array) -> tuple[Array, NDArray[np.complex128]]:
        """Return the kernel of a half-space [m], and the effective contact compliance of each wave. [1/Pa]"""
        q = np.hypot(qx, qy)
        with np.errstate(divide="ignore", invalid="ignore"):  # at zero frequency
            shear = np.array([material.laplace(1j * frequency) for material in self.materials])
        flows = ~np.isfinite(shear).all(axis=0)
        shear[:, flows] = 1.0
        compliance = effective_compliance(np.where(q > 0, q, 1.0), self.thicknesses, self.poissons, list(shear))
        return HALF_SPACE.transfer(qx, qy), np.where(flows, complex(math.inf, 0.0), compliance)

    def at_once(self, q: Array) -> Array:
        """Return the instantaneous effective contact compliance of waves. [1/Pa]"""
        shear = [material.glassy for material in self.materials]
        count = shear.index(0) if 0 in shear else len(self.thicknesses)  # nothing below a rigid material moves
        return effective_compliance(q, self.thicknesses[:count], self.poissons[: count + 1], shear[: count + 1])

    def creep(self, q: Array, t: Array) -> Array:
        """Return the effective contact compliance of waves after some times, shape ``(waves, times)``. [1/Pa]

        Notes
        -----
        The inverse Laplace transform on Talbot's contour with the parameters of [1]_.

        References
        ----------
        .. [1] J. A. C. Weideman, SIAM J. Numer. Anal. 44 (2006) 2342.
        """
        count = 24  # nodes on both sides of the real axis: 5e-10 (measured)
        angle = np.arange(1, count, 2) * math.pi / count
        cotangent = 1 / np.tan(0.6407 * angle)
        sine = np.sin(0.6407 * angle)
        z = count * (-0.4814 + 0.6122 * angle * cotangent + 0.2645j * angle)
        slope = 0.6122 * cotangent - 0.6122 * 0.6407 * angle / sine**2 + 0.2645j
        weights = 2 * np.exp(z) * slope / z
        shear = [material.laplace(z / t[:, None]) for material in self.materials]
        compliance = effective_compliance(q[:, None, None], self.thicknesses, self.poissons, shear)
        return np.asarray((compliance @ weights).imag)

    def times(self, shortest: float, longest: float, per_decade: float) -> Array:
        """Return possible retardation times of waves: the times of the materials, and a number per decade between.

        If the moduli of all materials have the same sign at the complex frequency ``-1/tau``, no wave has the time
        ``tau``. The limits represent all times beyond them.
        """
        place = lattice(shortest, longest, 100)
        with np.errstate(divide="ignore"):  # at a retardation time of the material
            signs = np.sign([material.laplace(-1 / place) for material in self.materials])
        apart = scipy.ndimage.binary_dilation((signs != signs[0]).any(axis=0))
        offered = {min(max(time, shortest), longest) for material in self.materials for time in material.times}
        for (stretch,) in scipy.ndimage.find_objects(scipy.ndimage.label(apart)[0]):
            first, *_, end = place[stretch]
            offered.update(lattice(first, end, per_decade).tolist())
        return np.array(sorted(offered))

    def facts(self, end: float) -> dict[str, Any]:
        """Return the compliances of the top layer [1/Pa], and the body in words."""
        return super().facts(end) | {"body": repr(self)}


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

    See Also
    --------
    roughvisc.sheet, roughvisc.Body

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
    is_known = isinstance(on, LayeredBody) or (isinstance(on, Body) and on.kernel == HALF_SPACE)
    below: tuple[Any, ...] = on.materials if is_known else (on,)
    check_one_body("material", material)
    check_one_body("on", below[0])
    if thickness == math.inf:
        return Body(material)
    thicknesses = (number(thickness, "m", "thickness", above=0), *getattr(on, "thicknesses", ()))
    body = LayeredBody(material, below=below, thicknesses=thicknesses)
    # the kernel is of one age, at which all compliances are known, positive and finite, per unit of the top
    age = min([1.0, *(material.longest for material in body.materials if isinstance(material, Prony))])
    shear = [float(material.contact_compliance(age)) * 2 / (1 - material.poisson) for material in body.materials]
    unit = 0.5 * (1 - material.poisson) * shear[0]
    elastic = body.of(Prony(compliance / unit, poisson=nu) for compliance, nu in zip(shear, body.poissons, strict=True))
    return replace(body, kernel=layer_series(elastic, 0.0, 0.0, 1e-6).kernel(np.ones(1)))
