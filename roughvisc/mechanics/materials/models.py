"""Materials of springs and dashpots.

The half-space enters the contact through one function, the contact compliance
``C(t) = 1/E*(t) = (1 - nu) J(t) / 2`` with the shear creep compliance ``J``; two deformable bodies add theirs.

The constructors take either a Poisson ratio, constant in time (a half unless given), or an elastic bulk modulus,
with which it changes in time: see :func:`roughvisc.mechanics.materials.relaxation.with_elastic_bulk`.
"""

from __future__ import annotations

from collections.abc import Callable

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.checks import check_number, tensile_to_shear
from roughvisc.mechanics.materials.creep import Material, power_law
from roughvisc.mechanics.materials.derived import pair
from roughvisc.mechanics.materials.prony import Prony
from roughvisc.mechanics.materials.relaxation import from_relaxation, in_volume
from roughvisc.mechanics.materials.tables import creep_table, dynamic_table, relaxation_table
from roughvisc.units import Quantity, quantities


def _spring(
    shear: float | None, young: float | None, poisson: float | None, bulk_modulus: float | None, part: str = ""
) -> float:
    """Return the shear modulus of a spring stated by either modulus: ``G = E / (2 (1 + nu))``. [Pa]

    Parameters
    ----------
    shear, young : float or None
        Exactly one modulus. [Pa]
    poisson, bulk_modulus : float or None
        Behaviour in volume of the material.
    part : str
        First letters of the arguments' names, of a spring that is not the first.
    """
    of_shear, of_young = (f"{part or 'shear_'}modulus", f"{part}young_modulus")
    if (shear is None) == (young is None):
        message = f"{of_shear} is {shear!r} and {of_young} is {young!r}: expected one of them"
        key = of_shear if young is None else of_young
        raise InputError(message, key=key, found=young, expected=f"either {of_shear} or {of_young}")
    if young is None:
        return check_number(of_shear, shear, "Pa")
    young = check_number(of_young, young, "Pa")
    if bulk_modulus is not None:
        wanted = f"{of_shear}, or a Poisson ratio"
        message = f"{of_young} is {young!r} and bulk_modulus is {bulk_modulus!r}: expected {wanted}"
        raise InputError(message, key="bulk_modulus", found=bulk_modulus, expected=wanted)
    return young / tensile_to_shear("tensile", 0.5 if poisson is None else poisson)


@quantities(shear_modulus="Pa", young_modulus="Pa", bulk_modulus="Pa")
def elastic(
    shear_modulus: Quantity | None = None,
    poisson: float | None = None,
    *,
    young_modulus: Quantity | None = None,
    bulk_modulus: Quantity | None = None,
) -> Prony:
    """Elastic half-space: no memory.

    Parameters
    ----------
    shear_modulus, young_modulus : float or str
        Exactly one: ``G``, or ``E = 2 G (1 + nu)``. [Pa]
    poisson : float, optional
        Poisson ratio, constant in time; a half unless given. [-]
    bulk_modulus : float or str, optional
        Elastic bulk modulus instead, with which the Poisson ratio changes in time. [Pa]

    Returns
    -------
    Prony

    Raises
    ------
    InputError
        If a number is not positive and finite; if both or none of `shear_modulus` and `young_modulus` are given, or
        `young_modulus` with a bulk modulus; or if both a Poisson ratio and a bulk modulus are given.

    Examples
    --------
    >>> elastic(young_modulus="210 GPa", poisson=0.3)
    elastic(shear_modulus=80.7692 GPa, poisson=0.3)
    """
    modulus = _spring(shear_modulus, young_modulus, poisson, bulk_modulus)
    return in_volume(Prony(1 / modulus), poisson, bulk_modulus)


@quantities(shear_modulus="Pa", viscosity="Pa s", young_modulus="Pa", bulk_modulus="Pa")
def maxwell(
    shear_modulus: Quantity | None = None,
    viscosity: Quantity | None = None,
    poisson: float | None = None,
    *,
    young_modulus: Quantity | None = None,
    bulk_modulus: Quantity | None = None,
) -> Prony:
    """Maxwell fluid: a spring in series with a dashpot; ``J = 1/G + t/eta``.

    Parameters
    ----------
    shear_modulus, young_modulus : float or str
        Exactly one: ``G`` of the spring, or its ``E = 2 G (1 + nu)``. [Pa]
    viscosity : float or str
        ``eta`` of the dashpot, in shear. [Pa s]
    poisson : float, optional
        Poisson ratio, constant in time; a half unless given. [-]
    bulk_modulus : float or str, optional
        Elastic bulk modulus instead, with which the Poisson ratio changes in time. [Pa]

    Returns
    -------
    Prony

    Raises
    ------
    InputError
        If a number is not positive and finite; if both or none of `shear_modulus` and `young_modulus` are given, or
        `young_modulus` with a bulk modulus; or if both a Poisson ratio and a bulk modulus are given.
    """
    modulus = _spring(shear_modulus, young_modulus, poisson, bulk_modulus)
    viscosity = check_number("viscosity", viscosity, "Pa s")
    return in_volume(Prony(1 / modulus, fluidity=1 / viscosity), poisson, bulk_modulus)


