"""Contact area of a rough surface by theory: Persson's, and that of asperities at low loads."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from roughvisc.errors import InputError
from roughvisc.labels import label
from roughvisc.observables.derived import material_of, need_history
from roughvisc.observables.response import history
from roughvisc.topography.grid import nominal_area
from roughvisc.topography.parameters import rms_slope


def persson_fraction(strain: ArrayLike) -> Any:
    r"""Contact area over nominal area by Persson's theory, :math:`\mathrm{erf}(\sqrt2 \, p / (E^* h'))`.

    Parameters
    ----------
    strain : array_like
        Nominal pressure over contact modulus and rms slope.
    """
    from scipy.special import erf  # slow to import

    return erf(math.sqrt(2) * np.asarray(strain, dtype=float))


def asperity_fraction(strain: ArrayLike) -> Any:
    r"""The same by the theory of asperities at low loads, :math:`\sqrt{2\pi} \, p / (E^* h')`: 1.57 times Persson's."""
    return math.sqrt(2 * math.pi) * np.asarray(strain, dtype=float)


def area_by_theory(dataset: xr.Dataset, *, material: Any = None) -> xr.Dataset:
    r"""Contact area of a rough surface by Persson's theory and by asperity theory, for a load that does not fall.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result with ``force`` and ``height``, of a half-space and periodic boundaries.
    material : Material, optional
        Default: that of the case in the attributes.

    Returns
    -------
    xarray.Dataset
        ``persson_contact_area`` and ``asperity_contact_area`` over time, missing from the time at which the load falls.
        [m2]

    Raises
    ------
    InputError
        If the boundaries are not periodic, the body is no half-space, or no material is known.

    Notes
    -----
    On an elastic half-space Persson's theory [1]_ gives :math:`A = A_0 \, \mathrm{erf}(\sqrt2 \, p / (E^* h'))` with
    the nominal pressure :math:`p`, and asperities at low loads [2]_ :math:`A = A_0 \sqrt{2\pi} \, p / (E^* h')`; both
    for a Gaussian surface with the root-mean-square slope :math:`h'` on the grid. A growing viscoelastic contact is
    equivalent to an elastic one with :math:`p / E^*` replaced by :math:`\int C(t - s) \, dp(s)`: under a constant
    pressure by :math:`C(t) \, p`. The load is interpolated linearly between accepted steps, so a jump after the start
    becomes a ramp over the step before it.

    References
    ----------
    .. [1] B. N. J. Persson, *J. Chem. Phys.* 115 (2001) 3840-3861.
    .. [2] A. W. Bush, R. D. Gibson, T. R. Thomas, *Wear* 35 (1975) 87-111.
    """
    need_history(dataset, "force", "height")
    if dataset["force"].dims != ("time",):
        raise InputError(f"the force has dimensions {dataset['force'].dims}: choose one case first")
    if dataset.attrs.get("boundary") not in ("periodic", "mirror"):
        raise InputError("the theories are of surfaces without borders: expected boundary = 'periodic' or 'mirror'")
    attributes = dataset.attrs
    for body in ("thickness", "kernel"):
        if body in attributes:
            raise InputError(f"the theories are of a half-space: found a result with the {body} {attributes[body]}")
    steps, kept = history(dataset), dataset["time"].values
    area = nominal_area_of(dataset)
    known = material_of(dataset) if material is None else material
    strain = _effective(known, steps["time"].values, steps["force"].values / area, kept)
    falling = np.diff(steps["force"].values) < -1e-9 * float(steps["force"].max())
    last = steps["time"].values[int(np.argmax(falling))] if falling.any() else math.inf
    slope = rms_slope(dataset["height"], periodic=attributes["boundary"] == "periodic")
    strain = np.where(kept <= last, strain / slope, np.nan)
    found = {
        "persson_contact_area": ("time", area * persson_fraction(strain)),
        "asperity_contact_area": ("time", area * asperity_fraction(strain)),
    }
    return label(xr.Dataset(found, coords={"time": dataset["time"]}))


def nominal_area_of(dataset: xr.Dataset) -> float:
    """Area that the nominal pressure of a result refers to: the force over it, else that of the surface. [m2]"""
    if "nominal_pressure" in dataset and float(dataset["nominal_pressure"].max()) > 0:
        at = dataset["nominal_pressure"].argmax(...)
        return float(dataset["force"].isel(at) / dataset["nominal_pressure"].isel(at))
    return nominal_area(dataset)


def _effective(material: Any, times: np.ndarray, pressure: np.ndarray, at: np.ndarray) -> np.ndarray:
    """``int C(t - s) dp(s)`` at some times, of a pressure that is linear between those where it is known."""
    since = np.maximum(at[:, None] - times[None], 0.0)
    integral = np.asarray(material.contact_integral(since), dtype=float)
    rate = np.diff(pressure) / np.diff(times)
    at_start = np.asarray(material.contact_compliance(since[:, 0]), dtype=float) * pressure[0]
    return at_start + (integral[:, :-1] - integral[:, 1:]) @ rate
