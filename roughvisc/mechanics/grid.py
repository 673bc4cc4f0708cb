"""Cells on which pressure acts: convolution with the kernel of a body, and its approximate inverse.

Three boundaries:

- ``free``: the surface outside the grid carries no pressure. Zero padding makes the convolution linear.
- ``periodic``: the grid is one period of an endless surface.
- ``mirror``: the surface and its mirror images repeat. Cosine transforms (type 2) need the cells of the surface only.

Displacements are per unit contact compliance ``C = 1/E*``. Fields are arrays of NumPy, or of CuPy if ``xp`` is CuPy.
"""

from __future__ import annotations

import math
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from typing import Any, Literal

import numpy as np
import scipy

from roughvisc.errors import InputError
from roughvisc.mechanics.body import HALF_SPACE, Kernel, periodic_symbol
from roughvisc.mechanics.heap import keep_freed_memory

try:
    import ducc0
except ImportError:
    ducc0 = None

Array = Any  # an array of NumPy or CuPy
Boundary = Literal["free", "periodic", "mirror"]

#: Number of rows in a block of rows; bytes of a block of columns, and its least number of columns. A block is
#: transformed in one call and fits in the cache: whole fields take up to 1.5 times as long (64 to 1,024 squared).
ROWS = 128
COLUMN_BYTES = 1 << 18
COLUMNS = 32
#: Cells of a field from which blocks are transformed on several threads, and periodic fields in blocks at all: each
#: block has the same bits on any number of threads. Measured: slower at 512 squared, faster at 1024.
THREADED_FROM = 1024**2
#: Unused elements after each row of a work array: rows a power of two apart take a tenth more time at 1,024 squared.
APART = 16
#: Cells a side of a block of the coarse grid.
COARSE = 8

keep_freed_memory()


def namespace(array: Array) -> Any:
    """Return the module whose functions work on an array: NumPy, or CuPy for an array on a device."""
    if isinstance(array, np.ndarray):
        return np
    import cupy

    return cupy


def arrays_of(device: str) -> Any:
    """Return the module whose arrays a device computes with: NumPy, or CuPy for a GPU.

    Parameters
    ----------
    device : {"cpu", "gpu"}
        Where fields are computed.

    Raises
    ------
    InputError
        If CuPy is not installed, or finds no GPU or no libraries of CUDA.
    """
    if device == "cpu":
        return np
    try:
        import cupy

        for library in (cupy.cuda.nvrtc, cupy.cuda.cufft):
            library.getVersion()  # loads it
        if cupy.cuda.runtime.getDeviceCount() > 0:
            return cupy
        problem = "CuPy finds none on this machine"
    except (ImportError, RuntimeError) as error:  # RuntimeError: of the libraries and the driver of CUDA
        problem = str(error).splitlines()[0]
    expected = f"'cpu', or a GPU with CuPy, pip install 'roughvisc[gpu]' ({problem})"
    raise InputError(key="device", found="gpu", expected=expected)


def to_host(array: Array) -> Any:
    """Return an array of NumPy: the array itself, or a copy of an array on a device. A packed field stays packed."""
    return array if isinstance(array, np.ndarray) else array.get()


