"""Results against each other: errors relative to a finer run, and how well that is known itself (Richardson)."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from roughvisc.study.coarser import pressure_distance
from roughvisc.study.exact import QUANTITIES, relative

Array = NDArray[np.float64]

#: Powers of the cell's side with which the error of a quantity vanishes: no lower one is believed, and no higher one
#: expected. Measured: of the pressure's L1 norm; the mean gap follows the displacements, the counted area the cells at
#: its edge; of the corrected one the scatter of the count is left.
ORDERS = {
    "pressure": (1.0, 1.5),
    "approach": (1.0, 2.0),
    "contact_area": (0.5, 1.0),
    "contact_area_corrected": (1.5, 1.5),
    "mean_gap": (1.0, 2.0),
}
#: Roache's safety factors: with three grids, and with two.
_THREE, _TWO = 1.25, 3.0


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


def grid_uncertainty(name: str, near: ArrayLike, far: ArrayLike, ratio: float) -> Array:
    """What the grid leaves unknown of a quantity, from the runs on three grids.

    Parameters
    ----------
    name : str
        The quantity.
    near, far : array_like
        Differences between the runs on the first and the second, and on the second and the third grid; the latter
        may be missing.
    ratio : float
        How many times longer the cells are from one grid to the next.

    Notes
    -----
    With an error that vanishes with the power ``p`` of the cell's side the finest run is off by
    ``near / (ratio^p - 1)``. The power seen, ``log(far / near) / log(ratio)``, is taken where it is below the one
    expected. Where it is above, the two finer grids agree by chance: then ``far / ratio^p`` with the power expected
    stands for ``near``. The safety factor is 1.25 with three grids and 3 with two (the grid convergence index of
    Roache [1]_).

    References
    ----------
    .. [1] P. J. Roache, Annu. Rev. Fluid Mech. 29 (1997) 123.
    """
    near, far = np.asarray(near, dtype=float), np.asarray(far, dtype=float)
    lowest, expected = ORDERS[name]
    with np.errstate(divide="ignore", invalid="ignore"):
        seen = np.log(far / near) / math.log(ratio)
    order = np.where(np.isnan(seen), expected, np.clip(seen, lowest, expected))
    factor = np.where(np.isnan(far), _TWO, _THREE)
    # a missing near makes it missing, a missing far does not
    difference = np.maximum(near, np.where(np.isnan(far), 0.0, far) / ratio**expected)
    return np.asarray(factor * difference / (ratio**order - 1))


def time_uncertainty(near: float, sharper: float) -> float:
    """What the steps leave unknown, from the difference to a run whose tolerance is so many times looser.

    The error follows the tolerance, unevenly: the safety factor is 3.
    """
    return _TWO * near / (sharper - 1)
