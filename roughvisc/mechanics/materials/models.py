"""Materials as a series of exponentials (Prony series): springs and dashpots, and relaxation moduli.

Relaxation moduli are converted exactly. With an elastic bulk modulus the Poisson ratio changes in time: the material is
viscoelastic in shear and elastic in volume.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.mechanics.materials.material import Prony, SeriesError, check_poisson, check_terms, remembers_model
from roughvisc.units import Quantity, quantities

Array = NDArray[np.float64]
#: Type of test that measured a modulus or a compliance.
Kind = Literal["shear", "tensile"]

#: A sum of ratios that differs from one by at most this counts as one: a fluid.
_ONE = 1e-9
#: Sum of the moduli over the equilibrium modulus below which moduli of at most one are dimensionless ratios.
_RATIOS = 1e-3
#: Largest ratio of the distances of a zero from the poles next to it, and number of bisections.
_LARGEST_RATIO = 1e250
_BISECTIONS = 70


def tensile_to_shear(kind: Kind, poisson: float) -> float:
    """Return the shear compliance over the measured compliance: ``2 (1 + nu)`` in tension, one in shear."""
    check_poisson(poisson)
    return 2 * (1 + poisson) if one_of("kind", kind, get_args(Kind)) == "tensile" else 1.0


@quantities(shear_modulus="Pa > 0", young_modulus="Pa > 0")
@remembers_model
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

    See Also
    --------
    roughvisc.zener, roughvisc.kelvin_voigt

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
@remembers_model
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

    See Also
    --------
    roughvisc.kelvin_voigt, roughvisc.zener

    Examples
    --------
    >>> import roughvisc as rv
    >>> fluid = rv.maxwell(shear_modulus="1 MPa", viscosity="1 MPa s")
    >>> float(fluid.creep_compliance(3.0))  # (1 + 3) / MPa
    4e-06
    """
    return Prony(1 / shear_modulus, 1 / viscosity, poisson=poisson)


@quantities(shear_modulus="Pa > 0", viscosity="Pa s > 0")
@remembers_model
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

    See Also
    --------
    roughvisc.maxwell, roughvisc.zener

    Examples
    --------
    >>> import roughvisc as rv
    >>> gel = rv.kelvin_voigt(shear_modulus="1 MPa", viscosity="1 MPa s")
    >>> round(float(gel.creep_compliance(1e3)), 12)
    1e-06
    """
    return Prony(0.0, 0.0, (1 / shear_modulus,), (viscosity / shear_modulus,), poisson)


@quantities(shear_modulus="Pa > 0", kelvin_modulus="Pa > 0", kelvin_viscosity="Pa s > 0")
@remembers_model
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

    See Also
    --------
    roughvisc.kelvin_voigt, roughvisc.maxwell, roughvisc.from_relaxation, roughvisc.fractional_zener

    Examples
    --------
    >>> zener("4 MPa", "2 MPa", "0.1 MPa s")
    Prony(glassy=2.5e-07, fluidity=0.0, compliances=(5e-07,), times=(0.05,), poisson=0.5)
    """
    return Prony(1 / shear_modulus, 0.0, (1 / kelvin_modulus,), (kelvin_viscosity / kelvin_modulus,), poisson)


@quantities(
    glassy="1/Pa >= 0",
    fluidity="1/(Pa s) >= 0",
    compliances="1/Pa ...",
    times="s ...",
    error="1 >= 0",
    shortest="s >= 0",
    longest="s > 0",
    early="1 >= 0",
)
@remembers_model
def creep_series(
    glassy: Quantity,
    fluidity: Quantity = 0.0,
    compliances: Sequence[Quantity] = (),
    times: Sequence[Quantity] = (),
    poisson: float = 0.5,
    *,
    error: float,
    shortest: Quantity,
    longest: Quantity,
    early: float = 0.0,
) -> Prony:
    """Series that replaces a creep function of Python in a study file; :meth:`roughvisc.Case.to_toml` writes it.

    Parameters
    ----------
    glassy, fluidity, compliances, times, poisson
        Terms of the series, as in :class:`roughvisc.Prony`.
    error : float
        Largest relative deviation of the series from the function between `shortest` and `longest`; part of the stated
        error of a result. [-]
    shortest, longest : float or str
        Times between which the series was fitted. A longer program is refused. [s]
    early : float
        Relative error of the series below `shortest`. [-]

    Returns
    -------
    Prony

    Raises
    ------
    InputError
        If a number is out of its range.
    """
    known = SeriesError(error, shortest, early)
    return Prony(glassy, fluidity, tuple(compliances), tuple(times), poisson, longest=longest, replaces=known)


