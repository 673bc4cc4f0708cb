"""A sheet on a rigid base: ``K_q = (2 / |q|) S(|q| h)``. Short waves respond as on a half-space: ``S = 1``.

With a constant Poisson's ratio space and time separate as for a half-space: ``u = C(t) K * p``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.body import Body, Kernel, separability_error
from roughvisc.mechanics.half_space import check_grid, love_kernel, rectangle_displacement
from roughvisc.mechanics.materials.creep import Material, complete
from roughvisc.units import Quantity, quantities

Array = NDArray[np.float64]
Base = Literal["bonded", "slipping"]
#: Default base of a sheet.
BASE: Base = "bonded"
# In thicknesses: beyond this distance the kernel is below 1e-17 of its size at one thickness, and taken for zero.
_REACH = 46.0
# 1 - S(x) decreases as x^2 exp(-2 x): below rounding from here.
SHORTEST_WAVE = 24.0
# The correction over the distance: pieces of so many thicknesses, Chebyshev nodes in each. Error below 1e-15.
_PIECE, _NODES = 0.15, 10
# Gauss points per side of a cell of so many thicknesses that give the mean of the correction to 1e-13.
_GAUSS = ((0.01, 2), (0.05, 3), (0.15, 4), (0.5, 7))
# Cells of more thicknesses than the first are long, see :func:`long_cell_influence`; beyond the second: refused.
_LONG, _LONGEST = 0.5, 50.0
# With this kappa the response to long waves is right to 1e-3 of 4/3 q^2 on cells of any length (measured).
_KAPPA = 3.0
# Distance at which erfc(kappa r) is below rounding, and Gauss points that integrate over as much to rounding.
_SHORT_REACH, _GAUSS_POINTS = 6.2 / _KAPPA, 32
# Wave number at which the second part of the kernel, 2/q erfc(q / 2 kappa), is below rounding.
_LAST_WAVE = 12 * _KAPPA
# Minus the second derivative, to fourth order in the spacing.
_SECOND_DIFFERENCE = (-1 / 12, 16 / 12, -30 / 12, 16 / 12, -1 / 12)
_MARGIN = len(_SECOND_DIFFERENCE) // 2
# Below this, sinh(2 x) - 2 x is computed from its series.
_SERIES_BELOW = 0.5


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
    amiss = separability_error(material)
    if amiss:
        raise InputError(
            f"thickness is {thickness!r}, and the material is {amiss}: expected one body, Poisson's ratio constant"
        )
    endless = thickness == math.inf
    kernel = Sheet(1.0 if endless else thickness, complete(material).poisson, base)  # checks all arguments
    return Body(material) if endless else Body(material, kernel)


@quantities(thickness="m")
@dataclass(frozen=True)
class Sheet(Kernel):
    r"""Kernel of a homogeneous sheet on a rigid base.

    Parameters
    ----------
    thickness : float or str
        [m]
    poisson : float
        Poisson's ratio, from 0 to 1/2. On a slipping base the kernel does not depend on it.
    base : {"bonded", "slipping"}
        Whether the sheet sticks to its base, or slides on it without friction.

    Raises
    ------
    InputError
        If an argument is none of these.

    Notes
    -----
    With ``x = |q| h`` and ``k = 3 - 4 nu`` the factor ``S`` is, on a bonded and on a slipping base [1]_,

    .. math::
        S = \frac{k \sinh 2x - 2x}{k \cosh 2x + 2x^2 + 5 - 12 \nu + 8 \nu^2},
        \qquad S = \frac{\cosh 2x - 1}{\sinh 2x + 2x}.

    In free space the kernel is that of the half-space less a smooth correction,
    ``c(r) = 1/(pi h) int_0^inf (1 - S(s)) J0(s r/h) ds``, averaged over the loaded cell. On cells longer than half of
    the thickness it is that of :func:`long_cell_influence`.

    References
    ----------
    .. [1] K. L. Johnson, *Contact Mechanics*, CUP, 1985, section 5.8.
    """

    thickness: Quantity
    poisson: float = 0.5
    base: Base = BASE

    def __post_init__(self) -> None:
        if not (isinstance(self.thickness, int | float) and 0 < self.thickness < math.inf):
            raise InputError(f"thickness is {self.thickness!r}: expected a positive number [m]")
        if not 0 <= self.poisson <= 0.5:
            raise InputError(f"Poisson's ratio of a sheet is {self.poisson!r}: expected 0 to 1/2")
        if self.base not in get_args(Base):
            raise InputError(f"base is {self.base!r}: expected {' or '.join(map(repr, get_args(Base)))}")

    @property
    def uniform_displacement(self) -> float:
        """Displacement of the sheet under uniform unit pressure. [m]"""
        slope = (1 - 2 * self.poisson) / (1 - self.poisson) ** 2 if self.base == "bonded" else 1.0
        return slope * self.thickness

    @property
    def long_wave_factor(self) -> float:
        """``S`` of the longest waves: they do not displace a surface above a rigid base."""
        return 0.0

    def complement(self, x: ArrayLike) -> Array:
        """Return ``1 - S`` of waves, without cancellation. `x` is the wave number times the thickness."""
        return complement(x, self.poisson, self.base)

    @property
    def relief(self) -> float:
        """What the base takes off the displacement far inside the thickness, over load and compliance. [1/m]

        A contact much smaller than the thickness has that much less approach than on a half-space, to first order.
        """
        s, weights = panels(96, SHORTEST_WAVE, 16)
        return float(weights @ complement(s, self.poisson, self.base)) / (math.pi * self.thickness)

    def described(self) -> dict[str, Any]:
        """Return thickness [m] and base."""
        return {"thickness": self.thickness, "base": self.base}

    def transfer(self, qx: ArrayLike, qy: ArrayLike) -> Array:
        """Return ``(2 / |q|) S(|q| h)``; at ``q = 0`` the limit, zero if the sheet is incompressible. [m]"""
        q = np.asarray(np.hypot(qx, qy), dtype=float)
        long = q * self.thickness < 1e-150
        q = np.where(long, 1.0, q)
        return np.where(long, self.uniform_displacement, 2 / q * reduction(q * self.thickness, self.poisson, self.base))

    def influence(self, shape: tuple[int, int], spacing: tuple[float, float]) -> Array:
        """Return Love's kernel less the correction, to 1e-13 of the largest value; or the kernel of long cells. [m]"""
        check_grid(shape, spacing)
        dx, dy = (side / self.thickness for side in spacing)
        if max(dx, dy) > _LONG:
            uniform = self.uniform_displacement / self.thickness
            return self.thickness * long_cell_influence(shape, (dx, dy), self._scaled_transfer, uniform, _REACH)
        kernel = love_kernel(shape, spacing)
        x, y = dx * np.arange(shape[0]), dy * np.arange(shape[1])
        near = np.hypot(x[:, None], y) <= _REACH - math.hypot(dx, dy) / 2
        kernel[~near] = 0
        rows, columns = np.nonzero(near)
        mean = np.zeros(rows.size)
        correction = _correction(self.poisson if self.base == "bonded" else 0.5, self.base)
        along_x, along_y = _gauss(dx), _gauss(dy)
        for a, weight_a in zip(*along_x, strict=True):
            square = (x[rows] + a) ** 2
            for b, weight_b in zip(*along_y, strict=True):
                mean += weight_a * weight_b * correction(np.sqrt(square + (y[columns] + b) ** 2))
        kernel[near] -= mean * (spacing[0] * spacing[1] / self.thickness)
        return kernel

    def _scaled_transfer(self, x: Array) -> Array:
        """Return the transfer function over the thickness, of wave numbers times the thickness."""
        return 2 / x * reduction(x, self.poisson, self.base)

    def check_cells(self, spacing: tuple[float, float]) -> None:
        """Refuse cells longer than fifty thicknesses."""
        ratio = max(spacing) / self.thickness
        if ratio > _LONGEST * (1 + 1e-9):
            raise InputError(
                f"thickness is {self.thickness:.6g} m and a cell is {max(spacing):.6g} m long, {ratio:.4g} times the "
                f"thickness: expected cells of at most {_LONGEST:g} thicknesses in free space; take shorter cells, "
                "periodic boundaries, or a thicker sheet"
            )


