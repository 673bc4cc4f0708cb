"""Body that a profile is pressed on: a material, and the displacement of the body's surface under pressure.

The displacement is ``u = C K * p`` with the contact compliance ``C = 1/E*`` of the material and the kernel ``K`` of the
body. A material alone is a half-space. A body is accepted wherever a material is.

Fourier convention: ``p_q = sum_x p exp(-i q x)`` with ``q = 2 pi n / size``, as in ``scipy.fft``. Kernels are real and
even in x and in y, and so are their transforms. A *symbol* holds the non-negative wave numbers of both axes, shape
``(mx // 2 + 1, my // 2 + 1)`` for ``(mx, my)`` points; symmetry gives the others.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import fft

from roughvisc.errors import InputError
from roughvisc.mechanics.half_space import love_kernel
from roughvisc.mechanics.materials.creep import Material, check_material, complex_compliance, over_frequencies

Array = NDArray[np.float64]


class Kernel(ABC):
    """Displacement of a surface under pressure, at unit contact compliance.

    The body is homogeneous along its surface, and symmetric in x and y. A class needs two methods:
    :meth:`influence` for free space, :meth:`transfer` for periodic boundaries and the preconditioner. Both describe one
    linear, symmetric and positive operator. The other methods are inherited. A kernel is a value: frozen, and equal to
    another one with the same parameters.

    Attributes
    ----------
    raises_surface : bool
        Whether pressure may raise the surface anywhere. Default: True. If False, no point deeper than the approach
        touches, and in free space the contact is solved on a part of the surface.
    """

    raises_surface: bool = True

    @abstractmethod
    def influence(self, shape: tuple[int, int], spacing: tuple[float, float]) -> Array:
        """Return the displacement at cell centres under unit pressure on the cell at the origin.

        Parameters
        ----------
        shape : tuple of int
            Number of cells ``(nx, ny)``, counted from the one at the origin.
        spacing : tuple of float
            Cell sides ``(dx, dy)``. They may be longer than on the grid of the surface. [m]

        Returns
        -------
        ndarray, shape (nx, ny)
            Displacement at unit contact compliance. [m]
        """

    @abstractmethod
    def transfer(self, qx: ArrayLike, qy: ArrayLike) -> Array:
        """Return the displacement over the pressure of a wave, the Fourier transform of the kernel.

        Parameters
        ----------
        qx, qy : ndarray
            Wave numbers, which broadcast. [1/m]

        Returns
        -------
        ndarray
            Positive. At ``q = 0`` the displacement under uniform pressure if it is finite, otherwise zero: the mean
            displacement is then left out, and the approach under periodic boundaries counts without it. [m]
        """

    def described(self) -> dict[str, Any]:
        """Return the attributes of a result that describe the body: names and values."""
        return {"kernel": repr(self)}


@dataclass(frozen=True)
class HalfSpace(Kernel):
    """The elastic half-space: ``K = 1 / (pi r)`` averaged over the loaded cell, ``K_q = 2 / |q|``.

    References
    ----------
    .. [1] K. L. Johnson, *Contact Mechanics*, CUP, 1985, sections 3.2 and 13.2.
    """

    raises_surface = False

    def influence(self, shape: tuple[int, int], spacing: tuple[float, float]) -> Array:
        """Return :func:`roughvisc.mechanics.half_space.love_kernel`. [m]"""
        return love_kernel(shape, spacing)

    def transfer(self, qx: ArrayLike, qy: ArrayLike) -> Array:
        """Return ``2 / |q|``; zero at ``q = 0``, since the mean displacement is undefined. [m]"""
        magnitude = np.asarray(np.hypot(qx, qy), dtype=float)
        return np.asarray(2 / np.where(magnitude > 0, magnitude, math.inf))


#: The default kernel.
HALF_SPACE = HalfSpace()


def has_finite_mean(kernel: Kernel) -> bool:
    """Return whether the mean displacement under uniform pressure is finite, and known."""
    return float(kernel.transfer(0.0, 0.0)) > 0


def free_space_symbol(kernel: Kernel, padded: tuple[int, int], spacing: tuple[float, float]) -> Array:
    """Return the symbol of a kernel on a zero-padded grid.

    Parameters
    ----------
    kernel : Kernel
        Kernel of the body.
    padded : tuple of int
        Even numbers of points, at least ``2 n - 1`` of the unpadded grid's along each axis.
    spacing : tuple of float
        Cell sides. [m]

    Returns
    -------
    ndarray, shape (padded[0] // 2 + 1, padded[1] // 2 + 1)
        Real; positive for a half-space. [m]

    Notes
    -----
    The kernel fills every offset of the padded grid, even the offset at half its length, at which no pair of cells
    lies. With a zero there the symbol becomes negative for slender cells (aspect 16: -1.5), and its inverse is useless
    as a preconditioner.
    """
    offsets = (padded[0] // 2 + 1, padded[1] // 2 + 1)
    return np.asarray(fft.dctn(kernel.influence(offsets, spacing), type=1))  # the transform of the even extension


def periodic_symbol(kernel: Kernel, shape: tuple[int, int], spacing: tuple[float, float]) -> Array:
    """Return the symbol of a kernel under periodic pressure.

    Parameters
    ----------
    kernel : Kernel
        Kernel of the body.
    shape : tuple of int
        Number of cells ``(nx, ny)`` of one period.
    spacing : tuple of float
        Cell sides. [m]

    Returns
    -------
    ndarray, shape (nx // 2 + 1, ny // 2 + 1)
        Positive, but zero at ``q = 0`` if the mean displacement is undefined and left out. [m]

    Raises
    ------
    InputError
        If the transfer function is not positive.
    """
    symbol = np.array(kernel.transfer(*periodic_waves(shape, spacing)), dtype=float)
    wrong = ~(np.isfinite(symbol) & (symbol > 0))
    wrong[0, 0] = not 0 <= symbol[0, 0] < math.inf
    if wrong.any():
        expected = f"a positive transfer function, or zero at zero wave numbers, not {symbol[wrong][0]:g} m"
        raise InputError(key="kernel", found=kernel, expected=expected)
    return symbol


def periodic_waves(shape: tuple[int, int], spacing: tuple[float, float]) -> tuple[Array, Array]:
    """Return the wave numbers of a symbol under periodic pressure, along x and along y, which broadcast. [1/m]"""
    (nx, ny), (dx, dy) = shape, spacing
    qx = 2 * math.pi / (nx * dx) * np.arange(nx // 2 + 1.0)
    qy = 2 * math.pi / (ny * dy) * np.arange(ny // 2 + 1.0)
    return qx[:, None], qy[None, :]


def wave_limits(shape: tuple[int, int], spacing: tuple[float, float]) -> tuple[float, float]:
    """Return the wave numbers of the longest and of the shortest wave on a grid. [1/m]"""
    longest = max(count * side for count, side in zip(shape, spacing, strict=True))
    return 2 * math.pi / longest, math.hypot(*(math.pi / side for side in spacing))


@dataclass(frozen=True)
class Body:
    """Viscoelastic body that is homogeneous along its surface.

    Parameters
    ----------
    material : Prony or Creep
        A material.
    kernel : Kernel
        Displacement of the surface under pressure at unit contact compliance. Default: the kernel of a half-space.

    Raises
    ------
    InputError
        If either has a wrong type.

    Examples
    --------
    >>> import roughvisc as rv
    >>> rv.Body(rv.elastic(1e6)) == rv.sheet(rv.elastic(1e6), thickness=float("inf"))
    True
    """

    material: Material
    kernel: Kernel = HALF_SPACE

    def __post_init__(self) -> None:
        check_material(self.material)
        if not isinstance(self.kernel, Kernel):
            raise InputError(key="kernel", found=self.kernel, expected="a kernel, derived from Kernel")

    @property
    def materials(self) -> tuple[Material, ...]:
        """Materials of the body."""
        return (self.material,)

    def over_frequencies(self, frequency: ArrayLike, tolerance: float) -> Self:
        """Return the body with materials fitted to its own at some frequencies, see :func:`over_frequencies`.

        Parameters
        ----------
        frequency : array_like
            Angular frequencies. [1/s]
        tolerance : float
            Relative error of the compliance.
        """
        return replace(self, material=over_frequencies(self.material, frequency, tolerance))

    def waves(self, qx: Array, qy: Array, frequency: Array) -> tuple[Array, NDArray[np.complex128]]:
        """Return the displacement over the pressure of oscillating waves: kernel and complex contact compliance.

        Parameters
        ----------
        qx, qy : ndarray
            Wave numbers, which broadcast. [1/m]
        frequency : ndarray
            Angular frequencies among those given to :meth:`over_frequencies`; they broadcast with the wave numbers.
            [1/s]

        Returns
        -------
        kernel, compliance : ndarray
            Their product is the response [m], [1/Pa]. The compliance is infinite if the material creeps without end.
        """
        return self.kernel.transfer(qx, qy), complex_compliance(self.material, frequency)

    def facts(self, end: float) -> dict[str, Any]:
        """Return the attributes of a result that describe the body for an audit, unless the case states them.

        Parameters
        ----------
        end : float
            Time at which the creep ends. [s]
        """
        facts = {} if self.kernel == HALF_SPACE else self.kernel.described()
        facts["compliance_at_end"] = float(self.material.contact_compliance(end))
        if not self.material.stands_for:
            facts["poisson"] = self.material.poisson
        return facts


def as_body(material: Any) -> Body:
    """Return a body itself, or the half-space of a material."""
    return material if isinstance(material, Body) else Body(material)


def check_one_body(key: str, material: Any) -> None:
    """Check that an argument is the material of one body with a constant Poisson's ratio of 0 to 1/2."""
    if check_material(material, key).stands_for:
        raise InputError(key=key, found=material.stands_for, expected="one body, Poisson's ratio constant")
    if material.poisson < 0:
        raise InputError(key=key, found=material.poisson, expected="Poisson's ratio from 0 to 1/2")
