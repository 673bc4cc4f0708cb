"""Detection of surfaces that are mirror-symmetric in x and y, which are solved on a quarter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Rounding that two mirror images may differ by, relative to the largest height.
_ROUNDING = 16 * float(np.finfo(float).eps)


def is_mirrored(height: Array) -> bool:
    """Whether a surface is its own mirror image in both axes, between the cells: an even number of them each way."""
    nx, ny = (n // 2 for n in height.shape)
    if height.shape != (2 * nx, 2 * ny):
        return False
    allowed = _ROUNDING * max(float(np.fmax.reduce(height, axis=None)), -float(np.fmin.reduce(height, axis=None)))
    # the second half of the rows stands for the first, once they are known to be alike
    return _alike(height[nx - 1 :: -1], height[nx:], allowed) and _alike(
        height[nx:, ny - 1 :: -1], height[nx:, ny:], allowed
    )


def _alike(a: Array, b: Array, allowed: float) -> bool:
    difference = a - b
    near = np.abs(difference, out=difference) <= allowed
    return bool(near.all() or (near | (np.isnan(a) & np.isnan(b))).all())


def quarter(shape: tuple[int, ...]) -> tuple[slice, slice]:
    """The quarter of a surface at the end of both axes, which begins in its middle."""
    return slice(shape[0] // 2, None), slice(shape[1] // 2, None)


def unfold(field: Array) -> None:
    """Fill a field from that quarter of it, in place."""
    nx, ny = field.shape[0] // 2, field.shape[1] // 2
    field[nx:, :ny] = field[nx:, : ny - 1 : -1]
    field[:nx] = field[: nx - 1 : -1]