def long_cell_influence(
    shape: tuple[int, int],
    sides: tuple[float, float],
    transfer: Callable[[Array], Array],
    uniform: float,
    reach: float,
) -> Array:
    """Return the displacement of cells under unit pressure on the cell at the origin, for cells of any length.

    Parameters
    ----------
    shape : tuple of int
        Number of cells ``(nx, ny)``.
    sides : tuple of float
        Cell sides. [thicknesses]
    transfer : callable
        ``K_q`` of positive wave numbers. [thicknesses]
    uniform : float
        Its limit ``K_0`` at zero. [thicknesses]
    reach : float
        Distance beyond which the kernel is zero to rounding. [thicknesses]

    Returns
    -------
    ndarray, shape (nx, ny)
        [thicknesses]
    """
    from scipy.special import erf  # slow to import

    rest = uniform - 2 / (math.sqrt(math.pi) * _KAPPA)
    influence = np.zeros(shape)

    # a Fourier sum over half-integer wave numbers: its nearest images lie two reaches away
    waves = np.asarray((np.arange(math.ceil(_LAST_WAVE * reach / math.pi)) + 0.5) * math.pi / reach, dtype=np.float64)
    squared = waves[:, None] ** 2 + waves**2
    q = np.sqrt(squared)
    smooth = (transfer(q) - 2 / q * erf(q / (2 * _KAPPA)) - rest * np.exp(-squared / (12 * _KAPPA**2))) / squared
    nx, ny = (min(n, math.ceil(reach / side + 0.5) + _MARGIN) for n, side in zip(shape, sides, strict=True))
    means = _cell_waves(nx, sides[0], waves, reach) @ smooth @ _cell_waves(ny, sides[1], waves, reach).T
    for shift, weight in enumerate(_SECOND_DIFFERENCE):
        influence[:nx, :ny] -= weight / sides[0] ** 2 * means[shift : shift + nx, _MARGIN:-_MARGIN]
        influence[:nx, :ny] -= weight / sides[1] ** 2 * means[_MARGIN:-_MARGIN, shift : shift + ny]

    nx, ny = (min(n, math.ceil(_SHORT_REACH / side + 0.5)) for n, side in zip(shape, sides, strict=True))
    x, width = _clipped_cells(np.arange(nx), sides[0], _SHORT_REACH)
    y, depth = _clipped_cells(np.arange(ny), sides[1], _SHORT_REACH)
    nodes, weights = np.polynomial.legendre.leggauss(_GAUSS_POINTS)
    at_x, at_y = (at[:, None] + side[:, None] * nodes / 2 for at, side in ((x, width), (y, depth)))
    distance = np.hypot(at_x[:, None, :, None], at_y[:, None, :])
    beyond = erf(_KAPPA * distance) / (math.pi * distance)  # what 1 / (pi r) has more than the first part
    influence[:nx, :ny] += rectangle_displacement(x[:, None], y, (width[:, None], depth))
    influence[:nx, :ny] -= np.outer(width, depth) / 4 * (beyond @ weights @ weights)
    share_x, share_y = (
        (erf(math.sqrt(3) * _KAPPA * (at + side / 2)) - erf(math.sqrt(3) * _KAPPA * (at - side / 2))) / 2
        for at, side in ((x, width), (y, depth))
    )
    influence[:nx, :ny] += rest * np.outer(share_x, share_y)
    return influence


