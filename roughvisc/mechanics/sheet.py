"""A sheet on a rigid base: ``K_q = (2 / |q|) S(|q| h)``. For short waves ``S = 1``, as on a half-space.

With a constant Poisson's ratio space and time separate, as in a half-space: ``u = C(t) K * p``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal, get_args

import numpy as np
import scipy  # which imports a submodule when it is first used
from numpy.typing import ArrayLike, NDArray

from roughvisc.arguments import one_of
from roughvisc.mechanics.body import Body, Kernel, cell_mean, check_one_body, love_kernel
from roughvisc.mechanics.materials.creep import Material
from roughvisc.mechanics.quadrature import panels
from roughvisc.units import Quantity, number, quantities

Array = NDArray[np.float64]
Base = Literal["bonded", "slipping"]
#: Default base of a sheet.
BASE: Base = "bonded"
# Distance in thicknesses beyond which the kernel is set to zero: it is below 1e-17 of its value at one thickness.
_REACH = 46.0
# Argument x from which 1 - S(x), which decreases as x^2 exp(-2 x), is below rounding.
_SHORTEST_WAVE = 24.0
# Nodes of the correction per thickness, and degree of the spline through them: error below 1e-14.
_PER_THICKNESS, _DEGREE = 16, 9
# Cell side in thicknesses, and number of Gauss points per side that give the mean of the correction to 1e-13.
_GAUSS = ((0.01, 2), (0.05, 3), (0.15, 4), (0.5, 7))
# Cell side in thicknesses above which cells are long.
_LONG = 0.5
# Below this x, sinh(2 x) - 2 x is computed from its series, with these coefficients.
_SERIES_BELOW, _SERIES = 0.5, 1 / np.cumprod(np.arange(2.0, 27))[1::2]
# Smallest x, below which the transfer function has the value of uniform pressure.
_LONGEST_WAVE = 1e-150


@quantities(thickness="m")
def sheet(material: Material, thickness: Quantity, base: Base = BASE) -> Body:
    """Return a sheet of a material on a rigid base.

    Parameters
    ----------
    material : Material
        Material of one body with a Poisson ratio that is constant in time.
    thickness : float or str
        Thickness; infinite for a half-space. [m]
    base : {"bonded", "slipping"}
        Whether the sheet sticks to its base, or slides on it without friction.

    Returns
    -------
    Body
        A body, which functions accept as `material`.

    Raises
    ------
    InputError
        If the thickness is not positive or the base is unknown; if the material describes two bodies, or its Poisson
        ratio is negative or changes in time: space and time do not separate then.

    Examples
    --------
    >>> import roughvisc as rv
    >>> gel = rv.sheet(rv.zener(3e6, 1e6, 1e5), thickness=1e-4)
    >>> ball = rv.sphere(radius=1e-3, size=2e-4, shape=45)
    >>> ds = rv.simulate(ball, gel, rv.Program().load(1e-4, over=0), progress=False)
    >>> ds.attrs["thickness"], ds.attrs["base"]
    (0.0001, 'bonded')
    """
    check_one_body("material", material)
    endless = thickness == math.inf
    kernel = Sheet(1.0 if endless else thickness, material.poisson, base)  # checks all arguments
    return Body(material) if endless else Body(material, kernel)


@dataclass(frozen=True)
class Sheet(Kernel):
    r"""Kernel of a homogeneous sheet on a rigid base.

    Parameters
    ----------
    thickness : float
        Thickness. [m]
    poisson : float
        Poisson's ratio, from 0 to 1/2. On a slipping base the kernel does not depend on it.
    base : {"bonded", "slipping"}
        Whether the sheet sticks to its base, or slides on it without friction.

    Raises
    ------
    InputError
        If an argument is invalid.

    Notes
    -----
    With ``x = |q| h`` and ``k = 3 - 4 nu`` the factor ``S`` is, on a bonded and on a slipping base [1]_,

    .. math::
        S = \frac{k \sinh 2x - 2x}{k \cosh 2x + 2x^2 + 5 - 12 \nu + 8 \nu^2},
        \qquad S = \frac{\cosh 2x - 1}{\sinh 2x + 2x}.

    In free space the kernel is the kernel of the half-space less a smooth correction,
    ``c(r) = 1/(pi h) int_0^inf (1 - S(s)) J0(s r/h) ds``, averaged over the loaded cell. On cells longer than half of
    the thickness its transform is :meth:`transfer` of difference quotients.

    References
    ----------
    .. [1] K. L. Johnson, *Contact Mechanics*, CUP, 1985, section 5.8.
    """

    thickness: float
    poisson: float = 0.5
    base: Base = BASE

    def __post_init__(self) -> None:
        number(self.thickness, "m", "thickness", above=0)
        number(self.poisson, "1", "poisson", least=0, most=0.5)
        one_of("base", self.base, get_args(Base))

    @property
    def relief(self) -> float:
        """Reduction of the approach of a small contact by the base, over load and compliance. [1/m]

        It compares the sheet with a half-space, to first order in the contact radius over the thickness.
        """
        return float(_correction(self.poisson, self.base)(np.zeros(1))[0]) / self.thickness

    def described(self) -> dict[str, Any]:
        """Return thickness [m] and base."""
        return {"thickness": self.thickness, "base": self.base}

    def transfer(self, qx: ArrayLike, qy: ArrayLike) -> Array:
        """Return ``(2 / |q|) S(|q| h)``; at ``q = 0`` the limit, zero if the sheet is incompressible. [m]"""
        x = np.maximum(np.hypot(qx, qy) * self.thickness, _LONGEST_WAVE)
        return 2 * self.thickness / x * reduction(x, self.poisson, self.base)

    def influence(self, shape: tuple[int, int], spacing: tuple[float, float]) -> Array:
        """Return Love's kernel less the correction, to 1e-13 of the largest value; or the kernel of long cells. [m]"""
        dx, dy = (side / self.thickness for side in spacing)
        if max(dx, dy) > _LONG:
            return self._influence_of_long_cells(shape, spacing)
        kernel = love_kernel(shape, spacing)
        x, y = dx * np.arange(shape[0]), dy * np.arange(shape[1])
        near = np.hypot(x[:, None], y) <= _REACH - math.hypot(dx, dy) / 2
        kernel[~near] = 0
        rows, columns = np.nonzero(near)
        correction = _correction(self.poisson if self.base == "bonded" else 0.5, self.base)
        points = [next(count for longest, count in _GAUSS if side <= longest) for side in (dx, dy)]
        mean = cell_mean(correction, x[rows], y[columns], (dx, dy), (points[0], points[1]))
        kernel[near] -= mean * (spacing[0] * spacing[1] / self.thickness)
        return kernel

    def _influence_of_long_cells(self, shape: tuple[int, int], spacing: tuple[float, float]) -> Array:
        """Return the kernel whose transform is the transfer function of fourth-order difference quotients. [m]

        The difference quotients replace ``qx^2`` by ``4 (s + s^2 / 3) / dx^2`` with ``s = sin^2(qx dx / 2)``. The
        transform is then smooth at the shortest wave, so that the kernel decays exponentially. Its relative error of
        long waves is below ``(q dx)^4 / 90``.
        """
        h = self.thickness
        counts = [max(n, math.ceil(_REACH * h / side) + 16) for n, side in zip(shape, spacing, strict=True)]
        sines = [np.sin(np.pi / 2 * np.arange(count) / (count - 1)) ** 2 for count in counts]
        qx, qy = (2 / side * np.sqrt(s + s**2 / 3) for s, side in zip(sines, spacing, strict=True))
        return np.asarray(scipy.fft.idctn(self.transfer(qx[:, None], qy), type=1))[: shape[0], : shape[1]]