@quantities(
    equilibrium="Pa >= 0",
    moduli="Pa ...",
    times="s ...",
    instantaneous="Pa > 0",
    ratios="1 ...",
    bulk_modulus="Pa > 0",
    bulk_ratios="1 ...",
    bulk_times="s ...",
)
@remembers_model
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
    bulk_ratios: Sequence[float] = (),
    bulk_times: Sequence[Quantity] = (),
) -> Prony:
    r"""Generalised Maxwell solid, ``G(t) = G_e + sum G_i exp(-t / theta_i)``.

    Papers and finite-element codes also use ``G(t) = G_0 [1 - sum g_i (1 - exp(-t / theta_i))]``, with the
    instantaneous or the long-term modulus and ratios, and the same series for the bulk modulus.

    Parameters
    ----------
    equilibrium : float or str
        ``G_e``, the long-term modulus; exactly zero makes a fluid. [Pa]
    moduli, times : sequence of float or str
        ``G_i`` [Pa] and relaxation times ``theta_i`` [s].
    poisson : float
        Poisson ratio; a half unless given.
    instantaneous : float or str
        ``G_0``, instead of `equilibrium`. [Pa]
    ratios : sequence of float
        ``g_i = G_i / G_0``, instead of `moduli`; a sum of one makes a fluid, which needs `instantaneous`. [-]
    kind : {"shear", "tensile"}
        Whether the moduli are shear moduli or Young's moduli, ``E = 2 G (1 + nu)``.
    bulk_modulus : float or str
        Bulk modulus ``K``, instead of a Poisson ratio: elastic; or, with `bulk_ratios`, instantaneous if
        `instantaneous` is given, else long-term. [Pa]
    bulk_ratios, bulk_times : sequence of float or str
        Ratios ``k_i`` [-] and times [s] of the relaxing bulk modulus, for shear moduli.

    Returns
    -------
    Prony
        The same material, given by its creep compliance.

    Raises
    ------
    InputError
        If a modulus is negative, a time is not positive, or their numbers differ; if all moduli are zero; if the ratios
        exceed one in sum, reach one with a long-term modulus, or are given as moduli; if a bulk modulus is given with a
        Poisson ratio, or is below a ninth of Young's modulus; if bulk ratios are given with Young's moduli.

    See Also
    --------
    roughvisc.relaxation_table, roughvisc.Prony

    Examples
    --------
    >>> rubber = from_relaxation(instantaneous="4 MPa", ratios=[0.75], times=["1 s"])
    >>> float(rubber.creep_compliance(0.0)), round(1 / float(rubber.creep_compliance(1e9)))
    (2.5e-07, 1000000)
    """
    if (equilibrium is None) == (instantaneous is None):
        key = "equilibrium" if instantaneous is None else "instantaneous"
        raise InputError(key=key, found=instantaneous, expected="either equilibrium or instantaneous")
    if len(moduli) and len(ratios):
        raise InputError(key="ratios", found=ratios, expected="either moduli or ratios")
    plateau: Any = equilibrium
    if instantaneous is None and not len(ratios):
        check_terms("moduli", moduli, "Pa", times)
    else:
        plateau, moduli = _from_ratios("ratios", equilibrium, instantaneous, ratios, times)
    if len(moduli) and 0 < max(moduli) <= 1 and sum(moduli) < _RATIOS * plateau:
        raise InputError(key="moduli", found=moduli, expected="moduli [Pa]; for ratios, instantaneous= and ratios=")
    if bulk_modulus is not None and poisson is not None:
        raise InputError(key="bulk_modulus", found=bulk_modulus, expected="either poisson or bulk_modulus")
    if bulk_modulus is None and (len(bulk_ratios) or len(bulk_times)):
        raise InputError(key="bulk_ratios", found=bulk_ratios, expected="a bulk_modulus")
    constant = 0.5 if poisson is None else poisson
    factor = tensile_to_shear(kind, constant)
    if bulk_modulus is None:
        return relaxation_series(plateau / factor, [modulus / factor for modulus in moduli], times, constant)
    if not len(bulk_ratios) and not len(bulk_times):
        return _with_bulk(plateau, moduli, times, bulk_modulus, kind)
    if kind == "tensile":
        raise InputError(key="bulk_ratios", found=bulk_ratios, expected='shear moduli, kind = "shear"')
    final, first = (None, bulk_modulus) if equilibrium is None else (bulk_modulus, None)
    in_the_end, bulk_moduli = _from_ratios("bulk_ratios", final, first, bulk_ratios, bulk_times)
    return _with_bulk(plateau, moduli, times, in_the_end, kind, bulk_moduli, bulk_times)


