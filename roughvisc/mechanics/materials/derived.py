"""Materials made from other ones: two bodies, another temperature, another modulus."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.checks import check_number
from roughvisc.mechanics.materials.creep import Creep, Material, complete, pair_creep
from roughvisc.mechanics.materials.prony import Prony

#: Shift factors above this, or below its inverse, come from a temperature in a wrong unit.
LARGEST_SHIFT = 1e30
#: Name of the bodies of a pair.
_TWO_BODIES = "a pair of bodies"


def pair(a: Material, b: Material) -> Prony | Creep:
    """Two deformable bodies: their contact compliances add.

    Parameters
    ----------
    a, b : Material
        The two materials, in any order.

    Returns
    -------
    Prony or Creep
        A series if both are series. Its Poisson ratio is a half; each body keeps its own.

    Examples
    --------
    >>> from roughvisc.mechanics.materials.models import elastic, maxwell
    >>> float(pair(elastic(2e6, 0.3), maxwell(1e6, 1e6)).contact_compliance(3.0))  # 0.35/2e6 + 0.25 (1 + 3)/1e6
    1.175e-06
    """
    first, second = complete(a), complete(b)
    note = "; ".join(f"{name}: {body.note}" for name, body in (("a", first), ("b", second)) if body.note)
    if isinstance(first, Prony) and isinstance(second, Prony):
        glassy, fluidity = 0.0, 0.0
        compliances: dict[float, float] = {}
        for body in (first, second):
            share = 2 * (1 - body.poisson)  # J = 4 C, with C = (1 - nu) J / 2 of the body
            glassy += share * body.glassy
            fluidity += share * body.fluidity
            for compliance, time in zip(body.compliances, body.times, strict=True):
                compliances[time] = compliances.get(time, 0.0) + share * compliance
        terms = tuple(compliances.values()), tuple(compliances)
        return Prony(glassy, fluidity, *terms, note=note, stands_for=_TWO_BODIES)
    measured = [body for body in (first, second) if isinstance(body, Creep)]
    return Creep(
        pair_creep,
        (first, second),
        label=f"pair({first!r}, {second!r})",
        note=note,
        warning=" ".join(filter(None, (body.warning for body in measured))),
        misfit=max(body.misfit for body in measured),
        stands_for=_TWO_BODIES,
    )


def shift(material: Material, factor: float) -> Prony | Creep:
    r"""Shift a material to another temperature: multiply all its times by one factor.

    Parameters
    ----------
    material : Material
        Material at its reference temperature. Both bodies of a pair are shifted.
    factor : float
        Shift factor ``a_T``, from :func:`wlf`, :func:`arrhenius` or a measurement; above one for slower response, at
        lower temperature. [-]

    Returns
    -------
    Prony or Creep
        The shifted material. Its ``note`` states the factor.

    Raises
    ------
    InputError
        If the factor is not between 1e-30 and 1e30.

    Notes
    -----
    .. math:: C(t;\, T) = C(t / a_T;\, T_r)

    The material is thermorheologically simple: temperature changes only times, not compliances. There is no vertical
    shift.

    Examples
    --------
    >>> from roughvisc.mechanics.materials.models import maxwell
    >>> float(shift(maxwell(1e6, 1e6), 10.0).creep_compliance(20.0))  # J(2 s) at the reference temperature
    3e-06
    """
    if not (isinstance(factor, int | float | np.number) and 1 / LARGEST_SHIFT <= factor <= LARGEST_SHIFT):
        raise InputError(key="factor", found=factor, expected="a number from 1e-30 to 1e30")
    return _scaled(material, float(factor), 1.0, f"all times multiplied by {factor:.6g} (time-temperature shift)")


def stiffened(material: Material, factor: float) -> Prony | Creep:
    r"""Multiply all moduli and viscosities of a material by one factor, :math:`C(t) \to C(t) / f`.

    Parameters
    ----------
    material : Material
        Both bodies of a pair are stiffened.
    factor : float
        Above one: stiffer. [-]

    Returns
    -------
    Prony or Creep
        Its ``note`` states the factor.

    Raises
    ------
    InputError
        If the factor is not positive and finite.

    Examples
    --------
    >>> from roughvisc.mechanics.materials.models import elastic
    >>> stiffened(elastic(1e6), 2.0).glassy
    5e-07
    """
    check_number("modulus_factor", factor, "1")
    return _scaled(material, 1.0, float(factor), f"all moduli multiplied by {factor:.6g}")


def _scaled(material: Material, time_factor: float, modulus_factor: float, note: str) -> Prony | Creep:
    material = complete(material)
    if isinstance(material, Prony):
        return material.scaled(time_factor, modulus_factor, note)
    return replace(
        material,
        time_factor=time_factor * material.time_factor,
        modulus_factor=modulus_factor * material.modulus_factor,
        label=f"{material.label}, {note}",
        note="; ".join(filter(None, (material.note, note))),
    )
