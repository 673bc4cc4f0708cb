r"""Layers on a half-space that gives way too: a coating, a rubber on a polymer, skin on tissue.

Each wave of pressure is a problem of plane strain. What lies below a layer answers a traction by a displacement, a
matrix of two by two; so does the layer on top of it, and any number of layers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.bodies.half_space import love_kernel
from roughvisc.mechanics.bodies.kernel import Kernel, check_grid, half_space_transfer

Array = NDArray[np.float64]
# So many depths of images a decade, from this part of the thinnest layer on: at any distance they are right to 1e-5 of
# the top layer's own kernel, on a base that is softer to 1e-8 of all (measured for moduli 50 to 10,000 apart).
_PER_DECADE, _SHALLOWEST = 14, 0.8
# Wave number times the thinnest layer's thickness from which on the response is the top layer's to rounding; and times
# the whole thickness, the least at which it is asked for, and what it differs by from the half-space's there.
_SHORT, _LONG, _NEAR = 40.0, 1e-7, 1e-9
# Up to so many longer cell sides from the load its displacement is had in closed form, beyond by Gauss points a side.
_NEAR_CELLS, _GAUSS_POINTS = 12.0, 4
# Waves that are computed together.
_AT_ONCE = 1 << 16
# Distances at which the images are added up, in a decade.
_DISTANCES = 400


def effective_compliance(
    q: ArrayLike, thicknesses: Sequence[float], poissons: Sequence[float], shear_compliances: Sequence[ArrayLike]
) -> NDArray[Any]:
    r"""Contact compliance of the half-space that would answer a wave of pressure as a layered one does.

    Parameters
    ----------
    q : array_like
        Wave numbers, positive. [1/m]
    thicknesses : sequence of float
        Of the layers, from the top. [m]
    poissons : sequence of float
        Poisson's ratios of the layers and of the half-space below them.
    shear_compliances : sequence of array_like
        Of the same, one more than there are layers: real, or complex where pressure oscillates. They broadcast with
        the wave numbers. [1/Pa]

    Returns
    -------
    ndarray
        ``C(q)``: the displacement is :math:`2 C(q) / |q|` times the pressure. [1/Pa]

    Notes
    -----
    In a layer of shear modulus ``G`` the field of a wave is a sum of two that decay with the depth ``z`` and two that
    grow. With ``s = q z`` and ``k = 3 - 4 nu`` they are

    .. math::
        \begin{aligned}
        U &= (A + B s) e^{-s}, & W &= (A + B (k + s)) e^{-s}, \\
        \sigma_{zz} &= -2 G q (A + B (2 - 2\nu + s)) e^{-s}, & \sigma_{xz} &= -2 G q (A + B (1 - 2\nu + s)) e^{-s}
        \end{aligned}

    and the same with ``s`` and the signs of ``W`` and of the shear stress turned. What lies below reflects the first
    two into the others; these come back to the top by a factor :math:`e^{-2 q h}`. Nothing grows in the computation:
    it is stable for any thickness.

    References
    ----------
    .. [1] K. L. Johnson, *Contact Mechanics*, CUP, 1985, section 5.8.
    """
    q = np.asarray(q, dtype=float)
    shape = np.broadcast_shapes(q.shape, *(np.shape(compliance) for compliance in shear_compliances))
    if math.prod(shape) > _AT_ONCE and shape[0] > 1:  # in parts: the matrices take many times the memory
        waves, *compliances = (np.broadcast_to(one, shape) for one in (q, *shear_compliances))
        parts = [slice(first, first + -(-shape[0] // 2)) for first in (0, -(-shape[0] // 2))]
        return np.concatenate(
            [
                effective_compliance(waves[part], thicknesses, poissons, [one[part] for one in compliances])
                for part in parts
            ]
        )
    layers = [np.asarray(compliance)[..., None, None] for compliance in shear_compliances]
    down, down_stress, _, _ = _waves_of(poissons[-1])
    # displacements over tractions, these over 2 q
    below = layers[-1] * (down @ np.linalg.inv(down_stress))
    for h, poisson, compliance in zip(thicknesses[::-1], poissons[-2::-1], layers[-2::-1], strict=True):
        down, down_stress, up, up_stress = _waves_of(poisson)
        reflected = _inverse(compliance * up - below @ up_stress) @ (below @ down_stress - compliance * down)
        x = q * h
        way = np.zeros((*x.shape, 2, 2))
        way[..., 0, 0] = way[..., 1, 1] = np.exp(-x)
        way[..., 0, 1] = x * np.exp(-x)
        there, back = way, way * np.array([[1, -1], [1, 1]])
        returned = back @ reflected @ there
        below = compliance * ((down + up @ returned) @ _inverse(down_stress + up_stress @ returned))
    return np.asarray(np.broadcast_to(-below[..., 1, 1] / 4, shape))


def _waves_of(poisson: float) -> tuple[Array, Array, Array, Array]:
    """Displacement ``(U, W)`` and traction over ``2 q`` of unit waves that decay, and of those that grow."""
    k, b, c = 3 - 4 * poisson, 1 - 2 * poisson, 2 - 2 * poisson
    down, down_stress = np.array([[1, 0], [1, k]]), -np.array([[1, b], [1, c]])
    turned = np.array([[1, -1], [-1, 1]])
    return down, down_stress, down * turned, -down_stress * turned


def _inverse(matrix: NDArray[Any]) -> NDArray[Any]:
    """Inverses of matrices of two by two."""
    (a, b), (c, d) = np.moveaxis(matrix, (-2, -1), (0, 1))
    adjugate = np.moveaxis(np.array([[d, -b], [-c, a]]), (0, 1), (-2, -1))
    return np.asarray(adjugate / (a * d - b * c)[..., None, None])


@dataclass(frozen=True)
class Layered(Kernel):
    r"""Elastic layers bonded to each other and to an elastic half-space.

    Displacements are those at unit contact compliance of the top layer.

    Parameters
    ----------
    thicknesses : tuple of float
        Of the layers, from the top. [m]
    poissons : tuple of float
        Poisson's ratios of the layers and of the half-space.
    compliances : tuple of float
        Shear compliances of the same, over that of the top layer.

    Notes
    -----
    ``K_q = (2 / |q|) S(q)``: ``S`` is 1 for waves shorter than the top layer, and the half-space's contact compliance
    over the top layer's for long ones. In free space the kernel is Love's plus a sum of smooth images
    :math:`w_j / (\pi \sqrt{r^2 + b_j^2})` with :math:`S(q) = 1 + \sum_j w_j e^{-q b_j}`, averaged over the loaded cell.
    The weights add up to the limit of long waves, so that the far field is that of the half-space.
    """

    thicknesses: tuple[float, ...]
    poissons: tuple[float, ...]
    compliances: tuple[float, ...]

    def __post_init__(self) -> None:
        if not self.thicknesses or not all(0 < h < math.inf for h in self.thicknesses):
            raise InputError(f"thicknesses is {self.thicknesses!r}: expected positive numbers [m], one at least")
        for name, values in (("poissons", self.poissons), ("compliances", self.compliances)):
            if len(values) != len(self.thicknesses) + 1:
                raise InputError(f"{name} has {len(values)} values: expected one more than there are layers")
        if not all(0 <= poisson <= 0.5 for poisson in self.poissons):
            raise InputError(f"poissons is {self.poissons!r}: expected 0 to 1/2")
        if not all(0 < compliance < math.inf for compliance in self.compliances):
            raise InputError(f"compliances is {self.compliances!r}: expected positive numbers")

    @property
    def of_long_waves(self) -> float:
        """Contact compliance of the half-space below over that of the top layer."""
        first, last = ((1 - self.poissons[at]) * self.compliances[at] for at in (0, -1))
        return last / first

    def factor(self, q: ArrayLike) -> Array:
        """``S`` of positive wave numbers [1/m]: contact compliance over that of the top layer."""
        own = (1 - self.poissons[0]) * self.compliances[0] / 2
        return np.asarray(effective_compliance(q, self.thicknesses, self.poissons, self.compliances) / own)

    def transfer(self, qx: ArrayLike, qy: ArrayLike) -> Array:
        """``(2 / |q|) S(|q|)``; zero at ``q = 0``, as of a half-space. [m]"""
        return half_space_transfer(self.factor, qx, qy)

    def influence(self, shape: tuple[int, int], spacing: tuple[float, float]) -> Array:
        """Love's kernel and the images, for cells of any length. [m]"""
        kernel = love_kernel(shape, spacing)
        depths, weights = _images(self.factor, self.thicknesses, self.of_long_waves)
        return kernel + image_influence(shape, spacing, depths, weights)


