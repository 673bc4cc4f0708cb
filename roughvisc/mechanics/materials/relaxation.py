"""Exact creep compliances of materials stated by moduli: relaxation in exponentials, or an elastic bulk modulus.

With an elastic bulk modulus the Poisson ratio changes in time: viscoelastic in shear, elastic in volume.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.checks import Kind, check_number, tensile_to_shear
from roughvisc.mechanics.materials.prony import Prony
from roughvisc.mechanics.materials.secular import merged, secular_roots
from roughvisc.units import Quantity, quantities


@quantities(equilibrium="Pa", moduli="Pa", times="s", bulk_modulus="Pa")
def from_relaxation(
    equilibrium: Quantity,
    moduli: Sequence[Quantity],
    times: Sequence[Quantity],
    poisson: float | None = None,
    *,
    kind: Kind = "shear",
    bulk_modulus: Quantity | None = None,
) -> Prony:
    r"""Generalised Maxwell solid, ``G(t) = G_e + sum G_i exp(-t / theta_i)``, as finite-element codes state it.

    Parameters
    ----------
    equilibrium : float or str
        ``G_e``; exactly zero makes a fluid. [Pa]
    moduli, times : sequence of float or str
        ``G_i`` [Pa] and relaxation times ``theta_i`` [s].
    poisson : float
        Poisson ratio; a half unless given.
    kind : {"shear", "tensile"}
        Whether the moduli are shear moduli or Young's moduli, ``E = 2 G (1 + nu)``.
    bulk_modulus : float or str
        Elastic bulk modulus, in place of a Poisson ratio; with shear moduli. [Pa]

    Returns
    -------
    Prony
        The same material by its creep compliance.

    Raises
    ------
    InputError
        If a modulus is negative, a time is not positive, or their numbers differ; if all moduli are zero; or if a
        bulk modulus is given with a Poisson ratio or with Young's moduli.

    Notes
    -----
    The retardation rates are the zeros of ``G_e - sum G_i lambda / (r_i - lambda)``, found between
    consecutive rates ``r_i = 1/theta_i``.
    """
    check_number("equilibrium", equilibrium, "Pa", zero=True)
    if len(moduli) != len(times):
        raise InputError(key="moduli", found=len(moduli), expected=f"as many as times, {len(times)}")
    for i, (modulus, time) in enumerate(zip(moduli, times, strict=True)):
        check_number(f"moduli[{i}]", modulus, "Pa", zero=True)
        check_number(f"times[{i}]", time, "s")
    if kind == "tensile" and bulk_modulus is not None:
        wanted = "shear moduli, or a Poisson ratio"
        message = f"kind is 'tensile' and bulk_modulus is {bulk_modulus!r}: expected {wanted}"
        raise InputError(message, key="bulk_modulus", found=bulk_modulus, expected=wanted)
    factor = tensile_to_shear(kind, 0.5 if poisson is None else poisson)
    weights, rates = merged(moduli, times)
    equilibrium, weights = equilibrium / factor, weights / factor
    glassy_modulus = equilibrium + float(np.sum(weights))
    if glassy_modulus == 0:
        raise InputError(key="moduli", found=moduli, expected="a positive modulus, or a positive equilibrium modulus")
    # dividing G~(s) = G_e + sum G_i s/(s + r_i) by s makes the equilibrium modulus a pole at zero like the others:
    # G~(-m)/(-m) = -G_e/m + sum G_i/(r_i - m), one zero between each two poles and none above the last
    poles = np.append(0.0, rates) if equilibrium else rates
    strengths = np.append(equilibrium, weights) if equilibrium else weights
    compliances, retardations = [], []
    for rate, offset in secular_roots(strengths, poles, 0.0):
        # 1/G~ has the residue J_k rate there, and d(G~)/ds is rate * sum strengths / offset^2
        compliances.append(1 / (rate * rate * float(np.sum(strengths / offset**2))))
        retardations.append(1 / rate)
    fluidity = 0.0 if equilibrium else 1 / float(np.sum(weights / rates))
    shear = Prony(1 / glassy_modulus, fluidity, tuple(compliances), tuple(retardations))
    return in_volume(shear, poisson, bulk_modulus)


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
        message = f"poisson is {poisson!r} and bulk_modulus is {bulk_modulus!r}: expected one of them"
        raise InputError(message, key="bulk_modulus", found=bulk_modulus, expected="poisson or bulk_modulus")
    return with_elastic_bulk(shear, bulk_modulus)
