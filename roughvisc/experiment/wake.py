"""The wake of a contact that stands alone on a surface that repeats: whether the next contact runs into it.

Behind a contact the body recovers as it has crept. Where a single indenter slides with periodic boundaries, the next
one comes after one period, and meets what has not recovered by then.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.experiment.notes import percent
from roughvisc.topography.indenters import grown
from roughvisc.topography.synthesis import is_analytic
from roughvisc.units import said

Array = NDArray[np.float64]

#: Part of all creep that is still to recover after a period, from which on a result says so. Friction of a sphere on a
#: period of 6 to 11 contact radii, with 1 and 9 times the instantaneous compliance retarded: 0.4 to 0.6 % off where
#: 1e-6 of the creep is left, 5 to 6 % where 1 to 2 % are left, 26 % where 7 to 12 % are left.
_LEFT = 0.01
#: Part of the period over which nothing touches, in one piece along the motion, from which on a contact stands alone.
_FREE = 0.25


def surface_stands_alone(height: xr.DataArray) -> bool | None:
    """Whether a surface is a single indenter (True) or a regular wave (False) by its recipe; None if that is open.

    Parameters
    ----------
    height : DataArray, dims (x, y)
        [m]
    """
    if "recipe" not in height.attrs:
        return None
    if grown(height, 1.0) is not None:
        return True
    return False if is_analytic(height) else None


def contact_stands_alone(pressure: Array, axis: int) -> bool:
    """Whether nothing touches over a quarter of the period along an axis, in one piece.

    Parameters
    ----------
    pressure : ndarray, shape (nx, ny)
        [Pa]
    axis : {0, 1}
        Of the motion.
    """
    touching = np.flatnonzero((pressure > 0).any(axis=1 - axis))
    if not touching.size:
        return False
    count = pressure.shape[axis]
    free = np.diff(touching, append=touching[0] + count) - 1
    return bool(free.max() >= _FREE * count)


def creep_left(after_a_period: float, in_the_end: float) -> float:
    """Part of all that creeps which is still to come after a period; 1 of a material that creeps without end.

    Parameters
    ----------
    after_a_period, in_the_end : float
        Contact compliance. [1/Pa]
    """
    return 1.0 - after_a_period / in_the_end if math.isfinite(in_the_end) else 1.0


def wake_note(left: Mapping[float, float], period: float) -> str:
    """What to say of contacts that run into each other's wake; empty if they do not.

    Parameters
    ----------
    left : mapping
        Speed of a contact that stands alone [m/s] -> :func:`creep_left` there.
    period : float
        Along the motion. [m]
    """
    speeds = sorted(speed for speed, part in left.items() if part >= _LEFT)
    if not speeds:
        return ""
    where = f"at {said(speeds[0], 'm/s')}" if len(speeds) == 1 else f"from {said(speeds[0], 'm/s')} on"
    most = max(left[speed] for speed in speeds)
    return (
        f"The surface repeats every {said(period, 'm')}, and {where} the contact runs into the wake of the one before: "
        f"after a period up to {percent(most)} of the creep has not recovered. Friction and area are those of a row "
        "of such contacts; of a single one they are not known. Take a longer period."
    )
