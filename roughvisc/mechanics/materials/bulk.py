"""A Poisson ratio that changes in time: viscoelastic in shear, elastic in volume."""

from __future__ import annotations

import dataclasses

import numpy as np

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.checks import check_number
from roughvisc.mechanics.materials.prony import Prony
from roughvisc.mechanics.materials.secular import secular_roots


def with_elastic_bulk(shear: Prony, bulk_modulus: float) -> Prony:
    r"""Series that makes contact as a material with this shear creep and an elastic bulk modulus does.

    Parameters
    ----------
    shear : Prony
        Shear creep compliance ``J(t)``; its Poisson ratio does not count.
    bulk_modulus : float
        ``K``. [Pa]

    Returns
    -------
    Prony
        ``J + 3 B`` at a Poisson ratio of a half, so that its contact compliance is ``(J + 3 B) / 4``.

    Notes
    -----
    In the transformed domain :math:`(1 - \nu)/G = \tfrac12 [1/G + 3/(3K + G)]`, and ``B`` is the creep compliance
    that belongs to the relaxation modulus ``3K + G(t)``: regular up to incompressibility, where it vanishes.
    With ``J^ = s J~``, ``B^ = J^/(1 + 3K J^) = 1/(3K) - 1/((3K)^2 (1/(3K) + J^))``: the rates of ``B`` are the zeros
    of ``1/(3K) + J_0 - phi/m + sum J_i r_i / (r_i - m)``.
    """
    check_number("bulk_modulus", bulk_modulus, "Pa")
    strengths, poles = shear.poles()
    volume = 1 / (3 * bulk_modulus)
    compliances, times = list(shear.compliances), list(shear.times)
    for rate, offsets in secular_roots(strengths, poles, volume + shear.glassy):
        compliances.append(3 * volume**2 / (rate * float(np.sum(strengths / offsets**2))))
        times.append(1 / rate)
    glassy = shear.glassy + 3 * volume * shear.glassy / (volume + shear.glassy)
    note = f"effective compliance J + 3B for an elastic bulk modulus of {bulk_modulus:g} Pa"
    note = f"{shear.note}; {note}" if shear.note else note
    return Prony(
        glassy,
        shear.fluidity,
        tuple(compliances),
        tuple(times),
        0.5,
        note,
        "a body with an elastic bulk modulus, whose Poisson ratio changes in time",
    )


def in_volume(shear: Prony, poisson: float | None, bulk_modulus: float | None) -> Prony:
    """The series with its behaviour in volume: a constant Poisson ratio, a half unless given, or a bulk modulus. [Pa]

    Raises
    ------
    InputError
        If both are given.
    """
    if bulk_modulus is None:
        return dataclasses.replace(shear, poisson=0.5 if poisson is None else poisson)
    if poisson is not None:
        raise InputError(f"poisson is {poisson!r} and bulk_modulus is {bulk_modulus!r}: expected one of them")
    return with_elastic_bulk(shear, bulk_modulus)
