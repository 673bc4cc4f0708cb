"""How far frictionless, quasi-static contact with a half-space goes: what sticking, waves and a base would change."""

from __future__ import annotations

import math
from collections.abc import Sequence

from roughvisc.errors import InputError
from roughvisc.mechanics.closed_forms.indenters import positive
from roughvisc.mechanics.halfspace.sheet import Sheet


def half_space_excess(sheet: Sheet, compliance: float, force: float, approach: float) -> float:
    r"""By how much the approach is too large that a contact has on a half-space, in place of the sheet that there is.

    Parameters
    ----------
    sheet : Sheet
        What is there.
    compliance : float
        Contact compliance, ``1 / E*``. [1/Pa]
    force, approach : float
        Of the contact on a half-space of the same material. [N], [m]

    Returns
    -------
    float
        :math:`1 - \delta_{sheet} / \delta` at the same force. [-]

    Notes
    -----
    A contact much smaller than the thickness ``h`` has :math:`\delta\,(1 - e)`, with
    :math:`e = C F \int_0^\infty (1 - S)\,\mathrm ds / \pi h \delta`. The integral is 1.7702 on a bonded sheet of
    Poisson's ratio a half, and 1.1676 on any slipping one. Of a wider contact :math:`e / (1 + e)` is given: the
    same to first order, and never more than one. For spheres it is within a quarter of the Fredholm equation's, up to
    contact radii of two thicknesses.

    Examples
    --------
    >>> from roughvisc.mechanics.closed_forms import Paraboloid, OnSheet
    >>> ball, sheet = Paraboloid(1.0), Sheet(1.0)
    >>> force, approach = (float(f(0.1)) for f in (ball.scaled_force, ball.reduced))
    >>> there = OnSheet(ball, sheet)
    >>> round(float(1 - there.reduced(there.radius_at_scaled_force(force)) / approach), 4)
    0.0747
    >>> round(half_space_excess(sheet, 1.0, force, approach), 4)
    0.0699
    """
    first = sheet.relief * compliance * force / approach
    return first / (1 + first)


def dundurs_coupling(compliances: Sequence[float], poissons: Sequence[float]) -> float:
    r"""How far the pressure on one or two bodies displaces their interface sideways: Dundurs' second constant.

    Parameters
    ----------
    compliances : sequence of float
        Contact compliance of each deformable body, one or two. [1/Pa]
    poissons : sequence of float
        Poisson's ratio of each.

    Returns
    -------
    float
        :math:`|\beta|`; :math:`(1 - 2\nu)/(2 - 2\nu)` of one body under a rigid one. [-]

    Raises
    ------
    InputError
        If there are not one or two bodies.

    References
    ----------
    .. [1] K. L. Johnson, *Contact Mechanics*, CUP, 1985, section 5.4.

    Examples
    --------
    >>> dundurs_coupling([1e-6], [0.25]), dundurs_coupling([1e-6, 1e-6], [0.3, 0.3])
    (0.3333333333333333, 0.0)
    """
    if not 1 <= len(compliances) <= 2 or len(compliances) != len(poissons):
        raise InputError(f"compliances has {len(compliances)} bodies: expected one or two, as many as of poissons")
    shares = [c * (1 - 2 * nu) / (2 - 2 * nu) for c, nu in zip(compliances, poissons, strict=True)]
    return abs(shares[0] - sum(shares[1:])) / sum(compliances)


def sticking_stiffness(poisson: float) -> float:
    r"""Stiffness of a round flat punch that sticks to a half-space, over that of one without friction.

    Parameters
    ----------
    poisson : float
        Poisson's ratio of the half-space.

    Returns
    -------
    float
        :math:`(1 - \nu) \ln(3 - 4 \nu) / (1 - 2 \nu)`. [-]

    References
    ----------
    .. [1] D. A. Spence, Proc. R. Soc. A 305 (1968) 55.

    Examples
    --------
    >>> round(sticking_stiffness(0.0), 4), round(sticking_stiffness(0.3), 4), sticking_stiffness(0.5)
    (1.0986, 1.0286, 1.0)
    """
    x = 1 - 2 * poisson
    return 1.0 if x == 0 else (1 - poisson) * math.log1p(2 * x) / x


def radiation_lag(radius: float, shear_modulus: float, density: float) -> float:
    r"""Time by which the force on a round punch runs ahead of its approach, as waves carry energy away.

    Parameters
    ----------
    radius : float
        Contact radius ``a``. [m]
    shear_modulus : float
        ``G`` of the half-space. [Pa]
    density : float
        :math:`\rho` of the half-space. [kg/m3]

    Returns
    -------
    float
        Dashpot over spring of the equivalent oscillator, :math:`0.85\,a \sqrt{\rho / G}`. [s]

    Notes
    -----
    The spring is :math:`4 G a / (1 - \nu)` and the dashpot :math:`3.4\,a^2 \sqrt{\rho G} / (1 - \nu)` [1]_. A force
    that changes over a time ``T`` is off its quasi-static value by about the lag over ``T``.

    References
    ----------
    .. [1] J. Lysmer, F. E. Richart, J. Soil Mech. Found. Div. ASCE 92 (1966) 65.

    Examples
    --------
    >>> round(radiation_lag(1e-3, 1e6, 1000.0) * 1e6)  # a millimetre of rubber: microseconds
    27
    """
    positive("radius", radius, "m")
    positive("shear_modulus", shear_modulus, "Pa")
    positive("density", density, "kg/m3")
    return 3.4 / 4 * radius * math.sqrt(density / shear_modulus)