@lru_cache(maxsize=8)
def _images(factor: Callable[[Array], Array], thicknesses: tuple[float, ...], limit: float) -> tuple[Array, Array]:
    """Depths [m] and weights of the images that a factor ``S`` with some limit of long waves is 1 and a sum of."""
    whole, thinnest = sum(thicknesses), min(thicknesses)
    longest = 1e-2
    while longest > _LONG and abs(float(factor(np.array(longest / whole))) / limit - 1) > _NEAR:
        longest /= 10
    depths = image_depths(_SHALLOWEST * thinnest, whole / longest)
    q = np.geomspace(longest / whole, _SHORT / thinnest, 3 * depths.size)
    wanted = factor(q)
    rows = np.vstack([np.exp(-np.outer(q, depths)) / wanted[:, None], np.full(depths.size, 1 / limit)])
    weights = np.linalg.lstsq(rows, np.append(1 - 1 / wanted, 1 - 1 / limit), rcond=1e-13)[0]
    return depths, weights


def image_depths(first: float, last: float, per_decade: int = _PER_DECADE) -> Array:
    """Depths of images between two of them. [m]"""
    return np.geomspace(first, last, math.ceil(per_decade * math.log10(last / first)))


def image_influence(shape: tuple[int, int], spacing: tuple[float, float], depths: Array, weights: Array) -> Array:
    r"""Displacement of cells by images of a cell under unit pressure.

    Parameters
    ----------
    shape, spacing : tuple
        Cells, counted from the one at the origin, and their sides. [m]
    depths, weights : ndarray, shape (n,)
        Of the images: :math:`\sum_j w_j / (\pi \sqrt{r^2 + b_j^2})`. [m], [-]

    Returns
    -------
    ndarray, shape (nx, ny)
        Averages over the loaded cell: near it in closed form, beyond by Gauss quadrature. [m]
    """
    from scipy.interpolate import CubicSpline  # slow to import

    check_grid(shape, spacing)
    (dx, dy), unit = spacing, float(depths[0])
    x, y = dx * np.arange(shape[0])[:, None], dy * np.arange(shape[1])[None, :]
    near = np.hypot(x, y) <= _NEAR_CELLS * max(spacing)
    rows, columns = np.nonzero(near)
    found = np.zeros(shape)
    for depth, weight in zip(depths, weights, strict=True):
        found[rows, columns] += weight * _of_rectangle(x[rows, 0], y[0, columns], (dx, dy), depth)
    if near.all():
        return found
    farthest = math.hypot(shape[0] * dx, shape[1] * dy)
    at = unit * np.geomspace(1, 1 + farthest / unit, math.ceil(_DISTANCES * math.log10(1 + farthest / unit)) + 8) - unit
    along = CubicSpline(np.log1p(at / unit), (weights / np.sqrt(at[:, None] ** 2 + depths**2)).sum(axis=1) / math.pi)
    nodes, parts = np.polynomial.legendre.leggauss(_GAUSS_POINTS)
    mean = np.zeros(shape)
    for a, part_a in zip(nodes * dx / 2, parts / 2, strict=True):
        for b, part_b in zip(nodes * dy / 2, parts / 2, strict=True):
            mean += part_a * part_b * along(np.log1p(np.hypot(x + a, y + b) / unit))
    return np.where(near, found, mean * (dx * dy))


def _of_rectangle(x: Array, y: Array, sides: tuple[float, float], depth: float) -> Array:
    """``1 / (pi sqrt(r^2 + depth^2))`` integrated over a rectangle, seen from places relative to its centre. [m]"""
    total = np.zeros_like(x)
    for sx, sy in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        a, b = x + sx * sides[0] / 2, y + sy * sides[1] / 2
        distance = np.sqrt(a**2 + b**2 + depth**2)
        total += sx * sy * (a * np.arcsinh(b / np.hypot(a, depth)) + b * np.arcsinh(a / np.hypot(b, depth)))
        total -= sx * sy * depth * np.arctan(a * b / (depth * distance))
    return total / math.pi
