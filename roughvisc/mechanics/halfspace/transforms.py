"""Real Fourier transforms of whole and of mirror-symmetric fields, and the layout of their symbols.

A field on half an axis that goes on as its mirror image beyond its first cell has a transform of cosines alone: real,
and of half the length. In both axes that is a quarter of the numbers.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy import fft

from roughvisc.mechanics.halfspace import ducc

Array = NDArray[np.float64]

# Rows that are transformed together; but eight long ones in single precision by ducc0, which takes as many into its
# registers: where rows lie a power of two apart, more take twice as long (measured at 1024 to 8192 points; three times
# as long, back from 8192). Of shorter rows, and in double precision, more are faster.
_ROWS, _LONG = 128, 1024


@dataclass(frozen=True)
class Transforms:
    """One kind of transform, with the signatures of ``scipy.fft``.

    Attributes
    ----------
    images : int
        Cells along an axis that one cell stands for.
    of_rows, of_columns, rows_back, columns_back : callable
        Along y, then along x, and back.
    of_field, field_back : callable
        Along both.
    is_complex : bool
        Whether what they give is.
    fills : bool
        Whether those of rows take an array, as ``out``, to write what they give into.
    long_rows : int
        Long rows in single precision that are transformed together.
    """

    images: int
    of_rows: Callable[..., NDArray[Any]]
    of_columns: Callable[..., NDArray[Any]]
    rows_back: Callable[..., NDArray[Any]]
    columns_back: Callable[..., NDArray[Any]]
    of_field: Callable[..., NDArray[Any]]
    field_back: Callable[..., NDArray[Any]]
    is_complex: bool
    fills: bool = False
    long_rows: int = _ROWS

    def rows_together(self, points: int, kind: np.dtype[Any]) -> int:
        """Rows of so many points that are transformed together."""
        return self.long_rows if points >= _LONG and kind == np.float32 else _ROWS

    def rows_into(self, out: NDArray[Any], rows: NDArray[Any], points: int) -> None:
        """Transform rows of so many points, zeros behind them, into an array."""
        self._into(self.of_rows, out, rows, points)

    def rows_back_into(self, out: NDArray[Any], rows: NDArray[Any], points: int) -> None:
        """Transform them back into an array, as many points of them as it takes."""
        self._into(self.rows_back, out, rows, points)

    def _into(self, transform: Callable[..., NDArray[Any]], out: NDArray[Any], rows: NDArray[Any], points: int) -> None:
        if self.fills and (transform is self.of_rows or out.shape[1] == points):
            transform(rows, n=points, axis=1, workers=1, out=out)
        else:
            out[...] = transform(rows, n=points, axis=1, workers=1)[:, : out.shape[1]]

    def width(self, points: int) -> int:
        """Numbers that so many points of a row have as their transform."""
        return points // 2 + 1 if self.is_complex else points

    def cropped(self, symbol: Array, points: tuple[int, int]) -> Array:
        """A symbol of non-negative wave numbers, those that the transform of so many points has."""
        return symbol if self.is_complex else np.ascontiguousarray(symbol[: points[0], : points[1]])

    def multiply(self, transform: NDArray[Any], symbol: NDArray[Any]) -> None:
        """Multiply a transform of whole columns by a symbol, which is the same for negative wave numbers along x."""
        first = len(symbol)
        transform[:first] *= symbol
        if len(transform) > first:
            transform[first:] *= symbol[len(transform) - first : 0 : -1]


def transforms(mirrored: bool) -> Transforms:
    """Transforms of a surface that is its own mirror image or is not, by ducc0 where that is installed."""
    if with_ducc0():
        return _DUCC0[mirrored]
    return _SCIPY[mirrored]


def transform_library() -> str:
    """What the last digits depend on: results are equal to the last bit only where this is the same."""
    engine, version = ("ducc0", ducc.ducc0.__version__) if with_ducc0() else ("scipy.fft", scipy.__version__)
    return f"{engine} {version}, numpy {np.__version__}"


def with_ducc0() -> bool:
    """Whether ducc0 is there, and the environment's ``ROUGHVISC_TRANSFORMS`` does not say ``scipy``."""
    return ducc.ducc0 is not None and os.environ.get("ROUGHVISC_TRANSFORMS") != "scipy"


_SCIPY = (
    Transforms(1, fft.rfft, fft.fft, fft.irfft, fft.ifft, fft.rfft2, fft.irfft2, True),
    Transforms(2, fft.dct, fft.dct, fft.idct, fft.idct, fft.dctn, fft.idctn, False),
)
_DUCC0 = (
    Transforms(1, ducc.rfft, ducc.cfft, ducc.irfft, ducc.cifft, ducc.rfft2, ducc.irfft2, True, True, 8),
    Transforms(2, ducc.dct, ducc.dct, ducc.idct, ducc.idct, ducc.dctn, ducc.idctn, False),
)
