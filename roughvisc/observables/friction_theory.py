"""Persson's theory of rubber friction on the waves of one surface, without a solution of the contact."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import fft
from scipy.special import erf

from roughvisc.errors import InputError
from roughvisc.experiment.sliding import SlidingGrid
from roughvisc.labels import label
from roughvisc.mechanics.body import body_of
from roughvisc.mechanics.steady_sliding import Sliding
from roughvisc.observables.derived import material_of
from roughvisc.topography.grid import spacing

Array = NDArray[np.float64]

#: Tolerance of the series that replaces a material without a complex compliance in closed form.
_TOLERANCE = 1e-4
# Waves whose numbers differ by less than this, relative, are of one magnification.
_SAME = 1e-9


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
    body = body_of(material_of(dataset) if material is None else material)
    height = dataset["height"]
    grid = SlidingGrid.of(-height.values, spacing(height, "height"), dataset.attrs["direction"])
    found = []
    for speed, pressure in zip(dataset["speed"].values, dataset["nominal_pressure"].values, strict=True):
        sliding = Sliding(grid.law(body, float(speed), _TOLERANCE), grid.gap.shape, grid.spacing, float(speed))
        found.append(friction_of_waves(sliding, grid.gap, float(pressure)))
    coefficients, fractions = zip(*found, strict=True)
    columns = {
        "persson_friction_coefficient": ("speed", list(coefficients)),
        "persson_contact_fraction": ("speed", list(fractions)),
    }
    return label(xr.Dataset(columns, coords={"speed": dataset["speed"]}))


def friction_of_waves(sliding: Sliding, height: Array, pressure: float) -> tuple[float, float]:
    r"""Return friction coefficient and contact fraction by Persson's theory, as a sum over the waves of a surface.

    Parameters
    ----------
    sliding : Sliding
        The body and the motion.
    height : ndarray, shape (nx, ny)
        Profile, or the undeformed gap, which has the same waves. [m]
    pressure : float
        Nominal pressure :math:`\sigma_0`. [Pa]

    Returns
    -------
    friction_coefficient : float
        [-]
    contact_fraction : float
        Contact area over the nominal one, with all waves of the surface. [-]

    Notes
    -----
    A wave :math:`h_\mathbf{q}` in full contact has the stress :math:`\sigma_\mathbf{q} = E^*_\mathbf{q}
    h_\mathbf{q}`, on a half-space with :math:`E^*_\mathbf{q} = \tfrac12 |\mathbf q| E^*(q_x V)`. The theory takes
    that for the waves up to a magnification, and counts with each wave the part of the surface that is still in contact
    there:

    .. math:: P(q) = \operatorname{erf} \frac{\sigma_0}{\sqrt{2 v(q)}}, \quad
              v(q) = \sum_{|\mathbf q'| < q} |\sigma_{\mathbf q'}|^2, \quad
              \mu = \frac{1}{\sigma_0} \sum_\mathbf{q} P(q)\, q_x |h_\mathbf{q}|^2 \operatorname{Im} E^*_\mathbf{q} .

    With the spectrum of an isotropic surface and :math:`G = v / 2 \sigma_0^2` these are the integrals of [1]_ over
    :math:`q^3 C(q)`. Waves of one length share their ``P``, for which half of their own variance is counted. The
    correction of later papers for the share of the contact in the dissipation is left out.

    References
    ----------
    .. [1] B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840.
    """
    ny, waves = height.shape[1], fft.rfft2(height, norm="forward")
    length = np.broadcast_to(np.hypot(sliding.qx, sliding.qy), waves.shape)
    twice = np.full(ny // 2 + 1, 2.0)  # waves of which the conjugates are not stored
    twice[0] = 1.0
    if ny % 2 == 0:
        twice[-1] = 1.0
    power = twice * np.abs(waves) ** 2
    moved = length > 0
    stiffness = np.divide(1.0, sliding.response, where=moved, out=np.zeros(waves.shape, complex))
    order = np.argsort(length, axis=None)
    stress, drag = ((power * part).ravel()[order] for part in (np.abs(stiffness) ** 2, -sliding.qx * stiffness.imag))
    sorted_length = length.ravel()[order]
    first = np.flatnonzero(np.diff(sorted_length, prepend=-1.0) > _SAME * sorted_length)
    own, drag = np.add.reduceat(stress, first), np.add.reduceat(drag, first)
    variance = np.cumsum(own) - own / 2
    with np.errstate(divide="ignore"):
        contact = erf(pressure / np.sqrt(2 * variance))
        rest = erf(pressure / np.sqrt(2 * own.sum()))
    return float(contact @ drag) / pressure, float(rest)
