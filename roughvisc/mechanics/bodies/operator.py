"""Influence operator of unit contact compliance: pressure to surface displacement, and back approximately.

An :class:`Operator` knows a grid, its boundary and the kernel of the body, which is a half-space unless another is
given. It knows neither material, time nor contact.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from roughvisc.errors import InputError
from roughvisc.mechanics.arrays import blocks, empty, parallel_map, threads_of
from roughvisc.mechanics.bodies.half_space import HALF_SPACE
from roughvisc.mechanics.bodies.kernel import Kernel, free_space_symbol, periodic_symbol, periodic_waves, wave_limits
from roughvisc.mechanics.bodies.transforms import transforms

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Boundary = Literal["free", "periodic"]

# Bytes of the columns transformed together, but at least so many columns; and at most so many rows and points of them:
# they stay in the cache (measured at 64 to 8192 squared).
_COLUMN_BYTES, _COLUMNS, _ROWS, _ROW_POINTS = 1 << 20, 32, 128, 1 << 18
# A rest of columns is no block of its own below this part of those that are transformed together: one over it.
_SHORT = 8
# Bytes that the processor fetches at once.
_LINE = 64
# Cells from which periodic transforms go by blocks too: at 1024 squared and above they take 0.7 to 0.9 of SciPy's time
# for whole fields, and as long as ducc0's; below they are slower.
_BLOCKED = 1024**2
# Cells a side of a block.
_BLOCK = 8


class _Work(NamedTuple):
    """Working memory of the transforms: the spectrum, a buffer pair (rows, columns) for each thread, and the blocks."""

    spectrum: NDArray[Any]
    rooms: list[tuple[NDArray[Any], NDArray[Any]]]
    rows: tuple[slice, ...]
    columns: tuple[slice, ...]


class Operator:
    """From pressure to displacement on a grid: convolution with a body's kernel, a half-space's by default.

    Of unit contact compliance, sampled by equal rectangular cells.

    Not for two threads at once: the transforms share their working memory from one call to the next.

    Parameters
    ----------
    shape : tuple of int
        Number of cells ``(nx, ny)``.
    spacing : tuple of float
        Cell sides ``(dx, dy)``. [m]
    boundary : {"free", "periodic"}
        Free space (nothing outside the grid is loaded) or one period of an endless surface.
    workers : int, optional
        Threads of the transforms on large grids; None: as ``scipy.fft.set_workers`` has it, one where nobody has
        set it. Smaller grids are slower with several, and get one.
    mirrored : bool
        Whether the cells are a quarter of the surface: beyond the first row and the first column their mirror images
        carry the same pressure. All of it is displaced by all of them.
    kernel : Kernel
        What the surface does under pressure.
    """

    def __init__(
        self,
        shape: tuple[int, int],
        spacing: tuple[float, float],
        boundary: Boundary = "free",
        workers: int | None = None,
        *,
        mirrored: bool = False,
        kernel: Kernel = HALF_SPACE,
    ) -> None:
        if boundary not in ("free", "periodic"):
            raise InputError(f"boundary is {boundary!r}: expected 'free' or 'periodic'")
        self.shape = shape
        #: Number of cells.
        self.size = shape[0] * shape[1]
        self.spacing = spacing
        self.boundary = boundary
        self.mirrored = mirrored
        self.kernel = kernel
        self.workers = workers
        self._transforms = transforms(mirrored)
        #: Area that one cell stands for, its mirror images included. [m2]
        self.cell_area = self._transforms.images**2 * spacing[0] * spacing[1]
        #: Number of cells of the surface, mirror images included.
        self.surface_shape = (self._transforms.images * shape[0], self._transforms.images * shape[1])
        if boundary == "free":
            padded = [2 * fft.next_fast_len(n, real=True) for n in self.surface_shape]
            symbol = free_space_symbol(kernel, (padded[0], padded[1]), spacing)
            self._points = (padded[0] // self._transforms.images, padded[1] // self._transforms.images)
        else:
            symbol = periodic_symbol(kernel, self.surface_shape, spacing)
            self._points = shape
        #: Whether every pressure displaces the surface, a uniform one too.
        self.definite = boundary == "free" or float(symbol[0, 0]) > 0
        self._symbol = self._transforms.cropped(symbol, self._points)
        self._work: dict[tuple[tuple[int, int], np.dtype[Any]], _Work] = {}
        #: Number of convolutions so far, applications of the inverse included.
        self.convolutions = 0

    def symbol_of(self, kernel: Kernel) -> Array:
        """Symbol of another kernel on these cells, of either sign. [m]"""
        if self.boundary == "free":
            images = self._transforms.images
            padded = (images * self._points[0], images * self._points[1])
            return self._transforms.cropped(free_space_symbol(kernel, padded, self.spacing), self._points)
        waves = periodic_waves(self.surface_shape, self.spacing)
        return self._transforms.cropped(np.asarray(kernel.transfer(*waves), dtype=float), self._points)

    def answering(self, symbol: Array, kernel: Kernel) -> Operator:
        """The same cells, working memory and boundary with another kernel, of which :meth:`symbol_of` is known."""
        other = Operator.__new__(Operator)
        other.__dict__ |= {name: value for name, value in self.__dict__.items() if name not in _OF_SYMBOL}
        other.kernel, other._symbol = kernel, symbol
        other.definite = self.boundary == "free" or float(symbol[0, 0]) > 0
        return other

    @property
    def wave_numbers(self) -> tuple[float, float]:
        """Of the longest and of the shortest wave of the cells. [1/m]"""
        return wave_limits(self.surface_shape, self.spacing)

    def spectrum(self, field: Array) -> NDArray[Any]:
        """Transform of a field on these cells, zero beyond them."""
        if self._points != self.shape:
            padded = np.zeros(self._points)
            padded[: self.shape[0], : self.shape[1]] = field
            field = padded
        return self._transforms.of_field(field, workers=self.threads)

    def field_of(self, spectrum: NDArray[Any]) -> Array:
        """The field of a transform, which is used up."""
        found = self._transforms.field_back(spectrum, s=self._points, overwrite_x=True, workers=self.threads)
        return np.ascontiguousarray(found[: self.shape[0], : self.shape[1]])

    def multiply(self, spectrum: NDArray[Any], symbol: Array) -> None:
        """Multiply a transform by a symbol, in place."""
        self._transforms.multiply(spectrum, symbol)

    @cached_property
    def parseval(self) -> Array:
        """Factors whose sum over a transform times the conjugate of another is the area integral of both. [m2]

        Of a pressure and the displacement by one, on the cells; beyond them the pressure is zero.
        """
        (mx, my), images = self._points, self._transforms.images
        if images > 1:  # of cosines
            along = [np.where(np.arange(points) == 0, 0.25, 0.5) / points for points in (mx, my)]
            return np.asarray(np.outer(*along) * self.cell_area)
        twice = np.full(my // 2 + 1, 2.0)  # waves of which the conjugates are not stored
        twice[0] = 1.0
        if my % 2 == 0:
            twice[-1] = 1.0
        return np.asarray(np.broadcast_to(twice, (mx, my // 2 + 1)) * (self.cell_area / (mx * my)))

    def even_sum(self, field: Array, symbol: Array) -> float:
        """Sum of a field of wave numbers times a symbol, which is the same for negative ones along x."""
        first = len(symbol)
        total = float(np.einsum("ij,ij", field[:first], symbol))
        if len(field) > first:
            total += float(np.einsum("ij,ij", field[first:], symbol[len(field) - first : 0 : -1]))
        return total

    def turn(self, cells: int, axis: int) -> NDArray[np.complex128]:
        """What the transform of a periodic field is multiplied by if it is seen from so many cells farther."""
        if self.mirrored or self.boundary != "periodic":
            raise ValueError("only periodic fields without mirror images turn")
        count = self.shape[axis]
        waves = fft.fftfreq(count, 1 / count) if axis == 0 else fft.rfftfreq(count, 1 / count)
        phases = np.exp(2j * np.pi * cells / count * waves)
        return phases[:, None] if axis == 0 else phases

    def on(self, shape: tuple[int, int]) -> Operator:
        """The same body, boundary, symmetry and extent on another number of cells."""
        (nx, ny), (mx, my), (dx, dy) = self.shape, shape, self.spacing
        spacing = dx * (nx / mx), dy * (ny / my)
        return Operator(shape, spacing, self.boundary, mirrored=self.mirrored, kernel=self.kernel)

    @property
    def threads(self) -> int:
        """How many threads work on one field."""
        return threads_of(self.size, self.workers)

    @cached_property
    def coarse(self) -> Operator:
        """The same body on blocks of some cells a side, of the same period."""
        return self.on((-(-self.shape[0] // _BLOCK), -(-self.shape[1] // _BLOCK)))

    @cached_property
    def block_of_cell(self) -> NDArray[np.int32]:
        """Block of each cell, as flat indices."""
        rows, columns = (np.arange(n) * m // n for n, m in zip(self.shape, self.coarse.shape, strict=True))
        return (rows[:, None] * self.coarse.shape[1] + columns).astype(np.int32).reshape(-1)

    @cached_property
    def stiffest(self) -> float:
        """Largest eigenvalue of the influence matrix, or a bound on it. [m]"""
        return float(np.max(self._symbol)) or self.spacing[0]

    @cached_property
    def self_influence(self) -> float:
        """Displacement of a cell under unit pressure on it alone, and on its mirror images. [m]"""
        along_x, along_y = (self._waves(points) for points in self._points)
        return float(((self._symbol * along_y).sum(axis=1) * along_x).sum())

    def _waves(self, points: int) -> Array:
        """How much of each wave number's response one cell of so many meets, under pressure on it and its images."""
        count = self._transforms.images * points
        number = np.arange(self._transforms.width(points))
        each = np.where((number == 0) | (2 * number == count), 1.0, 2.0) / count  # negative wave numbers too
        return each * (1 + np.cos(2 * np.pi * number / count)) if self.mirrored else each

    def displacement(self, pressure: Array, out: Array | None = None) -> Array:
        """Surface displacement under a pressure: one convolution.

        Parameters
        ----------
        pressure : ndarray, shape (nx, ny)
            Pressure over the contact modulus. [-]
        out : ndarray, shape (nx, ny), optional
            Memory for what is returned, which large grids use.

        Returns
        -------
        ndarray, shape (nx, ny)
            Displacement; with periodic boundaries the mean of a half-space's is zero. In single precision if the
            pressure is. [m]
        """
        self.convolutions += 1
        symbol = self._single_symbol if pressure.dtype == np.float32 else self._symbol_by_columns
        return self._convolved(pressure, symbol, self._points, out)

    @cached_property
    def _symbol_by_columns(self) -> list[NDArray[Any]]:
        return self._by_columns(self._symbol, self._points)

    @cached_property
    def _single_symbol(self) -> list[NDArray[Any]]:
        return self._by_columns(self._symbol.astype(np.float32), self._points)

    def _by_columns(self, symbol: NDArray[Any], points: tuple[int, int]) -> list[NDArray[Any]]:
        """A symbol by the columns that are transformed together; whole where whole fields are.

        In single precision, in which most is computed, those of a block lie together: to fetch them from rows that are
        far apart takes as long as half of a transform.
        """
        if points == self.shape and not self._goes_by_blocks:
            return [symbol]
        number = np.result_type(symbol.dtype, np.complex64) if self._transforms.is_complex else symbol.dtype
        parts = [symbol[:, block] for block in _column_blocks(symbol.shape[1], points[0], number)]
        return [np.ascontiguousarray(part) for part in parts] if symbol.dtype == np.float32 else parts

    @property
    def _goes_by_blocks(self) -> bool:
        """Whether transforms on the cells themselves do."""
        return self.size >= _BLOCKED

    def _convolved(
        self,
        field: NDArray[Any],
        symbol: list[NDArray[Any]],
        points: tuple[int, int],
        out: NDArray[Any] | None = None,
    ) -> NDArray[Any]:
        """Convolution on so many points, in the precision of the symbol."""
        if points == self.shape and not self._goes_by_blocks:
            return self._whole(field, symbol)
        found = empty(self.shape, symbol[0].dtype) if out is None else out
        self._by_blocks(field, symbol, points, found)
        return found

    def _by_blocks(
        self,
        field: NDArray[Any],
        symbol: list[NDArray[Any]],
        points: tuple[int, int],
        found: NDArray[Any],
    ) -> None:
        """Convolution on so many points, in the precision of the symbol.

        Pruned: only the loaded rows are transformed along y, and only the wanted ones back; between, blocks of columns
        go forward, are multiplied and come back while they stay in the cache.
        """
        along, nx, threads = self._transforms, self.shape[0], self.threads
        work = self._work_on(points, symbol[0].dtype)
        spectrum, rooms = work.spectrum, work.rooms[:threads]  # each thread takes a room, and puts it back
        own = points[0] == nx  # columns stay where they are unless there are more points of them

        def forward(rows: slice) -> None:
            room = rooms.pop()
            along.rows_into(spectrum[rows], field[rows], room[0][: rows.stop - rows.start])
            rooms.append(room)

        def across(number_of_block: int) -> None:
            block = work.columns[number_of_block]
            room = rooms.pop()
            columns = there = spectrum[:, block]
            if not own:
                columns = room[1][:, : block.stop - block.start]
                columns[:nx] = there
                columns[nx:] = 0
            changed = along.of_columns(columns, axis=0, overwrite_x=True, workers=1)
            along.multiply(changed, symbol[number_of_block])
            changed = along.columns_back(changed, axis=0, overwrite_x=True, workers=1)
            if changed is not there:
                there[...] = changed[:nx]
            rooms.append(room)

        def back(rows: slice) -> None:
            room = rooms.pop()
            here = room[0][: rows.stop - rows.start]
            along.rows_back_into(found[rows], spectrum[rows], here)
            rooms.append(room)

        parallel_map(forward, work.rows, threads)
        parallel_map(across, range(len(work.columns)), threads)
        parallel_map(back, work.rows, threads)

    def _work_on(self, points: tuple[int, int], kind: np.dtype[Any]) -> _Work:
        """What transforms of so many points in one precision work in."""
        work = self._work.get((points, kind))
        if work is None:
            number = np.result_type(kind, np.complex64) if self._transforms.is_complex else kind
            memory, rooms = self._memory
            spectrum = _as(memory, number, (self.shape[0], self._transforms.width(points[1])))
            rows = tuple(blocks(self.shape[0], _rows_together(points[1])))
            columns = _column_blocks(spectrum.shape[1], points[0], number)
            most, widest = rows[0].stop, max(block.stop - block.start for block in columns)
            parts = [(_as(room, kind, (most, points[1])), _as(room, number, (points[0], widest))) for room in rooms]
            work = _Work(spectrum, parts, rows, columns)
            self._work[points, kind] = work
        return work

    @cached_property
    def _memory(self) -> tuple[NDArray[np.uint8], list[NDArray[np.uint8]]]:
        """Bytes to work in: taken anew each time, half of it is page faults."""
        (mx, my), kinds = self._points, (complex, np.complex64) if self._transforms.is_complex else (float, np.float32)
        count, room = self._transforms.width(my), _bytes(np.dtype(float), (min(_rows_together(my), self.shape[0]), my))
        number, single = (np.dtype(kind) for kind in kinds)
        for kind in (number, single):
            for block in _column_blocks(count, mx, kind):
                room = max(room, _bytes(kind, (mx, block.stop - block.start)))
        return _lines(_bytes(number, (self.shape[0], count))), [_lines(room) for _ in range(self.threads)]

    def inverse(self, displacement: Single) -> Single:
        """Pressure that causes about this displacement: the preconditioner of the contact solver.

        Parameters
        ----------
        displacement : ndarray of float32, shape (nx, ny)
            Of ordinary size: single precision underflows. [m]

        Returns
        -------
        ndarray of float32, shape (nx, ny)
            Pressure over the contact modulus. [-]

        Notes
        -----
        The inverse of the periodic kernel on the unpadded grid also where space is free: symmetric and
        positive definite, wrong only by what wraps around, at a fifth of the cost of a padded convolution.
        """
        self.convolutions += 1
        return self._convolved(displacement, self._inverse_symbol, self.shape)

    @cached_property
    def _inverse_symbol(self) -> list[NDArray[Any]]:
        if self.boundary == "periodic" and not self.mirrored:  # that of a mirrored surface lacks its shortest waves
            symbol = self._symbol.copy()
        else:
            symbol = periodic_symbol(self.kernel, self.surface_shape, self.spacing)
        symbol[0, 0] = symbol[0, 0] or np.max(symbol) or self.spacing[0]
        np.divide(1, symbol, out=symbol)
        return self._by_columns(self._transforms.cropped(symbol, self.shape).astype(np.float32), self.shape)

    def _whole(self, field: NDArray[Any], symbol: list[NDArray[Any]]) -> NDArray[Any]:
        """Convolution on the cells themselves at once."""
        [whole] = symbol
        field_q = self._transforms.of_field(field, workers=1)
        self._transforms.multiply(field_q, whole)
        return self._transforms.field_back(field_q, s=self.shape, overwrite_x=True, workers=1)


