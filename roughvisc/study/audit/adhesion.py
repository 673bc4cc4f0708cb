"""Adhesion: when it pulls as hard as the load presses, on a sphere and on a rough surface."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.mechanics.materials.checks import check_number
from roughvisc.units import Quantity, quantities

Array = NDArray[np.float64]

#: Maugis' parameter over Tabor's, by the attraction of Lennard-Jones atoms (D. Maugis, J. Colloid Interface Sci. 150
#: (1992) 243).
_MAUGIS = 1.1570
#: Contact modulus times slope over the mean pressure in rough contact.
_REPULSION = 2.0


@quantities(radius="m", contact_modulus="Pa", work_of_adhesion="J/m^2", attraction_range="m")
def tabor_parameter(
    radius: Quantity, contact_modulus: Quantity, work_of_adhesion: Quantity, attraction_range: Quantity
) -> float:
    r"""Tabor parameter of a sphere: height of its adhesive neck over the range of the attraction.

    Parameters
    ----------
    radius : float or str
        Radius ``R`` of the sphere. [m]
    contact_modulus : float or str
        ``E*``. [Pa]
    work_of_adhesion : float or str
        ``w``. [J/m2]
    attraction_range : float or str
        Distance ``z`` over which the surfaces attract each other. [m]

    Returns
    -------
    float
        :math:`\mu = (R w^2 / E^{*2} z^3)^{1/3}`: JKR is valid far above one, DMT far below. [-]

    References
    ----------
    .. [1] D. Tabor, J. Colloid Interface Sci. 58 (1977) 2.

    Examples
    --------
    >>> round(tabor_parameter(1e-3, 3e6, 0.05, 3e-10))
    2175
    """
    check_number("radius", radius, "m")
    check_number("contact_modulus", contact_modulus, "Pa")
    check_number("attraction_range", attraction_range, "m")
    return float(np.cbrt(radius * (work_of_adhesion / contact_modulus) ** 2) / attraction_range)


@quantities(radius="m", work_of_adhesion="J/m^2")
def pull_off_force(radius: Quantity, work_of_adhesion: Quantity, tabor: float = math.inf) -> float:
    r"""Force that separates a sphere from a flat half-space.

    Parameters
    ----------
    radius : float or str
        Radius ``R`` of the sphere. [m]
    work_of_adhesion : float or str
        ``w``. [J/m2]
    tabor : float
        Tabor parameter; infinite: JKR, 0: DMT.

    Returns
    -------
    float
        :math:`\frac32 \pi w R` (JKR) to :math:`2 \pi w R` (DMT). [N]

    Notes
    -----
    Between the limits by the fit of [3]_ to the theory of Maugis, 1.7 % off at most.

    References
    ----------
    .. [1] K. L. Johnson, K. Kendall, A. D. Roberts, Proc. R. Soc. A 324 (1971) 301.
    .. [2] B. V. Derjaguin, V. M. Muller, Yu. P. Toporov, J. Colloid Interface Sci. 53 (1975) 314.
    .. [3] R. W. Carpick, D. F. Ogletree, M. Salmeron, J. Colloid Interface Sci. 211 (1999) 395.

    Examples
    --------
    >>> pull_off_force(1.0, 1.0) / math.pi, pull_off_force(1.0, 1.0, tabor=0.0) / math.pi
    (1.5, 2.0)
    """
    check_number("radius", radius, "m")
    grown = 4.04 * (_MAUGIS * tabor) ** 1.4
    share = 1.0 if math.isinf(grown) else (grown - 1) / (grown + 1)
    return math.pi * work_of_adhesion * radius * (7 - share) / 4


@quantities(radius="m", contact_modulus="Pa", work_of_adhesion="J/m^2")
def punch_pull_off(radius: Quantity, contact_modulus: Quantity, work_of_adhesion: Quantity) -> float:
    r"""Force that separates a round flat punch from a half-space.

    Parameters
    ----------
    radius : float or str
        Radius ``a`` of the punch. [m]
    contact_modulus : float or str
        ``E*``. [Pa]
    work_of_adhesion : float or str
        ``w``. [J/m2]

    Returns
    -------
    float
        :math:`\sqrt{8 \pi a^3 E^* w}`. [N]

    References
    ----------
    .. [1] K. Kendall, J. Phys. D 4 (1971) 1186.

    Examples
    --------
    >>> round(punch_pull_off(1e-3, 3e6, 0.05), 4)
    0.0614
    """
    check_number("radius", radius, "m")
    check_number("contact_modulus", contact_modulus, "Pa")
    return math.sqrt(8 * math.pi * radius**3 * contact_modulus * work_of_adhesion)


@quantities(force="N", pull_off="N")
def adhesive_load(force: ArrayLike, pull_off: ArrayLike) -> Array:
    r"""Load that gives the same contact radius of a sphere without adhesion (JKR).

    Parameters
    ----------
    force : array_like of float or str
        Load ``F``. [N]
    pull_off : array_like of float or str
        Force of separation :math:`P = \frac32 \pi w R`. [N]

    Returns
    -------
    ndarray
        :math:`F + 2 P + 2 \sqrt{P F + P^2}`: the contact radius is that of Hertz under this load. [N]

    References
    ----------
    .. [1] K. L. Johnson, K. Kendall, A. D. Roberts, Proc. R. Soc. A 324 (1971) 301.

    Examples
    --------
    >>> float(adhesive_load(1.0, 0.0)), float(adhesive_load(-1.0, 1.0))  # a load to itself; at separation
    (1.0, 1.0)
    """
    force, pull_off = np.asarray(force, dtype=float), np.asarray(pull_off, dtype=float)
    return np.asarray(force + 2 * pull_off + 2 * np.sqrt(pull_off * force + pull_off**2))


@quantities(rms_laplacian="1/m", contact_modulus="Pa", work_of_adhesion="J/m^2", attraction_range="m")
def rough_attraction(
    rms_slope: float,
    rms_laplacian: Quantity,
    contact_modulus: Quantity,
    work_of_adhesion: Quantity,
    attraction_range: Quantity,
) -> float:
    r"""Attraction around the spots of a stiff rough contact over the repulsion within them.

    Parameters
    ----------
    rms_slope : float
        Root mean square slope ``h'``. [-]
    rms_laplacian : float or str
        Root mean square ``h''`` of the Laplacian of the heights, twice that of the mean curvature. [1/m]
    contact_modulus : float or str
        ``E*``. [Pa]
    work_of_adhesion : float or str
        ``w``. [J/m2]
    attraction_range : float or str
        Distance ``z`` over which the surfaces attract each other. [m]

    Returns
    -------
    float
        From 1 on the surfaces stick without a load. Below, they touch on :math:`1 / (1 - r)` times the area that a load
        brings into contact without adhesion. [-]

    Notes
    -----
    A spot of the diameter :math:`d = 4 h' / h''` is surrounded by a rim within which the gap is below ``z``, of the
    width :math:`d\,(3 z / 4 h' d)^{2/3}`. There the attraction is ``w / z``; within the spot the mean pressure is
    :math:`h' E^* / 2`. The ratio of the two forces is

    .. math::
        r = \pi \left(\tfrac{3}{16}\right)^{2/3} \frac{2 w}{h' E^* z} \left(\frac{4 z}{h' d}\right)^{2/3} .

    It is for attraction that leaves the shape of the spots alone (DMT), with a Tabor parameter below one.

    References
    ----------
    .. [1] L. Pastewka, M. O. Robbins, PNAS 111 (2014) 3298, eq. (10).

    Examples
    --------
    >>> round(rough_attraction(0.1, 1e8, 1e11, 0.05, 3e-10), 3)  # h' / h'' = 1 nm: a stiff surface, rough to the atoms
    0.071
    """
    check_number("rms_slope", rms_slope, "1")
    check_number("rms_laplacian", rms_laplacian, "1/m")
    check_number("contact_modulus", contact_modulus, "Pa")
    check_number("attraction_range", attraction_range, "m")
    width = (rms_laplacian * attraction_range / rms_slope**2) ** (2 / 3)
    pulled = _REPULSION * work_of_adhesion / (rms_slope * contact_modulus * attraction_range)
    return math.pi * (3 / 16) ** (2 / 3) * pulled * width


@quantities(roughness="m", contact_modulus="Pa")
def conformal_energy(roughness: Quantity, contact_modulus: Quantity) -> float:
    r"""Elastic energy, an area, of a half-space that follows a rough surface everywhere.

    Parameters
    ----------
    roughness : float or str
        :math:`\sum |q| |h_q|^2` over all waves of the surface, with the mean square height :math:`\sum |h_q|^2`. [m]
    contact_modulus : float or str
        ``E*``. [Pa]

    Returns
    -------
    float
        :math:`E^* \sum |q| |h_q|^2 / 4`. Soft surfaces stay in full contact without a load where the work of adhesion
        exceeds it. [J/m2]

    References
    ----------
    .. [1] B. N. J. Persson, E. Tosatti, J. Chem. Phys. 115 (2001) 5597.

    Examples
    --------
    >>> k, a = 1e5, 1e-6
    >>> conformal_energy(k * a**2 / 2, 3e6) == 3e6 * k * a**2 / 8  # a cos(k x)
    True
    """
    return contact_modulus * roughness / 4
