"""Persson's theory of rubber friction beside a computed friction curve."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.experiment.sliding_grid import AxisTransform, SlidingGrid, on_rows
from roughvisc.labels import describe
from roughvisc.mechanics.body import Body, body_of
from roughvisc.mechanics.sliding.persson import persson as persson_estimate
from roughvisc.observables.derived import material_of
from roughvisc.topography.grid import spacing

#: Tolerance of the series that replaces a material without a complex compliance in closed form.
_TOLERANCE = 1e-4


def persson(dataset: xr.Dataset, *, material: Any = None) -> xr.Dataset:
    r"""Return friction coefficient and contact fraction by Persson's theory, for the waves of the same surface.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of :func:`roughvisc.friction`, with ``height``.
    material : Material or Body, optional
        The body. Default: that of the case in the attributes.

    Returns
    -------
    xarray.Dataset
        ``persson_friction_coefficient`` and ``persson_contact_fraction`` over speed. [-]

    Raises
    ------
    InputError
        If the Dataset is not a friction curve, or no material is known.

    References
    ----------
    .. [1] B. N. J. Persson, *J. Chem. Phys.* 115 (2001) 3840.
    """
    if not {"height", "nominal_pressure", "speed"} <= set(dataset.variables) or "direction" not in dataset.attrs:
        raise InputError(key="dataset", found=list(dataset.variables), expected="a result of rv.friction with height")
    known = material_of(dataset) if material is None else material
    body = known if isinstance(known, Body) else body_of(known)
    turn = AxisTransform.of(dataset.attrs["direction"])
    height = dataset["height"]
    sides = spacing(height, "height")[:: -1 if turn.swapped else 1]
    face = SlidingGrid(np.ascontiguousarray(turn.there(float(height.max()) - height.values)), (sides[0], sides[1]))
    found = []
    for speed, pressure in zip(dataset["speed"].values, dataset["nominal_pressure"].values, strict=True):
        sliding = face.sliding(float(speed), body.over_frequencies(float(speed) * face.waves, _TOLERANCE))
        found.append(persson_estimate(sliding, on_rows(face.gap, sliding), float(pressure)))
    columns = {
        "persson_friction_coefficient": ("speed", [one.friction_coefficient for one in found]),
        "persson_contact_fraction": ("speed", [one.contact_fraction for one in found]),
    }
    return describe(xr.Dataset(columns, coords={"speed": dataset["speed"]}))
