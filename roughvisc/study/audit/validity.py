"""How far isothermal, frictionless, quasi-static contact with a half-space goes.

What a base, sticking, waves and the heat of friction would change.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.checks import check_number
from roughvisc.mechanics.sheet import Sheet
from roughvisc.units import Quantity, quantities


@quantities(compliance="1/Pa", force="N", approach="m")
def half_space_excess(sheet: Sheet, compliance: Quantity, force: Quantity, approach: Quantity) -> float:
    r"""Excess of the approach on a half-space over that on the real sheet, over the former, at the same load.

    Parameters
    ----------
    sheet : Sheet
        What is there.
    compliance : float or str
        Contact compliance, ``1 / E*``. [1/Pa]
    force, approach : float or str
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
    >>> round(half_space_excess(Sheet(1.0), compliance=1.0, force=4e-3 / 3, approach=1e-2), 4)
    0.0699
    """
    first = sheet.relief * compliance * force / approach
    return first / (1 + first)


@quantities(compliance="1/Pa", force="N", approach="m")
def half_space_shortfall(sheet: Sheet, compliance: Quantity, force: Quantity, approach: Quantity) -> float:
    r"""Relative shortfall of the force on a half-space against that on the real sheet, at the same approach.

    Parameters
    ----------
    sheet : Sheet
        What is there.
    compliance : float or str
        Contact compliance, ``1 / E*``. [1/Pa]
    force, approach : float or str
        Of the contact on a half-space of the same material, which is taken for that of a paraboloid. [N], [m]

    Returns
    -------
    float
        :math:`1 - F / F_{sheet}` at the same approach. [-]

    Notes
    -----
    With the excess ``e`` of :func:`half_space_excess` to first order, the force on the sheet is
    :math:`F (1 + 1.5 e + 2.27 e^2 + 3 e^3)`. The first coefficient is exact for a sphere; the others are fitted to the
    Fredholm equation of a sphere on bonded and slipping sheets. The shortfall is within 7 % of it up to an approach of
    :math:`h^2/R`.
    """
    first = sheet.relief * compliance * force / approach
    return 1 - 1 / (1 + 1.5 * first + 2.27 * first**2 + 3 * first**3)


@quantities(compliances="1/Pa")
def dundurs_coupling(compliances: Sequence[Quantity], poissons: Sequence[float]) -> float:
    r"""Dundurs' second constant, for the sideways displacement of an interface under pressure.

    Parameters
    ----------
    compliances : sequence of float or str
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