def _clipped_cells(cells: NDArray[np.intp], side: float, reach: float) -> tuple[Array, Array]:
    """Return centre and length of the part of each cell within a distance of the origin, along an axis."""
    lower, upper = (np.clip((cells + end) * side, -reach, reach) for end in (-0.5, 0.5))
    return (lower + upper) / 2, upper - lower


def _cell_waves(count: int, side: float, waves: Array, reach: float) -> Array:
    """Return integrals of waves over cells from the origin on, and over some cells on either side."""
    centre, length = _clipped_cells(np.arange(-_MARGIN, count + _MARGIN), side, reach)
    integrals = np.cos(np.outer(centre, waves)) * np.sin(np.outer(length / 2, waves)) * (2 / waves)
    return np.asarray(integrals / reach)


def reduction(x: ArrayLike, poisson: float, base: Base) -> Array:
    """Return the factor ``S`` of a wave: its displacement over that of a half-space.

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
    small = np.minimum(x, _SERIES_BELOW)
    term, series = 2 * small, np.zeros_like(small)  # sinh(2 x) - 2 x, whose terms cancel where x is small
    for n in range(3, 27, 2):
        term = term * (2 * small) ** 2 / (n * (n - 1))
        series = series + term
    excess = np.where(x < _SERIES_BELOW, 2 * e * series, -np.expm1(-4 * x) - 4 * x * e)
    return np.asarray((excess - (k - 1) * np.expm1(-4 * x)) / (k * (1 + e * e) + 2 * e * rest))


def complement(x: ArrayLike, poisson: float, base: Base) -> Array:
    """Return ``1 - S`` without cancellation."""
    x = np.asarray(x, dtype=float)
    e = np.exp(-2 * x)
    if base == "slipping":
        with np.errstate(invalid="ignore"):
            whole = 2 * e * (2 * x - np.expm1(-2 * x)) / (-np.expm1(-4 * x) + 4 * x * e)
        return np.asarray(np.where(x > 0, whole, 1.0))
    k, rest = _bonded(x, poisson)
    return np.asarray(2 * e * (k * e + rest + 2 * x) / (k * (1 + e * e) + 2 * e * rest))


def _bonded(x: Array, poisson: float) -> tuple[float, Array]:
    """Return ``k``, and the rest of the denominator next to ``k cosh 2x``."""
    return 3 - 4 * poisson, 2 * x**2 + 5 - 12 * poisson + 8 * poisson**2


def panels(count: int, end: float, points: int) -> tuple[Array, Array]:
    """Return Gauss nodes and weights on equal parts of an interval from zero."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    side = end / count
    at = (np.arange(count)[:, None] + (nodes + 1) / 2) * side
    return at.ravel(), np.tile(weights * side / 2, count)


