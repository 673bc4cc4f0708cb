r"""Kernel of a body: the displacement of its surface under unit pressure, at unit contact compliance.

The displacement is ``u = C K * p`` with the contact compliance ``C = 1/E*``. A :class:`Kernel` is one value that
everything built from it keeps: coarser and larger grids, and windows.

Fourier convention: ``p_q = sum_x p exp(-i q x)`` with ``q = 2 pi n / size``, as in ``scipy.fft``. Kernels are real and
even in x and in y, hence so are their transforms: a *symbol* here holds the non-negative wave numbers of both axes,
shape ``(mx // 2 + 1, my // 2 + 1)`` for ``(mx, my)`` points, and the others follow by symmetry.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import fft

from roughvisc.errors import InputError

Array = NDArray[np.float64]
Counts = NDArray[np.intp]


class Kernel(Protocol):
    """What the contact asks of a body whose surface is the same everywhere, and its own mirror image in x and y.

    Two functions are required: :meth:`influence` for free space, :meth:`transfer` for periodic boundaries and for the
    preconditioner. They are of one linear, symmetric and positive operator. A class that inherits from this one has
    the rest, which holds for any body. A kernel is a value: frozen, and equal to another with the same parameters.

    Attributes
    ----------
    raises_surface : bool
        Whether pressure may raise the surface anywhere. Where it may not, nothing that lies deeper than the approach
        touches, and the contact in free space is followed by a window. Default: it may.
    """

    raises_surface: bool = True

    def __init_subclass__(cls, *args: Any, **settings: Any) -> None:
        super().__init_subclass__(*args, **settings)
        if "bulges" in cls.__dict__:  # until release 0.1.0
            raise InputError(f"{cls.__name__}: bulges is now raises_surface: expected that name")

    @abstractmethod
    def influence(self, shape: tuple[int, int], spacing: tuple[float, float]) -> Array:
        """Displacement at cell centres due to unit pressure on the cell at the origin.

        Parameters
        ----------
        shape : tuple of int
            Number of cells ``(nx, ny)``, counted from the one at the origin.
        spacing : tuple of float
            Cell sides ``(dx, dy)``: any, as the same kernel is asked for on coarser cells too. [m]

        Returns
        -------
        ndarray, shape (nx, ny)
            [m]
        """

    @abstractmethod
    def transfer(self, qx: ArrayLike, qy: ArrayLike) -> Array:
        """Displacement over pressure of a wave, the Fourier transform of the kernel.

        Parameters
        ----------
        qx, qy : ndarray
            Wave numbers, which broadcast. [1/m]

        Returns
        -------
        ndarray
            Positive; at ``q = 0`` the displacement by uniform pressure where that is finite, and zero where it is not:
            the mean displacement is left out then, and approach with periodic boundaries counts without it. [m]
        """

    def check_cells(self, spacing: tuple[float, float]) -> None:
        """Refuse cells on which :meth:`influence` is not accurate; called once for the grid of a surface.

        Parameters
        ----------
        spacing : tuple of float
            Cell sides ``(dx, dy)``. [m]

        Raises
        ------
        InputError
            Naming the cells and what is expected. Default: never.
        """
        return

    def described(self) -> dict[str, Any]:
        """What a result says of the body: names of attributes and their values."""
        return {"kernel": repr(self)}

    def under_rectangle(
        self, before: tuple[Counts, Counts], after: tuple[Counts, Counts], spacing: tuple[float, float]
    ) -> Array:
        """Displacement of cells in a rectangle of cells that all carry unit pressure.

        Parameters
        ----------
        before, after : pair of ndarray of int, shapes (nx,) and (ny,)
            How many cells of the rectangle lie on either side of each cell, along x and along y.
        spacing : tuple of float
            Cell sides. [m]

        Returns
        -------
        ndarray, shape (nx, ny)
            [m]

        Notes
        -----
        Sums of :meth:`influence`. A kernel that knows a closed form has one of its own.
        """
        reach = [max(int(np.max(a)), int(np.max(b))) + 1 for a, b in zip(before, after, strict=True)]
        quadrant = np.array(self.influence((reach[0], reach[1]), spacing))
        quadrant[0] /= 2  # a cell's own row and column are in two quadrants
        quadrant[:, 0] /= 2
        total = np.cumsum(np.cumsum(quadrant, axis=0), axis=1)
        x, y = ((a, b) for a, b in zip(before, after, strict=True))
        return np.asarray(sum(total[np.ix_(i, j)] for i in x for j in y))


def half_space_transfer(factor: Callable[[Array], Array], qx: ArrayLike, qy: ArrayLike) -> Array:
    """``(2 / |q|)`` times a factor of positive wave numbers [1/m]; zero at ``q = 0``, as of a half-space. [m]"""
    q = np.asarray(np.hypot(qx, qy), dtype=float)
    acts = q > 0
    q = np.where(acts, q, 1.0)
    return np.where(acts, 2 / q * factor(q), 0.0)


def has_finite_mean(kernel: Kernel) -> bool:
    """Whether the mean displacement under uniform pressure is finite, and known."""
    return float(kernel.transfer(0.0, 0.0)) > 0


def free_space_symbol(kernel: Kernel, padded: tuple[int, int], spacing: tuple[float, float]) -> Array:
    """Symbol of a kernel on a zero-padded grid.

    Parameters
    ----------
    kernel : Kernel
        Of the body.
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
    Every offset of the padded grid is filled with the kernel, also the one at half its length that no pair of
    cells has: with a zero there the symbol turns negative for slender cells (aspect 16: -1.5) and its inverse
    is no preconditioner.
    """
    offsets = (padded[0] // 2 + 1, padded[1] // 2 + 1)
    if padded[0] % 2 or padded[1] % 2:
        raise ValueError(f"padded is {padded}: expected even numbers of points")
    symbol: Array = fft.dctn(kernel.influence(offsets, spacing), type=1)  # the transform of the even extension
    return symbol


def periodic_symbol(kernel: Kernel, shape: tuple[int, int], spacing: tuple[float, float]) -> Array:
    """Symbol of a kernel under periodic pressure.

    Parameters
    ----------
    kernel : Kernel
        Of the body.
    shape : tuple of int
        Number of cells ``(nx, ny)`` of one period.
    spacing : tuple of float
        Cell sides. [m]

    Returns
    -------
    ndarray, shape (nx // 2 + 1, ny // 2 + 1)
        Positive, but zero at ``q = 0`` where the mean displacement is undefined and left out. [m]

    Raises
    ------
    InputError
        If the grid is impossible, or the transfer function is not positive.
    """
    check_grid(shape, spacing)
    waves = periodic_waves(shape, spacing)
    symbol = np.array(kernel.transfer(*waves), dtype=float)
    amiss = ~(np.isfinite(symbol) & (symbol > 0))
    amiss[0, 0] = not 0 <= symbol[0, 0] < math.inf
    if amiss.any():
        i, j = (int(n) for n in np.argwhere(amiss)[0])
        qx, qy = (float(one.ravel()[at]) for one, at in zip(waves, (i, j), strict=True))
        raise InputError(
            f"the transfer function of {kernel!r} is {symbol[i, j]:g} m at wave numbers {qx:g} and {qy:g} 1/m: "
            "expected a positive number, or zero where both are zero"
        )
    return symbol


def periodic_waves(shape: tuple[int, int], spacing: tuple[float, float]) -> tuple[Array, Array]:
    """Wave numbers of a symbol under periodic pressure, along x and along y, which broadcast. [1/m]"""
    qx, qy = (
        np.array(2 * math.pi / (n * side) * np.arange(n // 2 + 1), dtype=np.float64)
        for n, side in zip(shape, spacing, strict=True)
    )
    return qx[:, None], qy[None, :]


def wave_limits(shape: tuple[int, int], spacing: tuple[float, float]) -> tuple[float, float]:
    """Wave numbers of the longest and of the shortest wave on some cells. [1/m]"""
    longest = max(count * side for count, side in zip(shape, spacing, strict=True))
    return 2 * math.pi / longest, math.hypot(*(math.pi / side for side in spacing))


def check_grid(shape: tuple[int, int], spacing: tuple[float, float]) -> None:
    """Refuse an impossible grid."""
    if any(int(n) != n or n < 1 for n in shape):
        raise InputError(f"shape is {shape}: expected two positive whole numbers of cells")
    if not all(math.isfinite(side) and side > 0 for side in spacing):
        raise InputError(f"spacing is {spacing}: expected two positive lengths [m]")