class Grid:
    """Rectangular cells of a body's surface. Two threads may not use one grid at the same time.

    Parameters
    ----------
    shape : tuple of int
        Number of cells ``(nx, ny)``.
    spacing : tuple of float
        Cell sides ``(dx, dy)``. [m]
    boundary : {"free", "periodic", "mirror"}
        Surface outside the grid.
    kernel : Kernel
        Displacement of the body's surface under pressure.
    symbol : array, optional
        Transform of the kernel, if known. [m]
    xp : module
        NumPy, or CuPy for a grid on a device.

    Attributes
    ----------
    points : tuple of int
        Points of the transforms: in free space at least twice the cells.
    period : tuple of int
        Cells of a period, mirror images included; the cells in free space.
    size : int
        Number of cells.
    cell_area : float
        Area of a cell. [m2]
    symbol : array
        Transform of the kernel. [m]
    definite : bool
        Whether a uniform pressure displaces the surface.
    largest_eigenvalue : float
        Displacement over pressure of the most compliant wave, or a bound on it; a cell side if no wave is known. [m]
    self_influence : float
        Displacement of a cell under unit pressure on that cell alone: the mean eigenvalue. On a mirrored surface, the
        mean over all cells. [m]
    convolutions : int
        Number of convolutions so far, applications of the inverse included.

    Raises
    ------
    InputError
        If the grid is impossible or the kernel's transfer function is not positive.
    """

    def __init__(
        self,
        shape: tuple[int, int],
        spacing: tuple[float, float],
        boundary: Boundary = "free",
        *,
        kernel: Kernel = HALF_SPACE,
        symbol: Array | None = None,
        xp: Any = np,
    ) -> None:
        self.shape = shape
        self.spacing = spacing
        self.boundary = boundary
        self.kernel = kernel
        self.xp = xp
        images = 2 if boundary == "mirror" else 1
        self.period = images * shape[0], images * shape[1]
        self.size = shape[0] * shape[1]
        self.cell_area = spacing[0] * spacing[1]
        self.points = shape
        fast = scipy.fft.next_fast_len
        if boundary == "free":
            self.points = 2 * fast(shape[0], real=True), 2 * fast(shape[1], real=True)
        self.symbol = xp.asarray(self.symbol_of(kernel) if symbol is None else symbol)
        self.definite = boundary == "free" or float(self.symbol[0, 0]) > 0
        self.largest_eigenvalue = float(self.symbol.max()) or spacing[0]
        number = np.arange(self.symbol.shape[1])  # of the wave along y; also counts the negative number
        twice = (boundary != "mirror") & (number > 0) & (2 * number < self.points[1])
        self.self_influence = float((self.symbol.sum(axis=0) * xp.asarray(1.0 + twice)).sum()) / math.prod(self.points)
        self.convolutions = 0
        self._transforms = transforms(self.size, xp)
        self._block_transforms = transforms(xp=xp)
        #: Work array that all convolutions reuse. At 2,048 squared a new array for each would take up to a third of the
        #: processor time.
        self._work: Array | None = None
        #: Symbol of the inverse, computed when it is first needed.
        self._inverse: Array | None = None
        #: Whether a convolution calls cuFFT, which has no plans if a side is one cell, and does not normalise.
        self._by_cufft = boundary == "periodic" and hasattr(xp, "RawKernel") and 1 not in shape
        self._acting = self.symbol / self.size if self._by_cufft else self.symbol
        if xp is np and boundary != "mirror" and self.size < THREADED_FROM // 4:
            # NumPy would convert it in each product; a larger one would take too much memory
            self._acting = self.symbol.astype(complex)

    # ----------------------------------------------------------------------------------------- other grids and kernels

    def on(self, shape: tuple[int, int]) -> Grid:
        """Return a grid of the same body, boundary and extent with another number of cells."""
        nx, ny = self.shape
        mx, my = shape
        dx, dy = self.spacing
        return Grid(shape, (dx * (nx / mx), dy * (ny / my)), self.boundary, kernel=self.kernel, xp=self.xp)

    @cached_property
    def coarse(self) -> Grid:
        """Grid of blocks of about 8 by 8 cells."""
        return self.on((-(-self.shape[0] // COARSE), -(-self.shape[1] // COARSE)))

    @cached_property
    def block_of_cell(self) -> Array:
        """Block of each cell on the coarse grid, as flat indices."""
        xp = self.xp
        rows, columns = (xp.arange(n) * m // n for n, m in zip(self.shape, self.coarse.shape, strict=True))
        return (rows[:, None] * self.coarse.shape[1] + columns).astype(np.int32).reshape(-1)

    def symbol_of(self, kernel: Kernel, is_whole: bool = True) -> np.ndarray:
        """Return the transform of a kernel, see :func:`~roughvisc.mechanics.body.periodic_symbol`. [m]

        Notes
        -----
        In free space the kernel fills every offset of the padded grid, even the offset at half its length, at which no
        pair of cells lies. With a zero there the symbol becomes negative for slender cells (aspect 16: -1.5), and its
        inverse is useless as a preconditioner.
        """
        if self.boundary == "free":
            offsets = self.points[0] // 2 + 1, self.points[1] // 2 + 1
            symbol = scipy.fft.dctn(kernel.influence(offsets, self.spacing), type=1)  # of the even extension
            return np.concatenate([symbol, symbol[-2:0:-1]])
        symbol = periodic_symbol(kernel, self.period, self.spacing, is_whole)
        # without the shortest waves of a mirrored surface, which are zero at the cells
        return np.ascontiguousarray(symbol[: self.shape[0], : self.shape[1]])

    # ------------------------------------------------------------------------------------------------- displacement

    def displacement(self, pressure: Array) -> Array:
        """Return the displacement under a pressure, per unit contact compliance: one convolution. [m]

        Under periodic and mirror boundaries the mean displacement of a half-space is zero.
        """
        return self._convolved(pressure, self._acting, self.points)

    def inverse(self, displacement: Array) -> Array:
        """Return approximately the pressure that causes a displacement, in single precision.

        This is the inverse of the periodic kernel on the cells, or of the mirror kernel. In free space its only error
        is the wrap-around. It is symmetric and positive definite. It costs a sixth of a convolution in free space, and
        half of one or more otherwise.

        Parameters
        ----------
        displacement : array of float32, shape (nx, ny)
            Displacement, scaled to about one, because single precision underflows. [m]
        """
        if self._inverse is None:
            symbol = self.symbol.copy()
            if self.boundary == "free":
                symbol = self.xp.asarray(periodic_symbol(self.kernel, self.shape, self.spacing))
            symbol[0, 0] = float(symbol[0, 0]) or float(symbol.max()) or self.spacing[0]
            number = np.complex64 if self._acting.dtype == complex else np.float32
            self._inverse = (1 / symbol / (self.size if self._by_cufft else 1)).astype(number)
        return self._convolved(displacement, self._inverse, self.shape)

    def _convolved(self, field: Array, symbol: Array, points: tuple[int, int]) -> Array:
        """Return the convolution of a field with a symbol on a number of points."""
        self.convolutions += 1
        fft = self._transforms
        if self.boundary == "mirror":
            return fft.cosines_back(fft.cosines(field) * symbol)
        if self._by_cufft:
            return convolved_by_cufft(fft.fft, field, symbol)
        if points == self.shape and self.size < THREADED_FROM:
            spectrum = fft.waves(field)
            spectrum *= symbol
            return fft.waves_back(spectrum, points)
        # Zeros are not transformed along y. Blocks of rows and of columns stay in the cache, each on one thread.
        nx, ny = self.shape
        count = points[1] // 2 + 1
        fft = self._block_transforms
        threads = self._transforms.threads
        if self._work is None:
            self._work = self.xp.empty(nx * (self.points[1] // 2 + 1), np.complex128)
        spectrum = self._work.view(np.result_type(field.dtype, np.complex64))[: nx * count].reshape(nx, count)
        convolved = self.xp.empty((nx, ny), field.dtype)
        rows = ROWS
        columns = max(COLUMN_BYTES // (points[0] * spectrum.itemsize), COLUMNS)
        if self.xp is not np:
            rows = nx
            columns = count

        def transform_rows(block: slice) -> None:
            spectrum[block] = fft.waves(field[block], points[1:], axes=(1,))

        def convolve_columns(block: slice) -> None:
            waves = self.xp.empty((points[0], spectrum[:1, block].size), spectrum.dtype)
            waves[:nx] = spectrum[:, block]
            waves[nx:] = 0
            waves = fft.columns(waves)
            waves *= symbol[:, block]
            spectrum[:, block] = fft.columns(waves, back=True)[:nx]

        def rows_back(block: slice) -> None:
            convolved[block] = fft.waves_back(spectrum[block], points[1:], axes=(1,))[:, :ny]

        run = map if threads == 1 else _pool(threads).map
        for work, total, width in (transform_rows, nx, rows), (convolve_columns, count, columns), (rows_back, nx, rows):
            blocks = map(slice, range(0, total, width), range(width, total + width, width))
            list(run(work, blocks))  # waits for all blocks, and raises an error of a block again
        return convolved

    # ----------------------------------------------------------------------------------------------------- transforms

    def spectrum(self, field: Array) -> Array:
        """Return the transform of a field, zero beyond the cells."""
        if self.boundary == "mirror":
            return self._transforms.cosines(field)
        if self.points != self.shape:
            field = self.xp.pad(field, [(0, m - n) for n, m in zip(self.shape, self.points, strict=True)])
        return self._transforms.waves(field)

    def field_of(self, spectrum: Array) -> Array:
        """Return the field of a transform, which is overwritten."""
        if self.boundary == "mirror":
            return self._transforms.cosines_back(spectrum)
        field = self._transforms.waves_back(spectrum, self.points)
        return self.xp.ascontiguousarray(field[: self.shape[0], : self.shape[1]])

    def filtered(self, field: Array, factors: Array) -> Array:
        """Return a field on all points of the transforms, each wave multiplied by a factor: one convolution."""
        self.convolutions += 1
        fft = self._transforms
        if self.boundary == "mirror":
            return fft.cosines_back(fft.cosines(field) * factors)
        spectrum = fft.waves(field)
        spectrum *= factors
        return fft.waves_back(spectrum, self.points)

    def turn(self, cells: int, axis: int) -> Array:
        """Return the factors of the transform of a periodic field for a shift of the field back by `cells`."""
        count = self.shape[axis]
        waves = np.fft.fftfreq(count, 1 / count) if axis == 0 else np.fft.rfftfreq(count, 1 / count)
        phases = np.exp(2j * np.pi * cells / count * waves)
        return self.xp.asarray(phases[:, None] if axis == 0 else phases)


# ---------------------------------------------------------------------------------------------------------- threads


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    """Return threads that all convolutions share: new ones would take a tenth of the processor time."""
    return ThreadPoolExecutor(threads, thread_name_prefix="roughvisc")


if hasattr(os, "register_at_fork"):  # a forked process has none of the threads
    os.register_at_fork(after_in_child=_pool.cache_clear)


# ------------------------------------------------------------------------------------------------------- transforms


@dataclass(frozen=True)
class Transforms:
    """Transforms along both axes, or one, by SciPy, or by CuPy. The way back may overwrite its argument.

    Attributes
    ----------
    fft : module
        Functions of the transforms.
    threads : int
        Threads that work on one field.
    settings : dict
        Argument of the functions that sets the threads, if they have one.
    """

    fft: Any
    threads: int
    settings: dict[str, int]

    def waves(self, field: Array, points: tuple[int, ...] | None = None, axes: tuple[int, ...] = (0, 1)) -> Array:
        """Return the Fourier transform of a field at non-negative wave numbers along y.

        With ``points`` and ``axes=(1,)`` the field is padded with zeros along y.
        """
        return self.fft.rfftn(field, s=points, axes=axes, **self.settings)

    def waves_back(self, spectrum: Array, points: tuple[int, ...], axes: tuple[int, ...] = (0, 1)) -> Array:
        """Return the field of a Fourier transform."""
        return self.fft.irfftn(spectrum, s=points, axes=axes, overwrite_x=True, **self.settings)

    def columns(self, spectrum: Array, back: bool = False) -> Array:
        """Return the Fourier transform along x, or the inverse one, which may overwrite the spectrum."""
        transform = self.fft.ifft if back else self.fft.fft
        return transform(spectrum, axis=0, overwrite_x=True, **self.settings)

    def cosines(self, field: Array) -> Array:
        """Return the cosine transform, type 2."""
        return self.fft.dctn(field, type=2, **self.settings)

    def cosines_back(self, spectrum: Array) -> Array:
        """Return the field of a cosine transform."""
        return self.fft.idctn(spectrum, type=2, overwrite_x=True, **self.settings)


class DuccTransforms(Transforms):
    """Transforms by ducc0, which are faster."""

    def waves(self, field: Array, points: tuple[int, ...] | None = None, axes: tuple[int, ...] = (0, 1)) -> Array:
        if points is not None:
            longer = np.empty((len(field), points[0] + APART), field.dtype)[:, : points[0]]
            longer[:, : field.shape[1]] = field
            longer[:, field.shape[1] :] = 0
            field = longer
        return self.fft.r2c(field, axes=axes, **self.settings)

    def waves_back(self, spectrum: Array, points: tuple[int, ...], axes: tuple[int, ...] = (0, 1)) -> Array:
        back = {"forward": False, "inorm": 2, "allow_overwriting_input": True, **self.settings}
        count = points[-1]
        out = np.empty((len(spectrum), count + APART), spectrum.real.dtype)[:, :count] if axes == (1,) else None
        return self.fft.c2r(spectrum, axes=axes, lastsize=count, out=out, **back)

    def columns(self, spectrum: Array, back: bool = False) -> Array:
        return self.fft.c2c(spectrum, (0,), forward=not back, inorm=2 if back else 0, out=spectrum, **self.settings)

    def cosines(self, field: Array) -> Array:
        return self.fft.dct(field, type=2, axes=(0, 1), **self.settings)

    def cosines_back(self, spectrum: Array) -> Array:
        return self.fft.dct(spectrum, type=3, axes=(0, 1), inorm=2, out=spectrum, **self.settings)


def convolved_by_cufft(fft: Any, field: Array, symbol: Array) -> Array:
    """Return the convolution of a field with a symbol that contains the factor of the inverse transform.

    It calls cuFFT: small transforms take less time than by the functions of CuPy.
    """
    forward, back = _plans(fft, field.shape, field.dtype.char)
    field = field if field.flags.c_contiguous else field.copy()
    spectrum = forward.get_output_array(field)
    forward.fft(field, spectrum, _FORWARD)
    spectrum *= symbol
    convolved = back.get_output_array(spectrum)
    back.fft(spectrum, convolved, _BACK)  # overwrites the spectrum
    return convolved


#: Directions of cuFFT.
_FORWARD = -1
_BACK = 1


@lru_cache(maxsize=16)
def _plans(fft: Any, shape: tuple[int, int], number: str) -> tuple[Any, Any]:
    """Return the plans of cuFFT for a real field of some precision, and for its transform."""
    import cupy

    field = cupy.empty(shape, number)
    spectrum = cupy.empty((shape[0], shape[1] // 2 + 1), np.result_type(number, np.complex64))
    return fft.get_fft_plan(field, value_type="R2C"), fft.get_fft_plan(spectrum, shape=shape, value_type="C2R")


def transforms(size: int = 0, xp: Any = np) -> Transforms:
    """Return the transforms of a field: by ducc0 if it is installed and not refused, by SciPy, or by CuPy.

    Parameters
    ----------
    size : int
        Number of cells. Large fields of NumPy take the threads of ``scipy.fft.set_workers``.
    xp : module
        NumPy or CuPy.
    """
    if xp is not np:
        return Transforms(fft_of(xp), 1, {})
    threads = scipy.fft.get_workers() if size >= THREADED_FROM else 1
    if ducc0 is not None and os.environ.get("ROUGHVISC_TRANSFORMS") != "scipy":
        return DuccTransforms(ducc0.fft, threads, {"nthreads": threads})
    return Transforms(scipy.fft, threads, {"workers": threads})


def fft_of(xp: Any) -> Any:
    """Return ``scipy.fft``, or the module of CuPy with the same functions."""
    if xp is np:
        return scipy.fft
    from cupyx.scipy import fft

    return fft


def transform_library() -> str:
    """Return names and versions of the libraries that determine the last digits of results.

    Results are identical to the last bit only if these are the same. SciPy also transforms the sampled kernels.
    """
    engine = f"ducc0 {ducc0.__version__}, scipy" if isinstance(transforms(), DuccTransforms) else "scipy.fft"
    return f"{engine} {scipy.__version__}, numpy {np.__version__}"
