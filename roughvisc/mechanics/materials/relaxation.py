"""Exact creep compliances of materials given by relaxation moduli, or with an elastic bulk modulus.

With an elastic bulk modulus the Poisson ratio changes in time: viscoelastic in shear, elastic in volume.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.checks import Kind, tensile_to_shear
from roughvisc.mechanics.materials.prony import Prony, merged, secular_roots
from roughvisc.units import Quantity, number, quantities

#: A sum of ratios that differs from one by at most this counts as one: a fluid.
_ONE = 1e-9
#: Sum of the moduli over the equilibrium modulus below which moduli of at most one are dimensionless ratios.
_RATIOS = 1e-3


@quantities(equilibrium="Pa", moduli="Pa", times="s", instantaneous="Pa > 0", bulk_modulus="Pa > 0")
def from_relaxation(
    equilibrium: Quantity | None = None,
    moduli: Sequence[Quantity] = (),
    times: Sequence[Quantity] = (),
    poisson: float | None = None,
    *,
    instantaneous: Quantity | None = None,
    ratios: Sequence[float] = (),
    kind: Kind = "shear",
    bulk_modulus: Quantity | None = None,
) -> Prony:
    r"""Generalised Maxwell solid, ``G(t) = G_e + sum G_i exp(-t / theta_i)``.

    Papers and finite-element codes also use ``G(t) = G_0 [1 - sum g_i (1 - exp(-t / theta_i))]``, with the
    instantaneous modulus and ratios.

    Parameters
    ----------
    equilibrium : float or str
        ``G_e``; exactly zero makes a fluid. [Pa]
    moduli, times : sequence of float or str
        ``G_i`` [Pa] and relaxation times ``theta_i`` [s].
    poisson : float
        Poisson ratio; a half unless given.
    instantaneous : float or str
        ``G_0``, instead of `equilibrium`. [Pa]
    ratios : sequence of float
        ``g_i = G_i / G_0``, instead of `moduli`; a sum of one makes a fluid. [-]
    kind : {"shear", "tensile"}
        Whether the moduli are shear moduli or Young's moduli, ``E = 2 G (1 + nu)``.
    bulk_modulus : float or str
        Elastic bulk modulus ``K``, instead of a Poisson ratio. [Pa]

    Returns
    -------
    Prony
        The same material, given by its creep compliance.

    Raises
    ------
    InputError
        If a modulus is negative, a time is not positive, or their numbers differ; if all moduli are zero; if the ratios
        exceed one in sum, or are given as moduli; if a bulk modulus is given with a Poisson ratio, or is below a ninth
        of Young's modulus.

    Examples
    --------
    >>> rubber = from_relaxation(instantaneous="4 MPa", ratios=[0.75], times=["1 s"])
    >>> float(rubber.creep_compliance(0.0)), round(1 / float(rubber.creep_compliance(1e9)))
    (2.5e-07, 1000000)
    """
    if (equilibrium is None) == (instantaneous is None):
        key = "equilibrium" if instantaneous is None else "instantaneous"
        raise InputError(key=key, found=instantaneous, expected="either equilibrium or instantaneous")
    given, terms, unit = ("moduli", moduli, "Pa") if instantaneous is None else ("ratios", ratios, "1")
    if len(moduli) and len(ratios):
        raise InputError(key="ratios", found=ratios, expected="moduli with equilibrium, or ratios with instantaneous")
    if len(terms) != len(times):
        raise InputError(key=given, found=len(terms), expected=f"as many as times, {len(times)}")
    for i, (term, time) in enumerate(zip(terms, times, strict=True)):
        number(term, unit, f"{given}[{i}]", least=0)
        number(time, "s", f"times[{i}]", above=0)
    if instantaneous is not None:
        rest = 1 - math.fsum(ratios)
        if rest < -_ONE:
            raise InputError(key="ratios", found=ratios, expected=f"ratios with a sum of at most 1, not {1 - rest:g}")
        equilibrium, moduli = instantaneous * (rest if rest > _ONE else 0.0), [instantaneous * one for one in ratios]
    equilibrium = number(equilibrium, "Pa", "equilibrium", least=0)
    if len(moduli) and 0 < max(moduli) <= 1 and sum(moduli) < _RATIOS * equilibrium:
        expected = "moduli [Pa]; ratios without a unit belong to instantaneous= and ratios="
        raise InputError(key="moduli", found=moduli, expected=expected)
    if bulk_modulus is not None and poisson is not None:
        raise InputError(key="bulk_modulus", found=bulk_modulus, expected="either poisson or bulk_modulus")
    factor = tensile_to_shear(kind, 0.5 if poisson is None else poisson)
    if bulk_modulus is None:
        moduli = [modulus / factor for modulus in moduli]
        shear = relaxation_series(equilibrium / factor, moduli, times)
        return shear if poisson is None else dataclasses.replace(shear, poisson=poisson)
    found = relaxation_series(equilibrium, moduli, times)
    if kind == "tensile":
        shear = found.scaled(1.0, 1 / 3)  # 1/G = 3/E - 1/(3K)
        if shear.glassy <= 1 / (3 * bulk_modulus):
            expected = f"more than a ninth of the instantaneous Young's modulus, {1 / found.glassy:g} Pa"
            raise InputError(key="bulk_modulus", found=bulk_modulus, expected=expected)
        found = dataclasses.replace(shear, glassy=shear.glassy - 1 / (3 * bulk_modulus))
    return with_elastic_bulk(found, bulk_modulus)


def relaxation_series(equilibrium: float, moduli: Sequence[float], times: Sequence[float]) -> Prony:
    """Return the creep compliance of the relaxation modulus ``G_e + sum G_i exp(-t / theta_i)``, [Pa], [s]; exact.

    Notes
    -----
    The retardation rates are the zeros of ``G_e - sum G_i lambda / (r_i - lambda)``, found between
    consecutive rates ``r_i = 1/theta_i``.
    """
    weights, rates = merged(moduli, times)
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
    return Prony(1 / glassy_modulus, fluidity, tuple(compliances), tuple(retardations))


def with_elastic_bulk(shear: Prony, bulk_modulus: float) -> Prony:
    r"""Return the series with the contact compliance of a material with an elastic bulk modulus.

    Parameters
    ----------
    shear : Prony
        Shear creep compliance ``J(t)``; its Poisson ratio is not used.
    bulk_modulus : float
        Bulk modulus ``K``. [Pa]

    Returns
    -------
    Prony
        ``J + 3 B`` at a Poisson ratio of a half, so that its contact compliance is ``(J + 3 B) / 4``.

    Notes
    -----
    In the transformed domain :math:`(1 - \nu)/G = \tfrac12 [1/G + 3/(3K + G)]`, and ``B`` is the creep compliance
    of the relaxation modulus ``3K + G(t)``: regular up to incompressibility, at which ``B`` vanishes.
    With ``J^ = s J~``, ``B^ = J^/(1 + 3K J^) = 1/(3K) - 1/((3K)^2 (1/(3K) + J^))``: the rates of ``B`` are the zeros
    of ``1/(3K) + J_0 - phi/m + sum J_i r_i / (r_i - m)``.
    """
    strengths, poles = shear.poles()
    volume = 1 / (3 * bulk_modulus)
    compliances, times = list(shear.compliances), list(shear.times)
    for rate, offsets in secular_roots(strengths, poles, volume + shear.glassy):
        compliances.append(3 * volume**2 / (rate * float(np.sum(strengths / offsets**2))))
        times.append(1 / rate)
    glassy = shear.glassy + 3 * volume * shear.glassy / (volume + shear.glassy)
    return Prony(
        glassy,
        shear.fluidity,
        tuple(compliances),
        tuple(times),
        note=f"effective compliance J + 3B for an elastic bulk modulus of {bulk_modulus:g} Pa",
        stands_for="a body with an elastic bulk modulus, whose Poisson ratio changes in time",
    )