@lru_cache(maxsize=8)
def _correction(poisson: float, base: Base) -> Callable[[Array], Array]:
    """Return the kernel of the half-space less that of a sheet, at a distance in thicknesses. [1/thickness]"""
    from scipy.interpolate import PPoly  # slow to import
    from scipy.special import j0

    s, weights = panels(96, SHORTEST_WAVE, 16)
    amplitude = weights * complement(s, poisson, base) / math.pi
    count = math.ceil(_REACH / _PIECE)
    ends = np.linspace(0.0, _REACH, count + 1)
    side = ends[1]
    nodes = np.polynomial.chebyshev.chebpts1(_NODES)
    at = ends[:-1, None] + (nodes + 1) / 2 * side
    values = np.array([j0(np.outer(row, s)) @ amplitude for row in at])
    powers = np.linalg.solve(np.vander((nodes + 1) / 2, increasing=False), values.T)
    correction: Callable[[Array], Array] = PPoly(powers / side ** np.arange(_NODES - 1, -1, -1)[:, None], ends)
    return correction


def _gauss(side: float) -> tuple[Array, Array]:
    """Return Gauss nodes about the centre of a side, in thicknesses, and weights that add up to one."""
    points = next(count for longest, count in _GAUSS if side <= longest)
    nodes, weights = np.polynomial.legendre.leggauss(points)
    return nodes * side / 2, weights / 2