#: What an operator has found of its symbol.
_OF_SYMBOL = {name for name, value in vars(Operator).items() if isinstance(value, cached_property)}


def _rows_together(points: int) -> int:
    """Rows of so many points that are transformed together."""
    return min(_ROWS, max(_ROW_POINTS // points, 1))


@lru_cache(maxsize=32)
def _column_blocks(count: int, points: int, number: np.dtype[Any]) -> tuple[slice, ...]:
    """Columns of so many numbers that are transformed together; a short rest goes with the last ones.

    Of 2^n points there are 2^(n-1) + 1 columns: with one column as a block of its own, a thread would wait for another.
    """
    together = max(_COLUMN_BYTES // (points * number.itemsize), _COLUMNS)
    begins = range(0, max(count - together // _SHORT, 1), together)
    return tuple(slice(first, count if first == begins[-1] else first + together) for first in begins)


def _as(memory: NDArray[np.uint8], number: np.dtype[Any], shape: tuple[int, int]) -> NDArray[Any]:
    """The first bytes of some memory as an array, whose rows do not lie a power of two apart.

    Of rows that do, the processor keeps few in its cache: transforms of them take up to three times as long.
    """
    row = _row_bytes(number, shape[1])
    return memory[: shape[0] * row].view(number).reshape(shape[0], -1)[:, : shape[1]]


def _lines(size: int) -> NDArray[np.uint8]:
    """So many bytes, from the beginning of a line: no line belongs to the columns of two threads."""
    memory = np.empty(size + _LINE, np.uint8)
    first = -memory.ctypes.data % _LINE
    return memory[first : first + size]


def _bytes(number: np.dtype[Any], shape: tuple[int, int]) -> int:
    """Bytes of such an array."""
    return shape[0] * _row_bytes(number, shape[1])


def _row_bytes(number: np.dtype[Any], count: int) -> int:
    """An odd number of lines for each row."""
    return (-(-count * number.itemsize // _LINE) | 1) * _LINE