@quantities(shear_modulus="Pa", viscosity="Pa s", young_modulus="Pa", bulk_modulus="Pa")
def kelvin_voigt(
    shear_modulus: Quantity | None = None,
    viscosity: Quantity | None = None,
    poisson: float | None = None,
    *,
    young_modulus: Quantity | None = None,
    bulk_modulus: Quantity | None = None,
) -> Prony:
    """Kelvin-Voigt solid: a spring parallel to a dashpot; ``J = (1 - exp(-G t / eta)) / G``.

    Parameters
    ----------
    shear_modulus, young_modulus : float or str
        Exactly one: ``G`` of the spring, or its ``E = 2 G (1 + nu)``. [Pa]
    viscosity : float or str
        ``eta`` of the dashpot, in shear. [Pa s]
    poisson : float, optional
        Poisson ratio, constant in time; a half unless given. [-]
    bulk_modulus : float or str, optional
        Elastic bulk modulus instead, with which the Poisson ratio changes in time. [Pa]

    Returns
    -------
    Prony

    Raises
    ------
    InputError
        If a number is not positive and finite; if both or none of `shear_modulus` and `young_modulus` are given, or
        `young_modulus` with a bulk modulus; or if both a Poisson ratio and a bulk modulus are given.
    """
    modulus = _spring(shear_modulus, young_modulus, poisson, bulk_modulus)
    viscosity = check_number("viscosity", viscosity, "Pa s")
    shear = Prony(0.0, compliances=(1 / modulus,), times=(viscosity / modulus,))
    return in_volume(shear, poisson, bulk_modulus)


@quantities(
    shear_modulus="Pa",
    kelvin_modulus="Pa",
    kelvin_viscosity="Pa s",
    young_modulus="Pa",
    kelvin_young_modulus="Pa",
    bulk_modulus="Pa",
)
def zener(
    shear_modulus: Quantity | None = None,
    kelvin_modulus: Quantity | None = None,
    kelvin_viscosity: Quantity | None = None,
    poisson: float | None = None,
    *,
    young_modulus: Quantity | None = None,
    kelvin_young_modulus: Quantity | None = None,
    bulk_modulus: Quantity | None = None,
) -> Prony:
    """Zener (standard linear) solid: a spring in series with a Kelvin element.

    ``J = 1/G + (1 - exp(-G_K t / eta_K)) / G_K``.

    Parameters
    ----------
    shear_modulus, young_modulus : float or str
        Exactly one: ``G`` of the spring, the instantaneous modulus, or its ``E = 2 G (1 + nu)``. [Pa]
    kelvin_modulus, kelvin_young_modulus : float or str
        Exactly one: ``G_K`` of the Kelvin element's spring, or its ``E_K = 2 G_K (1 + nu)``. [Pa]
    kelvin_viscosity : float or str
        ``eta_K`` of the Kelvin element, in shear. [Pa s]
    poisson : float, optional
        Poisson ratio, constant in time; a half unless given. [-]
    bulk_modulus : float or str, optional
        Elastic bulk modulus instead, with which the Poisson ratio changes in time. [Pa]

    Returns
    -------
    Prony

    Raises
    ------
    InputError
        If a number is not positive and finite; if both or none of the two moduli of a spring are given, or a Young's
        modulus with a bulk modulus; or if both a Poisson ratio and a bulk modulus are given.

    Examples
    --------
    >>> zener(young_modulus="9 MPa", kelvin_young_modulus="3 MPa", kelvin_viscosity="0.1 MPa s")  # nu is a half
    zener(shear_modulus=3 MPa, kelvin_modulus=1 MPa, kelvin_viscosity=100 kPa s)
    """
    modulus = _spring(shear_modulus, young_modulus, poisson, bulk_modulus)
    retarded = _spring(kelvin_modulus, kelvin_young_modulus, poisson, bulk_modulus, "kelvin_")
    kelvin_viscosity = check_number("kelvin_viscosity", kelvin_viscosity, "Pa s")
    shear = Prony(1 / modulus, 0.0, (1 / retarded,), (kelvin_viscosity / retarded,))
    return in_volume(shear, poisson, bulk_modulus)


#: Function of each model of a material that a study may name; its arguments are the keys of the table.
MODELS: dict[str, Callable[..., Material]] = {
    "elastic": elastic,
    "maxwell": maxwell,
    "kelvin_voigt": kelvin_voigt,
    "zener": zener,
    "from_relaxation": from_relaxation,
    "prony": Prony,
    "power_law": power_law,
    "creep_table": creep_table,
    "relaxation_table": relaxation_table,
    "dynamic_table": dynamic_table,
    "pair": pair,
}
