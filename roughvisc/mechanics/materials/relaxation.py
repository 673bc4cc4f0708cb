"""Exact creep compliances of materials given by relaxation moduli, or with an elastic bulk modulus.

With an elastic bulk modulus the Poisson ratio changes in time: viscoelastic in shear, elastic in volume.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.prony import Kind, Prony, tensile_to_shear
from roughvisc.units import Quantity, number, quantities

Array = NDArray[np.float64]

#: A sum of ratios that differs from one by at most this counts as one: a fluid.
_ONE = 1e-9
#: Sum of the moduli over the equilibrium modulus below which moduli of at most one are dimensionless ratios.
_RATIOS = 1e-3
#: Largest ratio of the distances of a zero from the poles next to it, and number of bisections.
_LARGEST_RATIO, _BISECTIONS = 1e250, 70


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
        raise InputError(key="moduli", found=moduli, expected="moduli [Pa]; for ratios, instantaneous= and ratios=")
    if bulk_modulus is not None and poisson is not None:
        raise InputError(key="bulk_modulus", found=bulk_modulus, expected="either poisson or bulk_modulus")
    constant = 0.5 if poisson is None else poisson
    factor = tensile_to_shear(kind, constant)
    if bulk_modulus is None:
        return relaxation_series(equilibrium / factor, [one / factor for one in moduli], times, constant)
    return _with_elastic_bulk(equilibrium, moduli, times, bulk_modulus, kind)


def _with_elastic_bulk(
    equilibrium: float, moduli: Sequence[float], times: Sequence[float], bulk_modulus: float, kind: Kind
) -> Prony:
    r"""Return the series with the contact compliance of a relaxing material with an elastic bulk modulus ``K``.

    Notes
    -----
    In the transformed domain the contact compliance is :math:`\tfrac14 [1/G + 3/(3K + G)]`, or in terms of Young's
    modulus :math:`3/(4E) + 1/(6K) - E/(36K^2)`. The series has four times this at a Poisson ratio of a half. The
    second term is the creep compliance of the relaxation modulus ``3K + G(t)``, which vanishes for an incompressible
    material; the last is a sum of exponentials with the relaxation times.
    """
    found = relaxation_series(equilibrium, moduli, times)
    if kind == "tensile":
        part = (equilibrium + sum(moduli)) / (9 * bulk_modulus)
        if part >= 1:
            expected = f"more than a ninth of the instantaneous Young's modulus, {1 / found.glassy:g} Pa"
            raise InputError(key="bulk_modulus", found=bulk_modulus, expected=expected)
        found = found.scaled(1.0, 1 / 3)
        glassy, later = found.glassy * (1 - part) * (1 + 3 * part), [one / (9 * bulk_modulus**2) for one in moduli]
    else:
        volume = relaxation_series(3 * bulk_modulus + equilibrium, moduli, times)
        glassy, later, times = found.glassy + 3 * volume.glassy, [3 * one for one in volume.compliances], volume.times
    terms = (*found.compliances, *later), (*found.times, *times)
    note = f"effective compliance for an elastic bulk modulus of {bulk_modulus:g} Pa"
    stands_for = "a body with an elastic bulk modulus, whose Poisson ratio changes in time"
    return Prony(glassy, found.fluidity, *terms, note=note, stands_for=stands_for)


def relaxation_series(
    equilibrium: float, moduli: Sequence[float], times: Sequence[float], poisson: float = 0.5, **about: Any
) -> Prony:
    """Return the creep compliance of the relaxation modulus ``G_e + sum G_i exp(-t / theta_i)``, [Pa], [s]; exact.

    Notes
    -----
    The retardation rates are the zeros of ``G_e - sum G_i lambda / (r_i - lambda)``, found between
    consecutive rates ``r_i = 1/theta_i``.
    """
    weights = np.asarray(moduli, dtype=float)
    poles, place = np.unique(1 / np.asarray(times, dtype=float)[weights > 0], return_inverse=True)
    strengths = np.bincount(place, weights[weights > 0], poles.size).astype(float)  # of equal times together
    glassy_modulus = equilibrium + float(np.sum(strengths))
    if glassy_modulus == 0:
        raise InputError(key="moduli", found=moduli, expected="a positive modulus, or a positive equilibrium modulus")
    fluidity = 0.0 if equilibrium else 1 / float(np.sum(strengths / poles))
    if equilibrium:
        # dividing G~(s) = G_e + sum G_i s/(s + r_i) by s makes the equilibrium modulus a pole at zero like the others:
        # G~(-m)/(-m) = -G_e/m + sum G_i/(r_i - m), one zero between each two poles and none above the last
        strengths, poles = np.append(equilibrium, strengths), np.append(0.0, poles)
    rates, offsets = _secular_roots(strengths, poles)
    # 1/G~ has the residue J_k rate there, and d(G~)/ds is rate * sum strengths / offset^2
    compliances = 1 / (rates * rates * np.sum(strengths / offsets**2, axis=1))
    return Prony(1 / glassy_modulus, fluidity, tuple(compliances), tuple(1 / rates), poisson, **about)


def _secular_roots(strengths: Array, poles: Array) -> tuple[Array, Array]:
    """Return the zeros ``mu`` of ``sum strengths / (poles - mu)``, and their offsets ``poles - mu``.

    Parameters
    ----------
    strengths, poles : ndarray, shape (n,)
        Positive strengths, and ascending poles.

    Returns
    -------
    zeros : ndarray, shape (n - 1,)
        One zero lies between each two poles.
    offsets : ndarray, shape (n - 1, n)
        Distances of the poles from each zero.

    Notes
    -----
    With the distances ``a`` and ``b`` from the poles below and above, the ratio ``a / b`` of a zero is bisected on a
    logarithmic scale, so that the offset of a zero close to a pole is accurate. The equivalent eigenproblem loses the
    slow modes over many decades of rates (24 decades: a negative eigenvalue).
    """
    gaps, below, place = np.diff(poles), poles[:-1], np.arange(poles.size - 1)
    low, high = np.full(gaps.size, 1 / _LARGEST_RATIO), np.full(gaps.size, _LARGEST_RATIO)
    for _ in range(_BISECTIONS):
        ratio = np.sqrt(low) * np.sqrt(high)
        from_below = gaps / (1 + 1 / ratio)
        offsets = (poles - below[:, None]) - from_below[:, None]
        offsets[place, place + 1] = gaps / (1 + ratio)
        is_beyond = np.sum(strengths / offsets, axis=1) > 0  # the sum rises between two poles
        low, high = np.where(is_beyond, low, ratio), np.where(is_beyond, ratio, high)
    return below + from_below, offsets
