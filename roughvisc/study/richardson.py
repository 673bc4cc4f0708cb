"""Results against each other: errors relative to a finer run, and how well that is known itself (Richardson)."""

from __future__ import annotations

import math

import xarray as xr

from roughvisc.study.coarser import pressure_distance
from roughvisc.study.exact import QUANTITIES, relative
from roughvisc.study.grid_error import ORDERS

#: Roache's safety factors: where three grids show an order near the one expected, and where they do not.
_SEEN, _NOT_SEEN = 1.25, 3.0
#: An order is near the one expected within this; no lower one is believed.
_NEAR, _LOWEST = 0.5, 0.5


def differences(found: xr.Dataset, wanted: xr.Dataset) -> dict[str, float]:
    """Differences between results at the same times: the worst over the times, over the largest value of the second.

    The pressure's is its absolute difference summed (L1) over the largest force.
    """
    largest = float(wanted["force"].max())
    pressure = float(pressure_distance(found, wanted).max()) / largest if largest else math.nan
    histories = {
        name: relative(found[name].values - wanted[name].values, wanted[name].values)
        for name in QUANTITIES
        if name != "pressure"
    }
    return {"pressure": pressure} | histories


def grid_uncertainty(name: str, near: float, far: float, ratio: float) -> float:
    """What the grid leaves unknown of a quantity, from the runs on three grids.

    Parameters
    ----------
    name : str
        The quantity.
    near, far : float
        Differences between the runs on the first and the second, and on the second and the third grid; the latter
        may be missing.
    ratio : float
        How many times longer the cells are from one grid to the next.

    Notes
    -----
    With an error that vanishes with the power ``p`` of the cell's side the finest run is off by
    ``near / (ratio^p - 1)``. The power seen, ``log(far / near) / log(ratio)``, is taken where it is below the one
    expected; the safety factor is 1.25 where the two are near each other, else 3.
    """
    if not near > 0:
        return near
    seen = math.log(far / near) / math.log(ratio) if far > 0 else math.nan
    order = min(max(seen, _LOWEST), ORDERS[name]) if math.isfinite(seen) else ORDERS[name]
    factor = _SEEN if abs(seen - ORDERS[name]) <= _NEAR else _NOT_SEEN
    return factor * near / (ratio**order - 1)


def time_uncertainty(near: float, sharper: float) -> float:
    """What the steps leave unknown, from the difference to a run whose tolerance is so many times looser.

    The error follows the tolerance, unevenly: the safety factor is 3.
    """
    return _NOT_SEEN * near / (sharper - 1)
