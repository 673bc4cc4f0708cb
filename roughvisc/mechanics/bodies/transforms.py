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

from roughvisc.mechanics.bodies import ducc

Array = NDArray[np.float64]


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

    def rows_into(self, out: NDArray[Any], rows: NDArray[Any], room: NDArray[Any]) -> None:
        """Transform rows, zeros behind them, into an array; the room takes as many rows of all points."""
        if not self.fills:
            out[...] = self.of_rows(rows, n=room.shape[1], axis=1, workers=1)
            return
        given = rows.shape[1]
        room[:, :given] = rows
        room[:, given:] = 0
        self.of_rows(room, n=room.shape[1], axis=1, workers=1, out=out)

    def rows_back_into(self, out: NDArray[Any], rows: NDArray[Any], room: NDArray[Any]) -> None:
        """Transform them back into an array, as many points of them as it takes."""
        filled = {"out": room} if self.fills else {}
        out[...] = self.rows_back(rows, n=room.shape[1], axis=1, workers=1, **filled)[:, : out.shape[1]]

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
    """Names and versions of the libraries that determine the last digits of results.

    Results are identical to the last bit only if these are the same. SciPy is always among them, since it transforms
    the sampled kernels.
    """
    engine = f"ducc0 {ducc.ducc0.__version__}, scipy" if with_ducc0() else "scipy.fft"
    return f"{engine} {scipy.__version__}, numpy {np.__version__}"


def with_ducc0() -> bool:
    """Whether ducc0 is there, and the environment's ``ROUGHVISC_TRANSFORMS`` does not say ``scipy``."""
    return ducc.ducc0 is not None and os.environ.get("ROUGHVISC_TRANSFORMS") != "scipy"


_SCIPY = (
    Transforms(1, fft.rfft, fft.fft, fft.irfft, fft.ifft, fft.rfftn, fft.irfftn, True),
    Transforms(2, fft.dct, fft.dct, fft.idct, fft.idct, fft.dctn, fft.idctn, False),
)
_DUCC0 = (
    Transforms(1, ducc.rfft, ducc.cfft, ducc.irfft, ducc.cifft, ducc.rfft2, ducc.irfft2, True, True),
    Transforms(2, ducc.dct, ducc.dct, ducc.idct, ducc.idct, ducc.dctn, ducc.idctn, False, True),
)
