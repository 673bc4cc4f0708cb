"""Certified exponential series of any material, and the complex compliance under oscillating pressure.

The solver uses the Prony series that :func:`series` fits to any material for the times of the program, with a measured
error. The terms of a series are positive, so that it is a passive material. It has the instantaneous compliance of the
material, so that jumps are exact. Both compliances increase. Before the shortest time they therefore differ by less
than the creep up to this time.

Under oscillating pressure a material has a complex compliance. Some materials have a closed form. Any other one
is replaced by a certified series.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import cast

import numpy as np
import scipy  # which imports a submodule when it is first used: scipy.optimize takes 0.2 s
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.material import Creep, Material, Prony, pair, pair_creep

Array = NDArray[np.float64]

#: Largest relative decrease of a creep function that counts as rounding.
_ROUNDING = 1e-9
#: Number of times per decade at which a series is fitted, and at which its error is measured.
_FITTED = 30
_MEASURED = 100
#: Numbers of retardation times per decade to try in turn, and largest number of retardation times.
_OFFERED = (0.5, 0.7, 1, 1.5, 2, 3, 4, 6, 8, 12, 24, 48)
_MOST_OFFERED = 300
#: Shortest time over the shortest retardation time, two values to try: the larger one gives a better fit before the
#: shortest time, with more terms. Longest retardation time over the longest time.
_FASTER = (3.0, 10.0)
_SLOWER = 3.0
#: Retardation times of a solid that creeps on after the longest time, over its slowest other retardation time.
_SLOW = 10.0 ** np.arange(1, 13)
#: Fluidity of a material that creeps without end, if its series has none: without influence on oscillating waves.
_FLOWS = 1e-300
#: Number of times that the rows are reweighted to level the error.
_LEVELLINGS = 6
#: Number of successive trials without a smaller error after which the fit ends.
_IDLE = 3
#: Terms whose part of the target is below this in all rows are left out.
_UNSEEN = 1e-10
#: Factor by which the times of a series must extend beyond the times of the frequencies, shorter and longer: a term
#: whose time is a hundred times off contributes a hundredth of its loss.
_BEYOND = 100.0
#: Number of rows above which they are first reduced to a triangular factor.
_MANY = 1000


def check_creep(material: Material, times: Array) -> Array:
    """Return the creep compliance at some times [1/Pa], after a check that it is not negative and does not decrease.

    Parameters
    ----------
    material : Prony or Creep
        Material to check.
    times : ndarray
        Times, positive and ascending. [s]

    Raises
    ------
    InputError
        If the number of values is wrong, or a value is negative, not finite, lower than an earlier one, or zero after
        time zero. The message names the time.
    """
    times = np.append(0.0, times)
    values = material.creep_compliance(times)
    if values.shape != times.shape:
        raise InputError(f"creep of {material!r} gives {values.shape} of {times.shape} times: expected a number each")
    falls = np.append(False, np.diff(values) < -_ROUNDING * values[1:])
    is_possible = np.isfinite(values) & (values >= 0) & ((values > 0) | (times == 0)) & ~falls
    for row in np.flatnonzero(~is_possible)[:1]:
        measured = f"creep of {material!r} is {values[row]:g} 1/Pa at {times[row]:g} s"
        raise InputError(f"{measured}: expected a positive compliance (zero only at time zero), no less than before")
    return values[1:]


def series(
    material: Material, shortest: float, longest: float, tolerance: float, *, until_end: bool = False
) -> tuple[Prony, float]:
    r"""Fit a Prony series to a material for a range of times.

    Parameters
    ----------
    material : Material
        Any material. A Prony series is returned unchanged, unless it was fitted to a creep table with more terms than
        the tolerance needs.
    shortest, longest : float
        Range of times. [s]
    tolerance : float
        Largest relative error allowed.
    until_end : bool
        Whether the compliance after endless creep matters, as it does for waves that stand still. The series of a
        material with bounded creep then has that compliance, and no fluidity.

    Returns
    -------
    series : Prony
        The series with the fewest terms within the tolerance; otherwise the most accurate series. It has the
        instantaneous compliance of the material.
    error : float
        Largest ``|J~ - J| / J`` at a hundred instants per decade, more than the series was fitted to. It exceeds the
        tolerance if the material is not passive.

    Raises
    ------
    InputError
        If the material is not known over the range, or its creep compliance decreases.

    Notes
    -----
    Non-negative least squares [1]_ on a lattice of retardation times, :math:`J_0 + \varphi t + \sum_i J_i (1 -
    e^{-t/\tau_i})`. The rows are reweighted by the error to reduce its largest value (Lawson's iteration [1]_).

    References
    ----------
    .. [1] C. L. Lawson and R. J. Hanson, *Solving Least Squares Problems*, Prentice-Hall, 1974, chapter 23.
    """
    if isinstance(material, Prony) and material.longest == math.inf:
        return material, 0.0
    instants = _instants(shortest, longest, _MEASURED)
    compliance = check_creep(material, instants)
    if until_end and material.is_solid:
        instants = np.append(instants, math.inf)
        compliance = np.append(compliance, material.final_compliance)
    if isinstance(material, Creep) and material.function is pair_creep:
        joined = cast(Prony, pair(*(series(one, shortest, longest, tolerance)[0] for one in material.parameters)))
        return joined, _error(joined, instants, compliance)
    fits = _fits(material, instants, compliance, tolerance)
    error, fitted = min(fits, key=lambda one: (max(one[0], tolerance), len(one[1].times)))
    if isinstance(material, Prony) and (error > tolerance or len(fitted.times) >= len(material.times)):
        return replace(material, longest=math.inf), 0.0
    return fitted, error


def _fits(material: Material, instants: Array, compliance: Array, tolerance: float) -> Iterator[tuple[float, Prony]]:
    """Yield errors and series, from ever denser lattices of retardation times.

    If the last instant is infinite, the series has the last compliance after endless creep. Terms slower than all
    other instants then replace the fluidity.
    """
    is_bounded = math.isinf(instants[-1])
    shortest = instants[0]
    longest = instants[-1 - is_bounded]
    glassy = float(material.creep_compliance(0.0))
    t = _instants(shortest, longest, _FITTED)
    exact = material.creep_compliance(t)
    if is_bounded:
        t = np.append(t, math.inf)
        exact = np.append(exact, compliance[-1])
    slow = longest * _SLOWER * _SLOW if is_bounded else np.zeros(0)
    for faster in _FASTER:
        idle = 0
        reached = math.inf
        for per_decade in _OFFERED:
            times = lattice(shortest / faster, longest * _SLOWER, per_decade)
            if idle == _IDLE or reached <= tolerance or times.size > _MOST_OFFERED:
                break
            times = np.append(times, slow)
            flowing = np.zeros_like(t) if is_bounded else t / longest
            columns = np.column_stack([flowing, -np.expm1(-t[:, None] / times)])
            before = reached
            importance = np.ones(t.size)
            for _ in range(_LEVELLINGS):
                weights = nonnegative(columns, exact - glassy, exact / importance)
                used = weights[1:] > 0
                terms = tuple(weights[1:][used]), tuple(times[used])
                fit = Prony(glassy, float(weights[0] / longest), *terms, material.poisson)
                error = _error(fit, instants, compliance)
                yield error, fit
                reached = min(reached, error)
                misfit = np.abs((glassy + columns @ weights) / exact - 1)
                importance = importance * np.sqrt(0.02 + misfit / max(float(misfit.max()), 1e-300))
            idle = 0 if reached < 0.9 * before else idle + 1


def _instants(shortest: float, longest: float, per_decade: int) -> Array:
    """Return at least `per_decade` instants, evenly spaced in the logarithm. [s]"""
    return np.geomspace(shortest, longest, int(per_decade * max(np.log10(longest / shortest), 1.0)) + 1)


def _error(found: Prony, instants: Array, compliance: Array) -> float:
    """Return the largest relative error of the creep compliance at some instants."""
    return float(np.abs(found.creep_compliance(instants) / compliance - 1).max())


def lattice(shortest: float, longest: float, per_decade: float) -> Array:
    """Return times from the shortest to the longest, evenly spaced in the logarithm. [s]"""
    count = max(2, int(np.ceil(per_decade * np.log10(longest / shortest))) + 1) if longest > shortest else 1
    return np.geomspace(shortest, longest, count)


def nonnegative(columns: Array, target: Array, scale: Array) -> Array:
    """Return non-negative weights of columns, mostly zeros, whose weighted sum fits a target in least squares.

    Parameters
    ----------
    columns : ndarray, shape (rows, terms)
        Columns to combine.
    target : ndarray, shape (rows,)
        Target of the sum.
    scale : ndarray, shape (rows,)
        Positive scale of the misfit of each row.
    """
    if not columns.size:  # which SciPy's function cannot do
        return np.zeros(columns.shape[1])
    scaled = columns / scale[:, None]
    norms = np.sqrt(np.sum(scaled**2, axis=0))
    norms[norms == 0] = 1.0
    matrix = scaled / norms
    wanted = target / scale
    if wanted.size > _MANY:  # the triangular factor has the same squared misfit up to a constant
        factor: Array = np.asarray(np.linalg.qr(np.column_stack([matrix, wanted]), mode="r"))
        matrix = factor[:, :-1]
        wanted = factor[:, -1]
    weights, _ = scipy.optimize.nnls(matrix, wanted, maxiter=50 * columns.shape[1])
    seen = np.abs(scaled / norms).max(axis=0) * weights
    return np.where(seen > _UNSEEN, weights / norms, 0.0)


def complex_compliance(material: Material, frequency: ArrayLike) -> NDArray[np.complex128]:
    r"""Return the complex contact compliance: displacement over pressure if both oscillate as ``exp(i w t)``.

    Parameters
    ----------
    material : Material
        Series and materials with a transform have closed forms. Any other material is replaced by a series, see
        :func:`over_frequencies`.
    frequency : array_like
        Angular frequencies ``w``, of either sign. [1/s]

    Returns
    -------
    ndarray of complex
        ``C*(w)``, conjugate for frequencies of opposite sign, with a negative or zero imaginary part at positive
        frequencies. At zero frequency the compliance after endless creep: real, or infinite if the material flows.
        [1/Pa]

    Raises
    ------
    InputError
        If a table ends before the times that the frequencies need.

    Notes
    -----
    With :math:`C(t) = \tfrac{1 - \nu}{2} J(t)`,

    .. math:: C^*(\omega) = \frac{1-\nu}{2} \left[ J_0 + \sum_i \frac{J_i}{1 + i \omega \tau_i}
              + \frac{\varphi}{i \omega} \right], \qquad
              J^*(\omega) = J_0 + c\, \Gamma(1 + \alpha)\, (i \omega T)^{-\alpha}.

    References
    ----------
    .. [1] J. D. Ferry, *Viscoelastic Properties of Polymers*, 3rd ed., Wiley, 1980, chapter 3.

    Examples
    --------
    >>> from roughvisc.mechanics.materials.models import zener
    >>> found = complex_compliance(zener(1.0, 1.0, 1.0), [0.0, 1.0])  # C = 1/4 (1 + 1 / (1 + i w))
    >>> found.real.tolist(), found.imag.tolist()
    ([0.5, 0.375], [0.0, -0.125])
    """
    w = np.asarray(frequency, dtype=float)
    material = over_frequencies(material, w)
    if isinstance(material, Creep) and material.function is pair_creep:
        return np.asarray(sum(complex_compliance(law, w) for law in material.parameters))
    with np.errstate(divide="ignore", invalid="ignore"):  # at zero frequency
        compliance = 0.5 * (1 - material.poisson) * material.laplace(1j * w)
    return np.where(np.isfinite(compliance), compliance, complex(math.inf, 0.0))


def over_frequencies(material: Material, frequency: ArrayLike, tolerance: float = 1e-4) -> Material:
    """Return a material with a closed form of the complex compliance that replaces a material at some frequencies.

    Parameters
    ----------
    material : Material
        Series and materials with a transform are returned unchanged. Measured creep is replaced by the series fitted
        to it, any other material by a certified series.
    frequency : array_like
        Angular frequencies, of either sign. [1/s]
    tolerance : float
        Relative error of a series that replaces the material.

    Raises
    ------
    InputError
        See :func:`complex_compliance`.
    """
    if isinstance(material, Creep) and material.function is pair_creep:
        return pair(*(over_frequencies(law, frequency, tolerance) for law in material.parameters))
    if material.longest == math.inf if isinstance(material, Prony) else material.has_laplace:
        return material
    size = np.abs(np.asarray(frequency, dtype=float))
    shortest = 1 / (_BEYOND * float(size.max()))
    longest = _BEYOND / float(size[size > 0].min())
    if isinstance(material, Creep):
        fitted, _ = series(material, shortest, longest, tolerance, until_end=True)
        return fitted if material.is_solid else replace(fitted, fluidity=fitted.fluidity or _FLOWS)
    material.creep_compliance(longest)  # refuses a table that ends earlier
    return replace(material, longest=math.inf)
