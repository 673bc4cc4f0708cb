"""Surfaces that are their own mirror images, in x and in y: a quarter of them is all that has to be solved."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Rounding that two mirror images may differ by, relative to the largest height.
_ROUNDING = 16 * float(np.finfo(float).eps)


def is_mirrored(height: Array) -> bool:
    """Whether a surface is its own mirror image in both axes, between the cells: an even number of them each way."""
    if height.shape[0] % 2 or height.shape[1] % 2:
        return False
    allowed = _ROUNDING * float(np.nanmax(np.abs(height), initial=0.0))
    return all(np.allclose(height, np.flip(height, axis), rtol=0, atol=allowed, equal_nan=True) for axis in (0, 1))


def quarter(shape: tuple[int, ...]) -> tuple[slice, slice]:
    """The quarter of a surface at the end of both axes, which begins in its middle."""
    return slice(shape[0] // 2, None), slice(shape[1] // 2, None)


def unfold(field: Array) -> None:
    """Fill a field from that quarter of it, in place."""
    nx, ny = field.shape[0] // 2, field.shape[1] // 2
    field[nx:, :ny] = field[nx:, : ny - 1 : -1]
    field[:nx] = field[: nx - 1 : -1]
