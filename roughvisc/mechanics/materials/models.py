"""Linear viscoelastic materials: creep compliances ``J(t)`` and what the contact needs of them.

The half-space enters the contact through one function, the contact compliance
``C(t) = 1/E*(t) = (1 - nu) J(t) / 2`` with the shear creep compliance ``J``; two deformable bodies add theirs.

The constructors take either a Poisson ratio, constant in time (a half unless given), or an elastic bulk modulus,
with which it changes in time: see :func:`roughvisc.mechanics.materials.bulk.with_elastic_bulk`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.mechanics.materials.bulk import in_volume
from roughvisc.mechanics.materials.checks import check_number
from roughvisc.mechanics.materials.measured import from_creep_table, from_dynamic, from_relaxation_table
from roughvisc.mechanics.materials.power_law import PowerLaw
from roughvisc.mechanics.materials.prony import Prony, one_less_mean_decay
from roughvisc.mechanics.materials.protocol import Material, complete
from roughvisc.mechanics.materials.relaxation import from_relaxation
from roughvisc.mechanics.materials.tabulated import Tabulated
from roughvisc.notebook import table

__all__ = [
    "Material",
    "Pair",
    "PowerLaw",
    "Prony",
    "Tabulated",
    "elastic",
    "from_creep_table",
    "from_dynamic",
    "from_relaxation",
    "from_relaxation_table",
    "kelvin_voigt",
    "maxwell",
    "one_less_mean_decay",
    "pair",
    "zener",
]

Array = NDArray[np.float64]


def elastic(shear_modulus: float, poisson: float | None = None, *, bulk_modulus: float | None = None) -> Prony:
    """Elastic half-space: no memory.

    Parameters
    ----------
    shear_modulus : float
        ``G``. [Pa]
    poisson : float, optional
        Poisson ratio, constant in time; a half unless given. [-]
    bulk_modulus : float, optional
        Elastic bulk modulus instead, with which the Poisson ratio changes in time. [Pa]

    Returns
    -------
    Prony

    Raises
    ------
    InputError
        If a number is not positive and finite, or both a Poisson ratio and a bulk modulus are given.
    """
    check_number("shear_modulus", shear_modulus, "Pa")
    return in_volume(Prony(1 / shear_modulus), poisson, bulk_modulus)


def maxwell(
    shear_modulus: float, viscosity: float, poisson: float | None = None, *, bulk_modulus: float | None = None
) -> Prony:
    """Maxwell fluid: a spring in series with a dashpot; ``J = 1/G + t/eta``.

    Parameters
    ----------
    shear_modulus : float
        ``G`` of the spring. [Pa]
    viscosity : float
        ``eta`` of the dashpot. [Pa s]
    poisson : float, optional
        Poisson ratio, constant in time; a half unless given. [-]
    bulk_modulus : float, optional
        Elastic bulk modulus instead, with which the Poisson ratio changes in time. [Pa]

    Returns
    -------
    Prony

    Raises
    ------
    InputError
        If a number is not positive and finite, or both a Poisson ratio and a bulk modulus are given.
    """
    check_number("shear_modulus", shear_modulus, "Pa")
    check_number("viscosity", viscosity, "Pa s")
    return in_volume(Prony(1 / shear_modulus, fluidity=1 / viscosity), poisson, bulk_modulus)


def kelvin_voigt(
    shear_modulus: float, viscosity: float, poisson: float | None = None, *, bulk_modulus: float | None = None
) -> Prony:
    """Kelvin-Voigt solid: a spring parallel to a dashpot; ``J = (1 - exp(-G t / eta)) / G``.

    Parameters
    ----------
    shear_modulus : float
        ``G`` of the spring. [Pa]
    viscosity : float
        ``eta`` of the dashpot. [Pa s]
    poisson : float, optional
        Poisson ratio, constant in time; a half unless given. [-]
    bulk_modulus : float, optional
        Elastic bulk modulus instead, with which the Poisson ratio changes in time. [Pa]

    Returns
    -------
    Prony

    Raises
    ------
    InputError
        If a number is not positive and finite, or both a Poisson ratio and a bulk modulus are given.
    """
    check_number("shear_modulus", shear_modulus, "Pa")
    check_number("viscosity", viscosity, "Pa s")
    shear = Prony(0.0, compliances=(1 / shear_modulus,), times=(viscosity / shear_modulus,))
    return in_volume(shear, poisson, bulk_modulus)


def zener(
    shear_modulus: float,
    kelvin_modulus: float,
    kelvin_viscosity: float,
    poisson: float | None = None,
    *,
    bulk_modulus: float | None = None,
) -> Prony:
    """Zener (standard linear) solid: a spring in series with a Kelvin element.

    ``J = 1/G + (1 - exp(-G_K t / eta_K)) / G_K``.

    Parameters
    ----------
    shear_modulus : float
        ``G`` of the spring: the modulus at once. [Pa]
    kelvin_modulus : float
        ``G_K`` of the Kelvin element. [Pa]
    kelvin_viscosity : float
        ``eta_K`` of the Kelvin element. [Pa s]
    poisson : float, optional
        Poisson ratio, constant in time; a half unless given. [-]
    bulk_modulus : float, optional
        Elastic bulk modulus instead, with which the Poisson ratio changes in time. [Pa]

    Returns
    -------
    Prony

    Raises
    ------
    InputError
        If a number is not positive and finite, or both a Poisson ratio and a bulk modulus are given.
    """
    check_number("shear_modulus", shear_modulus, "Pa")
    check_number("kelvin_modulus", kelvin_modulus, "Pa")
    check_number("kelvin_viscosity", kelvin_viscosity, "Pa s")
    shear = Prony(1 / shear_modulus, 0.0, (1 / kelvin_modulus,), (kelvin_viscosity / kelvin_modulus,))
    return in_volume(shear, poisson, bulk_modulus)


#: What a pair stands for.
TWO_BODIES = "a pair of bodies"


@dataclass(frozen=True)
class Pair:
    """Two deformable bodies pressed on each other; made by :func:`pair`."""

    a: Material
    b: Material

    def __repr__(self) -> str:
        """As it was built."""
        return f"pair({self.a!r}, {self.b!r})"

    def _repr_html_(self) -> str:
        return table("pair", [("a", repr(self.a)), ("b", repr(self.b))])

    @property
    def poisson(self) -> float:
        """A half, as for a series that stands for two bodies; each body has its own."""
        return 0.5

    @property
    def stands_for(self) -> str:
        """No one body."""
        return TWO_BODIES

    @property
    def note(self) -> str:
        """The notes of both."""
        return _notes(self.a, self.b)

    def creep_compliance(self, t: ArrayLike) -> Array:
        """Shear creep compliance of one incompressible body that would make the same contact. [1/Pa]"""
        return 4 * self.contact_compliance(t)

    def contact_compliance(self, t: ArrayLike) -> Array:
        """Sum of the contact compliances. [1/Pa]"""
        return self.a.contact_compliance(t) + self.b.contact_compliance(t)

    def contact_integral(self, t: ArrayLike) -> Array:
        """Its first antiderivative. [s/Pa]"""
        return self.a.contact_integral(t) + self.b.contact_integral(t)

    def mean_contact_compliance(self, s: ArrayLike, h: ArrayLike) -> Array:
        """Its mean over ``[s, s + h]``. [1/Pa]"""
        return self.a.mean_contact_compliance(s, h) + self.b.mean_contact_compliance(s, h)


def pair(a: Material, b: Material) -> Prony | Pair:
    """Two deformable bodies: their contact compliances add.

    Parameters
    ----------
    a, b : Material
        The two materials, in any order.

    Returns
    -------
    Prony or Pair
        One series, with a Poisson ratio of 0.5, if both are series.

    Examples
    --------
    >>> float(pair(elastic(2e6, 0.3), maxwell(1e6, 1e6)).contact_compliance(3.0))  # 0.35/2e6 + 0.25 (1 + 3)/1e6
    1.175e-06
    """
    if not (isinstance(a, Prony) and isinstance(b, Prony)):
        return Pair(complete(a), complete(b))
    glassy, fluidity = 0.0, 0.0
    compliances: dict[float, float] = {}
    for body in (a, b):
        share = 2 * (1 - body.poisson)  # J = 4 C, with C = (1 - nu) J / 2 of the body
        glassy += share * body.glassy
        fluidity += share * body.fluidity
        for compliance, time in zip(body.compliances, body.times, strict=True):
            compliances[time] = compliances.get(time, 0.0) + share * compliance
    return Prony(
        glassy, fluidity, tuple(compliances.values()), tuple(compliances), note=_notes(a, b), stands_for=TWO_BODIES
    )


def _notes(a: Material, b: Material) -> str:
    return "; ".join(f"{name}: {body.note}" for name, body in (("a", a), ("b", b)) if body.note)