def reduction(x: ArrayLike, poisson: float, base: Base) -> Array:
    """Return the factor ``S`` of a wave: its displacement over the displacement of a half-space.

    Parameters
    ----------
    x : array_like
        Wave number times thickness, positive.
    poisson : float
        Poisson's ratio.
    base : {"bonded", "slipping"}

    Returns
    -------
    ndarray
        Between 0 and 1; exact to rounding for every `x`.
    """
    x = np.asarray(x, dtype=float)
    e = np.exp(-2 * x)
    if base == "slipping":
        return np.asarray(np.expm1(-2 * x) ** 2 / (-np.expm1(-4 * x) + 4 * x * e))
    k, rest = _bonded(x, poisson)
    y = 2 * np.minimum(x, _SERIES_BELOW)
    series = y**3 * np.polynomial.polynomial.polyval(y**2, _SERIES)  # sinh(y) - y, whose terms cancel if y is small
    excess = np.where(x < _SERIES_BELOW, 2 * e * series, -np.expm1(-4 * x) - 4 * x * e)
    return np.asarray((excess - (k - 1) * np.expm1(-4 * x)) / (k * (1 + e * e) + 2 * e * rest))


def complement(x: ArrayLike, poisson: float, base: Base) -> Array:
    """Return ``1 - S`` of waves, for positive ``x``, without cancellation."""
    x = np.asarray(x, dtype=float)
    e = np.exp(-2 * x)
    if base == "slipping":
        return np.asarray(2 * e * (2 * x - np.expm1(-2 * x)) / (-np.expm1(-4 * x) + 4 * x * e))
    k, rest = _bonded(x, poisson)
    return np.asarray(2 * e * (k * e + rest + 2 * x) / (k * (1 + e * e) + 2 * e * rest))


def _bonded(x: Array, poisson: float) -> tuple[float, Array]:
    """Return ``k``, and the rest of the denominator next to ``k cosh 2x``."""
    return 3 - 4 * poisson, 2 * x**2 + 5 - 12 * poisson + 8 * poisson**2


@lru_cache(maxsize=8)
def _correction(poisson: float, base: Base) -> Any:
    """Return a function of the distance in thicknesses: half-space kernel less sheet kernel. [1/thickness]"""
    s, weights = panels(96, _SHORTEST_WAVE, 16)
    amplitude = weights * complement(s, poisson, base) / math.pi
    # the function is even: nodes before zero keep the end of the spline away from zero
    at = np.linspace(-1.0, _REACH, math.ceil((1.0 + _REACH) * _PER_THICKNESS))
    values = np.array([amplitude @ scipy.special.j0(r * s) for r in at])
    spline = scipy.interpolate.make_interp_spline(at, values, _DEGREE)
    powers = [spline(at[:-1], order) / math.factorial(order) for order in range(_DEGREE, -1, -1)]
    return scipy.interpolate.PPoly(powers, at)  # quicker than a B-spline
