"""Persson's theory of rubber friction on the waves of one surface, without a solution of the contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.special import erf

from roughvisc.mechanics.sliding.steady import Sliding

Array = NDArray[np.float64]

# Waves whose numbers differ by less than this, relative, are of one magnification.
_SAME = 1e-9


@dataclass(frozen=True)
class PerssonEstimate:
    """What the theory says of a surface at one speed.

    Attributes
    ----------
    friction_coefficient : float
        [-]
    contact_fraction : float
        Contact area over the nominal one, with all waves of the surface. [-]
    """

    friction_coefficient: float
    contact_fraction: float


def persson(sliding: Sliding, height: Array, pressure: float) -> PerssonEstimate:
    r"""Persson's friction integral as a sum over the waves of a surface.

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
    PerssonEstimate

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
    return PerssonEstimate(float(contact @ drag) / pressure, float(rest))
