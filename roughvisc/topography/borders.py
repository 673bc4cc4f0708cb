"""Opposite borders of a surface that is to repeat: whether they meet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

#: Borders jump that differ by more than so many times what neighbouring rows do.
JUMP = 2.0


@dataclass(frozen=True)
class BorderMismatch:
    """How much opposite borders of a surface differ, along x and along y.

    Attributes
    ----------
    of_rms : pair of float
        Root mean square difference of the first and the last row over the root mean square height Sq. [-]
    of_neighbours : pair of float
        The same over the root mean square difference of neighbouring rows. [-]
    """

    of_rms: tuple[float, float]
    of_neighbours: tuple[float, float]

    @property
    def jumps(self) -> bool:
        """Whether the surface has a step where it repeats: borders differ by more than twice what neighbours do."""
        return max(self.of_neighbours) > JUMP


def border_mismatch(h: xr.DataArray) -> BorderMismatch:
    """Mismatch of opposite borders.

    Parameters
    ----------
    h : xarray.DataArray, dims (x, y)
        Heights; missing points take no part. [m]

    Returns
    -------
    BorderMismatch
        Zero along an axis of one cell, and for a flat surface.
    """
    values = h.transpose("x", "y").values
    known = values[np.isfinite(values)]
    rms = float(known.std()) if known.size else 0.0
    of_rms, of_neighbours = [], []
    for axis in (0, 1):
        across = _rms(np.take(values, 0, axis) - np.take(values, -1, axis))
        beside = _rms(np.diff(values, axis=axis))
        of_rms.append(across / rms if rms > 0 else 0.0)
        of_neighbours.append(across / beside if beside > 0 else 0.0)
    return BorderMismatch((of_rms[0], of_rms[1]), (of_neighbours[0], of_neighbours[1]))


def _rms(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if known.size else 0.0
