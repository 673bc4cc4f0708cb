"""Window: the part of a free-space domain that the contact is solved on, and the displacement outside it.

Pressure is not negative, and where the kernel does not bulge it pushes the surface away everywhere: beyond the window
the gap exceeds the undeformed gap less the approach. As long as that is positive at the lowest place outside, no
contact there is missed. Under a kernel that raises the surface there is no window.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from roughvisc.mechanics.body import Kernel
from roughvisc.mechanics.grid import transforms

Array = NDArray[np.float64]

# Cells of the smallest window, and of a border around what lies low enough.
_SMALLEST, _BORDER = 24, 2
# A window of more than this part of the domain's cells spares too little for what it costs to leave it again.
_LARGEST = 0.6
_BLOCK = 64  # columns or rows transformed together (measured)


@dataclass(frozen=True)
class Window:
    """A rectangle of cells of a domain.

    Attributes
    ----------
    domain : tuple of int
        Number of cells of the domain.
    first, shape : tuple of int
        Cell of the domain at which the window begins, and its number of cells.
    outside : float
        Least undeformed gap beyond the window; infinite where the window is the whole domain. [m]
    """

    domain: tuple[int, int]
    first: tuple[int, int]
    shape: tuple[int, int]
    outside: float = math.inf

    @property
    def whole(self) -> bool:
        """Whether it is the whole domain."""
        return self.shape == self.domain

    @property
    def cells(self) -> tuple[slice, slice]:
        """Index of its cells in the domain."""
        (i, j), (nx, ny) = self.first, self.shape
        return slice(i, i + nx), slice(j, j + ny)


def whole_domain(shape: tuple[int, int]) -> Window:
    """The window that leaves nothing out."""
    return Window(shape, (0, 0), shape)


def window_around(gap: Array, extent: int, former: Window | None = None) -> Window:
    """The window around the lowest parts of a gap, about so many cells wide.

    Parameters
    ----------
    gap : ndarray, shape (nx, ny)
        Undeformed gap of the domain. [m]
    extent : int
        Longest side, in cells: as much of what lies low is taken as fits, at least what lies lowest.
    former : Window, optional
        Window that the new one contains, even where it gets longer than ``extent``.

    Returns
    -------
    Window
        With sides that transform well, nowhere at the domain's border and not most of it: the whole of it
        otherwise.
    """
    lowest = [np.min(gap, axis=1), np.min(gap, axis=0)]  # of each row and column
    levels = np.unique(np.concatenate(lowest))
    held = (slice(None, 0), slice(None, 0)) if former is None else former.cells

    def box(level: float) -> list[tuple[int, int]]:
        inside = [side <= level for side in lowest]
        for cells, own in zip(inside, held, strict=True):
            cells[own] = True
        ends = [np.flatnonzero(cells) for cells in inside]
        return [(int(cells[0]), int(cells[-1]) + 1) for cells in ends]

    fits, too_large = 0, len(levels)
    while too_large - fits > 1:
        middle = (fits + too_large) // 2
        inside = max(last - first for first, last in box(float(levels[middle]))) <= extent
        fits, too_large = (middle, too_large) if inside else (fits, middle)
    sides = []
    for (first, last), cells in zip(box(float(levels[fits])), gap.shape, strict=True):
        length = fft.next_fast_len(max(last - first + 2 * _BORDER, _SMALLEST), real=True)
        start = (first + last - length) // 2
        if start <= 0 or start + length >= cells:
            return whole_domain((gap.shape[0], gap.shape[1]))
        sides.append(slice(start, start + length))
    shape = (sides[0].stop - sides[0].start, sides[1].stop - sides[1].start)
    if shape[0] * shape[1] > _LARGEST * gap.size:
        return whole_domain((gap.shape[0], gap.shape[1]))
    beyond = [np.delete(side, cells) for side, cells in zip(lowest, sides, strict=True)]
    outside = float(min(np.min(beyond[0]), np.min(beyond[1])))
    return Window((gap.shape[0], gap.shape[1]), (sides[0].start, sides[1].start), shape, outside)


def mean_influence(window: Window, spacing: tuple[float, float], kernel: Kernel) -> Array:
    """Mean displacement of the domain due to unit pressure on each cell of the window. [m]

    The kernel is symmetric: it is the displacement of that cell under uniform pressure on the domain, a rectangle.
    """
    axes = zip(window.first, window.shape, strict=True)
    before = [np.arange(i, i + m) for i, m in axes]
    after = [n - 1 - cells for cells, n in zip(before, window.domain, strict=True)]
    count = window.domain[0] * window.domain[1]
    return kernel.under_rectangle((before[0], before[1]), (after[0], after[1]), spacing) / count


class FarFieldDisplacement:
    """Displacement of a whole domain under pressure in a window of it: one convolution of their joint length.

    Parameters
    ----------
    window : Window
        Where pressure is.
    spacing : tuple of float
        Cell sides. [m]
    kernel : Kernel
        What the surface does under pressure.
    single : bool
        Whether single precision does: 1e-6 of the largest displacement, in half the time.
    """

    def __init__(self, window: Window, spacing: tuple[float, float], kernel: Kernel, *, single: bool = False) -> None:
        self._window = window
        self._type = np.float32 if single else np.float64
        self._scale = max(spacing)  # the range of single precision is small
        self._transforms = transforms()
        self._points, self._symbol = self._symbol_of(spacing, kernel)

    def _symbol_of(self, spacing: tuple[float, float], kernel: Kernel) -> tuple[tuple[int, int], NDArray[Any]]:
        """Points of the transforms, and the kernel's."""
        window = self._window
        mx, my = (fft.next_fast_len(n + m - 1, real=True) for n, m in zip(window.domain, window.shape, strict=True))
        # signed distance from a cell of the window to one of the domain, wrapped around where the sum is negative
        distances = []
        for first, m, n, length in zip(window.first, window.shape, window.domain, (mx, my), strict=True):
            steps = np.arange(length)
            steps[steps >= n] -= length  # from n - 1 down to 1 - m; what lies between is never read
            distances.append(np.abs(np.clip(steps, 1 - m, n - 1) - first))
        quadrant = kernel.influence((int(distances[0].max()) + 1, int(distances[1].max()) + 1), spacing)
        return (mx, my), fft.rfft2((quadrant[np.ix_(*distances)] / self._scale).astype(self._type))

    def rows(self, pressure: Array) -> Iterator[tuple[slice, Array]]:
        """Displacement of the domain under a pressure in the window over the contact modulus, some rows at a time. [m]

        What is made of them stays in the cache.
        """
        largest = float(np.max(np.abs(pressure), initial=0.0)) or 1.0
        spread = self.spread((pressure / largest).astype(self._type))
        for start in range(0, len(spread), _BLOCK):
            rows = slice(start, start + _BLOCK)
            along_y = self._transforms.rows_back(spread[rows], self._points[1])
            yield rows, np.multiply(along_y[:, : self._window.domain[1]], largest * self._scale, dtype=float)

    def spread(self, pressure: NDArray) -> NDArray:
        """The displacement as its transform along y."""
        nx, (mx, my) = self._window.domain[0], self._points
        along_y = self._transforms.rows(pressure, my)
        spread = np.empty((nx, along_y.shape[1]), along_y.dtype)
        for start in range(0, along_y.shape[1], _BLOCK):
            block = slice(start, start + _BLOCK)
            columns = np.zeros((mx, along_y[:, block].shape[1]), along_y.dtype)
            columns[: len(along_y)] = along_y[:, block]
            columns = self._transforms.columns(columns)
            columns *= self._symbol[:, block]
            spread[:, block] = self._transforms.columns_back(columns)[:nx]
        return spread
