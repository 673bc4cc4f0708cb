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
from roughvisc.mechanics.body import HALF_SPACE, Body, Kernel, cell_mean, check_one_body
from roughvisc.mechanics.materials.material import Material
from roughvisc.mechanics.quadrature import panels
from roughvisc.units import Quantity, number, quantities

Array = NDArray[np.float64]
Base = Literal["bonded", "slipping"]
#: Default base of a sheet.
BASE: Base = "bonded"
# Distance in thicknesses beyond which the kernel is set to zero: it is below 1e-17 of its value at one thickness.
_REACH = 46.0
# Nodes of the correction per thickness, and degree of the spline through them: error below 1e-14.
_PER_THICKNESS = 16
_DEGREE = 9
# Cell side in thicknesses, and number of Gauss points per side that give the mean of the correction to 1e-13. Cells
# with a longer side are long.
_GAUSS = ((0.01, 2), (0.05, 3), (0.15, 4), (0.5, 7))
# Below this x, sinh(2 x) - 2 x is computed from its series, with these coefficients.
_SERIES_BELOW = 0.5
_SERIES = 1 / np.cumprod(np.arange(2.0, 27))[1::2]


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

    See Also
    --------
    roughvisc.layer, roughvisc.Body

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
        """Return the sheet as text, its thickness [m] and its base."""
        return {"body": repr(self), "thickness": self.thickness, "base": self.base}

    def transfer(self, qx: ArrayLike, qy: ArrayLike) -> Array:
        """Return ``(2 / |q|) S(|q| h)``; at ``q = 0`` the limit, zero if the sheet is incompressible. [m]"""
        x = np.maximum(np.hypot(qx, qy) * self.thickness, 1e-150)  # which has the value of uniform pressure
        return 2 * self.thickness / x * factors(x, self.poisson, self.base)[0]

    def influence(self, shape: tuple[int, int], spacing: tuple[float, float]) -> Array:
        """Return Love's kernel less the correction, to 1e-13 of the largest value; or the kernel of long cells. [m]"""
        dx, dy = (side / self.thickness for side in spacing)
        if max(dx, dy) > _GAUSS[-1][0]:
            return self._influence_of_long_cells(shape, spacing)
        kernel = HALF_SPACE.influence(shape, spacing)
        x, y = np.broadcast_arrays(dx * np.arange(shape[0])[:, None], dy * np.arange(shape[1]))
        near = np.hypot(x, y) <= _REACH - math.hypot(dx, dy) / 2
        kernel[~near] = 0
        along_x, along_y = (next(count for longest, count in _GAUSS if side <= longest) for side in (dx, dy))
        mean = cell_mean(_correction(self.poisson, self.base), x[near], y[near], (dx, dy), (along_x, along_y))
        kernel[near] -= mean * (spacing[0] * spacing[1] / self.thickness)
        return kernel

    def _influence_of_long_cells(self, shape: tuple[int, int], spacing: tuple[float, float]) -> Array:
        """Return the kernel whose transform is the transfer function of fourth-order difference quotients. [m]

        The difference quotients replace ``qx^2`` by ``4 (s + s^2 / 3) / dx^2`` with ``s = sin^2(qx dx / 2)``. The
        transform is then smooth at the shortest wave, so that the kernel decays exponentially. Its relative error of
        long waves is below ``(q dx)^4 / 90``.
        """
        reach = _REACH * self.thickness
        counts = [max(n, math.ceil(reach / side) + 16) for n, side in zip(shape, spacing, strict=True)]
        sines = [np.sin(np.pi / 2 * np.arange(count) / (count - 1)) ** 2 for count in counts]
        qx, qy = (2 / side * np.sqrt(s + s**2 / 3) for s, side in zip(sines, spacing, strict=True))
        return np.asarray(scipy.fft.idctn(self.transfer(qx[:, None], qy), type=1))[: shape[0], : shape[1]]


def factors(x: ArrayLike, poisson: float, base: Base) -> tuple[Array, Array]:
    """Return the factor ``S`` of a wave, its displacement over the displacement of a half-space, and ``1 - S``.

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
        Each between 0 and 1, and exact to rounding for every `x`.
    """
    x = np.asarray(x, dtype=float)
    e = np.exp(-2 * x)
    four = -np.expm1(-4 * x)
    if base == "slipping":
        two = -np.expm1(-2 * x)
        denominator = four + 4 * x * e
        return two**2 / denominator, 2 * e * (2 * x + two) / denominator
    k = 3 - 4 * poisson
    rest = 2 * x**2 + 5 - 12 * poisson + 8 * poisson**2
    denominator = k * (1 + e * e) + 2 * e * rest
    excess = np.asarray(four - 4 * x * e)
    small = x < _SERIES_BELOW
    y = 2 * x[small]  # sinh(y) - y, whose terms cancel if y is small, is a series
    excess[small] = 2 * e[small] * (y**3 * np.polynomial.polynomial.polyval(y**2, _SERIES))
    return (excess + (k - 1) * four) / denominator, 2 * e * (k * e + rest + 2 * x) / denominator


@lru_cache(maxsize=8)
def _correction(poisson: float, base: Base) -> Any:
    """Return a function of the distance in thicknesses: half-space kernel less sheet kernel. [1/thickness]"""
    s, weights = panels(96, 24.0, 16)  # there 1 - S, which decreases as s^2 exp(-2 s), is below rounding
    amplitude = weights * factors(s, poisson, base)[1] / math.pi
    # the function is even: nodes before zero keep the end of the spline away from zero
    places = np.linspace(-1.0, _REACH, math.ceil((1.0 + _REACH) * _PER_THICKNESS))
    values = np.array([amplitude @ scipy.special.j0(r * s) for r in places])
    spline = scipy.interpolate.make_interp_spline(places, values, _DEGREE)
    powers = [spline(places[:-1], order) / math.factorial(order) for order in range(_DEGREE, -1, -1)]
    return scipy.interpolate.PPoly(powers, places)  # quicker than a B-spline