def _from_ratios(
    name: str, equilibrium: Any, instantaneous: Any, ratios: Sequence[float], times: Sequence[Any]
) -> tuple[float, list[float]]:
    """Return the long-term modulus and the moduli of a series given by ratios to its instantaneous modulus. [Pa]"""
    check_terms(name, ratios, "1", times, name.replace("ratios", "times"))
    rest = 1 - math.fsum(ratios)
    if rest < -_ONE:
        raise InputError(key=name, found=ratios, expected=f"ratios with a sum of at most 1, not {1 - rest:g}")
    rest = rest if rest > _ONE else 0.0
    if instantaneous is None:
        if not rest or not equilibrium:
            raise InputError(
                key=name, found=ratios, expected="a sum below 1 and a positive equilibrium, or instantaneous"
            )
        return equilibrium, [equilibrium / rest * ratio for ratio in ratios]
    return instantaneous * rest, [instantaneous * ratio for ratio in ratios]


def _with_bulk(
    equilibrium: float,
    moduli: Sequence[float],
    times: Sequence[float],
    bulk_modulus: float,
    kind: Kind,
    bulk_moduli: Sequence[float] = (),
    bulk_times: Sequence[float] = (),
) -> Prony:
    r"""Return the series with the contact compliance of a material that relaxes in shear and in volume.

    Notes
    -----
    In the transformed domain the contact compliance is :math:`\tfrac14 [1/G + 3/(3K + G)]`, or in terms of Young's
    modulus :math:`3/(4E) + 1/(6K) - E/(36K^2)`. The series has four times this at a Poisson ratio of a half. The
    second term is the creep compliance of the relaxation modulus ``3K + G(t)``, which vanishes for an incompressible
    material; the last is a sum of exponentials with the relaxation times. The bulk modulus is elastic, or a series.
    """
    shear_series = relaxation_series(equilibrium, moduli, times)
    if kind == "tensile":
        bulk_share = (equilibrium + sum(moduli)) / (9 * bulk_modulus)
        if bulk_share >= 1:
            expected = f"more than a ninth of the instantaneous Young's modulus, {1 / shear_series.glassy:g} Pa"
            raise InputError(key="bulk_modulus", found=bulk_modulus, expected=expected)
        shear_series = shear_series.scaled(1.0, 1 / 3)
        glassy = shear_series.glassy * (1 - bulk_share) * (1 + 3 * bulk_share)
        later = [modulus / (9 * bulk_modulus**2) for modulus in moduli]
    else:
        terms_of_both = [*moduli, *(3 * modulus for modulus in bulk_moduli)]
        volume = relaxation_series(3 * bulk_modulus + equilibrium, terms_of_both, [*times, *bulk_times])
        glassy = shear_series.glassy + 3 * volume.glassy
        later = [3 * modulus for modulus in volume.compliances]
        times = volume.times
    terms = (*shear_series.compliances, *later), (*shear_series.times, *times)
    elastic_or_not = "a relaxing" if len(bulk_moduli) else "an elastic"
    final = " in the end" if len(bulk_moduli) else ""
    note = f"effective compliance for {elastic_or_not} bulk modulus of {bulk_modulus:g} Pa{final}"
    stands_for = f"a body with {elastic_or_not} bulk modulus, whose Poisson ratio changes in time"
    return Prony(glassy, shear_series.fluidity, *terms, note=note, stands_for=stands_for)


def relaxation_series(
    equilibrium: float, moduli: ArrayLike, times: ArrayLike, poisson: float = 0.5, **about: Any
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
        strengths = np.append(equilibrium, strengths)
        poles = np.append(0.0, poles)
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
    gaps = np.diff(poles)
    below = poles[:-1]
    place = np.arange(poles.size - 1)
    low = np.full(gaps.size, 1 / _LARGEST_RATIO)
    high = np.full(gaps.size, _LARGEST_RATIO)
    for _ in range(_BISECTIONS):
        ratio = np.sqrt(low) * np.sqrt(high)
        from_below = gaps / (1 + 1 / ratio)
        offsets = (poles - below[:, None]) - from_below[:, None]
        offsets[place, place + 1] = gaps / (1 + ratio)
        is_beyond = np.sum(strengths / offsets, axis=1) > 0  # the sum rises between two poles
        low = np.where(is_beyond, low, ratio)
        high = np.where(is_beyond, ratio, high)
    return below + from_below, offsets