@quantities(radius="m", shear_modulus="Pa", density="kg/m^3")
def radiation_lag(radius: Quantity, shear_modulus: Quantity, density: Quantity) -> float:
    r"""Time by which the force on a round punch leads its approach, because waves carry energy away.

    Parameters
    ----------
    radius : float or str
        Contact radius ``a``. [m]
    shear_modulus : float or str
        ``G`` of the half-space. [Pa]
    density : float or str
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
    check_number("radius", radius, "m")
    check_number("shear_modulus", shear_modulus, "Pa")
    check_number("density", density, "kg/m3")
    return 3.4 / 4 * radius * math.sqrt(density / shear_modulus)


@quantities(speed="m/s", shear_modulus="Pa", density="kg/m^3")
def moving_load_excess(speed: Quantity, shear_modulus: Quantity, density: Quantity, poisson: float) -> float:
    r"""Relative increase of the displacement by waves under a load that moves along a half-space.

    Parameters
    ----------
    speed : float or str
        ``V`` of the load. [m/s]
    shear_modulus : float or str
        ``G`` of the half-space. [Pa]
    density : float or str
        :math:`\rho` of the half-space. [kg/m3]
    poisson : float
        Poisson's ratio :math:`\nu`. [-]

    Returns
    -------
    float
        Displacement under a moving normal line load over that of one at rest, minus one; infinite from the speed of
        Rayleigh waves on. [-]

    Notes
    -----
    With :math:`m = V / c_2`, :math:`c_2^2 = G / \rho`, :math:`\kappa^2 = (1 - 2\nu) / (2 - 2\nu)`,
    :math:`\alpha_1^2 = 1 - \kappa^2 m^2` and :math:`\alpha_2^2 = 1 - m^2` a steady pressure of any shape displaces the
    surface :math:`m^2 \alpha_1 / ((1 - \nu) R)` times as far as at rest, with Rayleigh's function
    :math:`R = 4 \alpha_1 \alpha_2 - (1 + \alpha_2^2)^2` [1]_. The form coded has :math:`R` multiplied by its
    conjugate, which leaves nothing to cancel at low speed. To leading order the excess is :math:`3 m^2 / 4` for
    :math:`\nu = 1/2`.

    References
    ----------
    .. [1] J. Cole, J. Huth, J. Appl. Mech. 25 (1958) 433.

    Examples
    --------
    >>> round(moving_load_excess(3.0, 1e6, 1000.0, 0.5), 5), moving_load_excess(31.0, 1e6, 1000.0, 0.5)
    (0.00681, inf)
    """
    check_number("speed", speed, "m/s")
    check_number("shear_modulus", shear_modulus, "Pa")
    check_number("density", density, "kg/m3")
    square, ratio = density * speed**2 / shear_modulus, (1 - 2 * poisson) / (2 - 2 * poisson)
    if not square < 1:
        return math.inf
    # R (4 alpha_1 alpha_2 + (1 + alpha_2^2)^2) / m^2
    cubic = 16 * (1 - ratio) + (16 * ratio - 24) * square + 8 * square**2 - square**3
    if not cubic > 0:
        return math.inf
    first, second = math.sqrt(1 - ratio * square), math.sqrt(1 - square)
    return first * (4 * first * second + (2 - square) ** 2) / ((1 - poisson) * cubic) - 1


@quantities(heat_flux="W/m^2", radius="m", speed="m/s", heat_conductivity="W/m/K", volumetric_heat_capacity="J/m^3/K")
def flash_temperature(
    heat_flux: Quantity,
    radius: Quantity,
    speed: Quantity,
    heat_conductivity: Quantity,
    volumetric_heat_capacity: Quantity,
) -> float:
    r"""Mean temperature rise of a round spot that slides on a half-space and heats it evenly.

    Parameters
    ----------
    heat_flux : float or str
        ``q``, into the half-space. [W/m2]
    radius : float or str
        ``a`` of the spot. [m]
    speed : float or str
        ``V`` of the spot along the half-space. [m/s]
    heat_conductivity : float or str
        ``k`` of the half-space. [W/(m K)]
    volumetric_heat_capacity : float or str
        :math:`\rho c` of the half-space. [J/(m3 K)]

    Returns
    -------
    float
        Mean over the spot, in the steady state, above the temperature far away. [K]

    Notes
    -----
    A slow spot has :math:`8 q a / 3 \pi k`, and a fast one, whose heat has no time to flow sideways,
    :math:`0.974\,(q a / k) / \sqrt P` with :math:`P = V a \rho c / k` [1]_ [2]_. The factor is that of
    :math:`2 q \sqrt{t / \pi k \rho c}`, with the time ``t`` since the leading edge, averaged over the circle. In
    between the inverse squares of both are added [3]_: at most 4 % below the exact value, about ``P`` = 2.

    References
    ----------
    .. [1] J. C. Jaeger, Proc. R. Soc. N.S.W. 76 (1942) 203.
    .. [2] J. F. Archard, Wear 2 (1959) 438.
    .. [3] X. Tian, F. E. Kennedy, J. Tribol. 116 (1994) 167.

    Examples
    --------
    >>> rubber = {"heat_conductivity": 0.2, "volumetric_heat_capacity": 1.8e6}
    >>> [round(flash_temperature(1e5, 1e-5, speed, **rubber), 2) for speed in (1e-6, 1.0)]
    [4.24, 0.51]
    """
    if not 0 <= heat_flux < math.inf:
        raise InputError(f"heat_flux is {heat_flux!r}: expected a number >= 0 [W/m2]")
    check_number("radius", radius, "m")
    check_number("speed", speed, "m/s")
    check_number("heat_conductivity", heat_conductivity, "W/m/K")
    check_number("volumetric_heat_capacity", volumetric_heat_capacity, "J/(m3 K)")
    peclet = speed * radius * volumetric_heat_capacity / heat_conductivity
    # int (1 - t^2)^(3/4) dt over (-1, 1) is B(1/2, 7/4)
    beta = math.sqrt(math.pi) * math.gamma(7 / 4) / math.gamma(9 / 4)
    slow, fast = 8 / (3 * math.pi), 2 / math.sqrt(math.pi) * 2 / 3 * 2**1.5 * beta / math.pi
    return heat_flux * radius / heat_conductivity / math.sqrt(1 / slow**2 + peclet / fast**2)
