"""Materials of springs and dashpots, and the models that a study may name.

The half-space enters the contact through one function, the contact compliance
``C(t) = 1/E*(t) = (1 - nu) J(t) / 2`` with the shear creep compliance ``J``; two deformable bodies add theirs.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.creep import Material, pair, power_law
from roughvisc.mechanics.materials.prony import Prony, tensile_to_shear
from roughvisc.mechanics.materials.relaxation import from_relaxation
from roughvisc.mechanics.materials.tables import creep_table, dynamic_table, relaxation_table
from roughvisc.units import Quantity, quantities


@quantities(shear_modulus="Pa > 0", young_modulus="Pa > 0")
def elastic(
    shear_modulus: Quantity | None = None, poisson: float = 0.5, *, young_modulus: Quantity | None = None
) -> Prony:
    """Elastic half-space: no memory.

    Parameters
    ----------
    shear_modulus, young_modulus : float or str
        Exactly one: ``G``, or ``E = 2 G (1 + nu)``. [Pa]
    poisson : float
        Poisson ratio. [-]

    Returns
    -------
    Prony

    Raises
    ------
    InputError
        If a number is not positive and finite, or both or none of `shear_modulus` and `young_modulus` are given.

    Examples
    --------
    >>> float(elastic(young_modulus="2.6 MPa", poisson=0.3).creep_compliance(0.0))
    1e-06
    """
    if (shear_modulus is None) == (young_modulus is None):
        key = "shear_modulus" if young_modulus is None else "young_modulus"
        raise InputError(key=key, found=young_modulus, expected="either shear_modulus or young_modulus")
    modulus: Any = shear_modulus if young_modulus is None else young_modulus / tensile_to_shear("tensile", poisson)
    return Prony(1 / modulus, poisson=poisson)


@quantities(shear_modulus="Pa > 0", viscosity="Pa s > 0")
def maxwell(shear_modulus: Quantity, viscosity: Quantity, poisson: float = 0.5) -> Prony:
    """Maxwell fluid: a spring in series with a dashpot; ``J = 1/G + t/eta``.

    Parameters
    ----------
    shear_modulus : float or str
        ``G`` of the spring. [Pa]
    viscosity : float or str
        ``eta`` of the dashpot, in shear. [Pa s]
    poisson : float
        Poisson ratio, constant in time. [-]

    Returns
    -------
    Prony

    Raises
    ------
    InputError
        If a number is not positive and finite.
    """
    return Prony(1 / shear_modulus, 1 / viscosity, poisson=poisson)


@quantities(shear_modulus="Pa > 0", viscosity="Pa s > 0")
def kelvin_voigt(shear_modulus: Quantity, viscosity: Quantity, poisson: float = 0.5) -> Prony:
    """Kelvin-Voigt solid: a spring parallel to a dashpot; ``J = (1 - exp(-G t / eta)) / G``.

    Parameters
    ----------
    shear_modulus : float or str
        ``G`` of the spring. [Pa]
    viscosity : float or str
        ``eta`` of the dashpot, in shear. [Pa s]
    poisson : float
        Poisson ratio, constant in time. [-]

    Returns
    -------
    Prony

    Raises
    ------
    InputError
        If a number is not positive and finite.
    """
    return Prony(0.0, 0.0, (1 / shear_modulus,), (viscosity / shear_modulus,), poisson)


@quantities(shear_modulus="Pa > 0", kelvin_modulus="Pa > 0", kelvin_viscosity="Pa s > 0")
def zener(shear_modulus: Quantity, kelvin_modulus: Quantity, kelvin_viscosity: Quantity, poisson: float = 0.5) -> Prony:
    """Zener (standard linear) solid: a spring in series with a Kelvin element.

    ``J = 1/G + (1 - exp(-G_K t / eta_K)) / G_K``.

    Parameters
    ----------
    shear_modulus : float or str
        ``G`` of the spring, the instantaneous modulus. [Pa]
    kelvin_modulus : float or str
        ``G_K`` of the Kelvin element's spring. [Pa]
    kelvin_viscosity : float or str
        ``eta_K`` of the Kelvin element, in shear. [Pa s]
    poisson : float
        Poisson ratio, constant in time. [-]

    Returns
    -------
    Prony

    Raises
    ------
    InputError
        If a number is not positive and finite.

    Examples
    --------
    >>> zener("4 MPa", "2 MPa", "0.1 MPa s")
    Prony(glassy=2.5e-07, fluidity=0.0, compliances=(5e-07,), times=(0.05,), poisson=0.5)
    """
    return Prony(1 / shear_modulus, 0.0, (1 / kelvin_modulus,), (kelvin_viscosity / kelvin_modulus,), poisson)


_SPRINGS_AND_DASHPOTS = (elastic, maxwell, kelvin_voigt, zener, from_relaxation, Prony)
_OTHERS = (power_law, creep_table, relaxation_table, dynamic_table, pair)
#: Function of each model of a material that a study may name; its arguments are the keys of the table.
MODELS: dict[str, Callable[..., Material]] = {one.__name__.lower(): one for one in (*_SPRINGS_AND_DASHPOTS, *_OTHERS)}
