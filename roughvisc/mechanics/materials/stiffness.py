"""A stiffer or softer material: its moduli all multiplied by one factor."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.mechanics.materials.checks import check_number
from roughvisc.mechanics.materials.models import Material, Pair, PowerLaw, Prony, Tabulated, pair
from roughvisc.mechanics.materials.protocol import complete

Array = NDArray[np.float64]


def stiffened(material: Material, factor: float) -> Material:
    r"""The material with all its moduli and viscosities multiplied by one factor; its times stay.

    Parameters
    ----------
    material : Material
        One of the package's, or of the user's own. Both bodies of a pair are stiffened.
    factor : float
        Above one: stiffer. [-]

    Returns
    -------
    Material
        Of the same kind. Its ``note`` says the factor.

    Raises
    ------
    InputError
        If the factor is not positive and finite.

    Notes
    -----
    .. math:: C(t) \to C(t) / f

    Examples
    --------
    >>> from roughvisc.mechanics.materials.models import elastic
    >>> stiffened(elastic(1e6), 2.0).glassy
    5e-07
    """
    check_number("modulus_factor", factor, "1")
    factor = float(factor)
    if isinstance(material, Pair):
        return pair(stiffened(material.a, factor), stiffened(material.b, factor))
    if isinstance(material, Prony):
        return dataclasses.replace(
            material,
            glassy=material.glassy / factor,
            fluidity=material.fluidity / factor,
            compliances=tuple(one / factor for one in material.compliances),
            note=_noted(material.note, factor),
        )
    if isinstance(material, PowerLaw):
        note, coefficient = _noted(material.note, factor), material.coefficient / factor
        return dataclasses.replace(material, glassy=material.glassy / factor, coefficient=coefficient, note=note)
    if isinstance(material, Tabulated):
        softer = tuple(one / factor for one in material.compliances)
        return dataclasses.replace(material, compliances=softer, remark=_noted(material.remark, factor))
    return Stiffened(complete(material), factor)


@dataclass(frozen=True)
class Stiffened:
    """A material of the user's own with all its moduli multiplied by a factor; made by :func:`stiffened`.

    Parameters
    ----------
    given : Material
        As it is.
    factor : float
        Of the moduli. [-]
    """

    given: Material
    factor: float

    @property
    def poisson(self) -> float:
        """Poisson ratio, which stays."""
        return self.given.poisson

    @property
    def note(self) -> str:
        """What was said of the material, and the factor."""
        return _noted(self.given.note, self.factor)

    def contact_compliance(self, t: ArrayLike) -> Array:
        """Contact compliance. [1/Pa]"""
        return self.given.contact_compliance(t) / self.factor

    def contact_integral(self, t: ArrayLike) -> Array:
        """Its first antiderivative. [s/Pa]"""
        return self.given.contact_integral(t) / self.factor

    def mean_contact_compliance(self, s: ArrayLike, h: ArrayLike) -> Array:
        """Mean over ``[s, s + h]``. [1/Pa]"""
        return self.given.mean_contact_compliance(s, h) / self.factor


def _noted(note: str, factor: float) -> str:
    said = f"all moduli multiplied by {factor:.6g}"
    return f"{note}; {said}" if note else said
