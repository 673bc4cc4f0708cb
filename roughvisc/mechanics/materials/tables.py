"""Materials from measurements: creep, relaxation, or dynamic moduli, in shear or in tension.

Each table is fitted by a positive series of exponentials (non-negative least squares), which is a passive material.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np
import scipy  # which imports a submodule when it is first used: scipy.optimize takes 0.2 s
from numpy.typing import ArrayLike, NDArray

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.mechanics.materials.material import Prony, remembers_model
from roughvisc.mechanics.materials.models import Kind, relaxation_series, tensile_to_shear
from roughvisc.mechanics.materials.series import lattice, nonnegative
from roughvisc.units import Quantity, format_quantity, listed, number, quantities

Array = NDArray[np.float64]

#: Numbers of terms per decade to try in turn.
_OFFERED = (1, 1.5, 2, 3, 4, 6, 12, 24)
#: A fit with fewer terms may have an rms misfit larger by this factor than the smallest one.
_FEWER = 1.1
#: Number of values per decade below which a smooth spectrum is fitted, its terms per decade, and the weight of the
#: differences between neighbouring terms next to the misfit of the rows.
_FEW, _SMOOTH, _STEPS = 2.5, 3, 0.01
#: Largest time of a term, over the last time: a slower term is a plateau.
_SLOWER = 3.0
#: First time over the shortest time of a term, and rms misfit below which more terms are not tried. For moduli: the
#: rows hardly determine a faster term, and rheometers are not more accurate. For creep: a fast term rises from the
#: given instantaneous compliance, and the terms are chosen later, for a program.
_MODULI, _CREEP = (3.0, 2e-4), (10.0, 1e-7)
#: Largest ratio of moduli measured at one frequency and one temperature, and largest relative difference of frequencies
#: that count as equal.
_ONE_TEMPERATURE, _SAME_FREQUENCY = 2.0, 1e-6
#: Largest ratio of the times of neighbouring rows without a warning.
_DECADE = 10.0 * (1 + 1e-9)


@quantities(times="s ...", compliances="1/Pa ...", noise="1 >= 0")
@remembers_model
def creep_table(
    times: Sequence[Quantity],
    compliances: Sequence[Quantity],
    kind: Kind = "shear",
    noise: float = 0.0,
    poisson: float = 0.5,
) -> Prony:
    """Material from a creep test: ``J(t)`` in shear, or ``D(t)`` in tension with ``J = 2 (1 + nu) D``.

    Parameters
    ----------
    times : sequence of float or str
        Times in increasing order; the first may be zero. [s]
    compliances : sequence of float or str
        ``J`` or ``D`` at these times. [1/Pa]
    kind : {"shear", "tensile"}
        Kind of the compliance.
    noise : float
        Largest relative decrease below an earlier row that counts as noise, such as 0.01. Smaller deviations
        of the fit from the rows cause no warning.
    poisson : float
        Poisson ratio, constant in time.

    Returns
    -------
    Prony
        A positive series of exponentials fitted to the rows, up to the last row and not beyond. Its ``note`` states
        the number of terms and the misfit.

    Raises
    ------
    InputError
        If a row is negative, not finite, not in increasing order of time, zero after time zero, or lower than an
        earlier one by more than the noise; the message names the row, counted from 0. Programs longer than the table
        are refused later.

    Notes
    -----
    A compliance at time zero is the instantaneous compliance. Before a first row at a later time, the first decade of
    rows is extrapolated to time zero as a power of time or by a decade of logarithmic creep, whichever falls less, and
    to a tenth of the first row at least.
    """
    factor = tensile_to_shear(kind, poisson)
    t, values = _checked_rows(("time", "compliance"), times, np.asarray(compliances, dtype=float) * factor)
    for row in np.flatnonzero((values == 0) & (t > 0))[:1]:
        raise InputError(f"table row {row}: compliance is 0 at {t[row]:g} s: expected a positive compliance")
    highest = np.maximum.accumulate(values)
    for row in np.flatnonzero(values < (1 - noise) * highest)[:1]:
        below = f"compliance is {1 - values[row] / highest[row]:.2%} below an earlier row"
        raise InputError(f"table row {row}: {below}, noise is {noise:g}: expected ascending compliances or more noise")
    # equal weights of relative deviations; a compliance of zero comes first and does not move
    weights = (highest[-1] / np.where(values > 0, values, highest[-1])) ** 2
    ascending = np.maximum.accumulate(scipy.optimize.isotonic_regression(values, weights=weights).x)
    rows, measured = t[t > 0], values[t > 0]
    glassy = float(ascending[0]) if t[0] == 0 else _instantaneous(rows, ascending)

    def columns(tau: Array) -> Array:
        return np.column_stack([rows / rows[-1], -np.expm1(-rows[:, None] / tau)])

    weights, tau, misfit, about = _fitted(columns, rows, measured, measured - glassy, measured, _CREEP)
    note = about["note"] + f", times {t[0]:g} to {t[-1]:g} s"
    if t[0] > 0:
        note += f"; nothing was measured before {t[0]:g} s: instantaneous compliance of {glassy:.3g} 1/Pa extrapolated"
    about |= {"note": note, "longest": float(t[-1]), "misfit": misfit if misfit > noise else 0.0}
    return Prony(glassy, float(weights[0] / rows[-1]), tuple(weights[1:]), tuple(tau), poisson, **about)


@quantities(times="s ...", moduli="Pa ...")
@remembers_model
def relaxation_table(
    times: Sequence[Quantity], moduli: Sequence[Quantity], kind: Kind = "shear", poisson: float = 0.5
) -> Prony:
    """Material from a relaxation test, by a positive series of exponentials.

    Parameters
    ----------
    times : sequence of float or str
        Times in increasing order; the first may be zero. [s]
    moduli : sequence of float or str
        ``G`` or ``E`` at these times. [Pa]
    kind : {"shear", "tensile"}
        Kind of the modulus; ``G = E / (2 (1 + nu))``.
    poisson : float
        Poisson ratio, constant in time.

    Returns
    -------
    Prony
        Its ``note`` states the number of terms, the misfit at the rows, and the measured times.

    Raises
    ------
    InputError
        If a row is negative, not finite, or not in increasing order of time; the row is named, counted from 0.

    Notes
    -----
    ``G(t) = G_e + sum G_k exp(-t / theta_k)`` by non-negative least squares of the relative misfit on a lattice of
    ``theta``; then :func:`~roughvisc.mechanics.materials.models.relaxation_series`, which is exact. Outside the
    measured times its slowest and its fastest terms determine the series.
    """
    t, values = _checked_rows(("time", "modulus"), times, moduli)
    for row in np.flatnonzero(values == 0)[:1]:
        raise InputError(f"table row {row}: modulus is 0: expected a positive modulus")
    shear = values / tensile_to_shear(kind, poisson)
    later = t > 0

    def columns(theta: Array) -> Array:
        return np.column_stack([np.ones(t.size), np.exp(-t[:, None] / theta)])

    weights, theta, _, about = _fitted(columns, t[later], shear[later], shear, shear, _MODULI)
    about["note"] += f", times {t[0]:g} to {t[-1]:g} s"
    return relaxation_series(float(weights[0]), weights[1:], theta, poisson, **about)


@quantities(frequencies="1 ...", storage="Pa ...", loss="Pa ...")
@remembers_model
def dynamic_table(
    frequencies: Sequence[float],
    storage: Sequence[Quantity],
    loss: Sequence[Quantity],
    *,
    frequency_unit: Literal["rad/s", "Hz"],
    shift_factors: float | Sequence[float] = 1.0,
    kind: Kind = "shear",
    poisson: float = 0.5,
) -> Prony:
    """Material from dynamic moduli, a master curve if shift factors are given, by a positive series.

    Parameters
    ----------
    frequencies : sequence of float
        Frequencies in any order; several temperatures may overlap. [`frequency_unit`]
    storage, loss : sequence of float or str
        ``G'`` and ``G''``, or ``E'`` and ``E''``. [Pa]
    frequency_unit : {"rad/s", "Hz"}
        Angular frequency, or cycles per second. It has no default, because the wrong unit changes all times by the
        factor 2 pi.
    shift_factors : float or sequence of float
        ``a_T`` of each row, or one for all: the factor for its frequency.
    kind : {"shear", "tensile"}
        Which moduli; ``G = E / (2 (1 + nu))``.
    poisson : float
        Poisson ratio, constant in time.

    Returns
    -------
    Prony
        Its ``note`` states the number of terms, the misfit at the rows, and the measured frequencies.

    Raises
    ------
    InputError
        If a number is negative or not finite, or a frequency or a shift factor is not positive; the row is named.

    Notes
    -----
    ``G' = G_e + sum G_k w^2 theta_k^2 / (1 + w^2 theta_k^2)`` and ``G'' = sum G_k w theta_k / (1 + w^2 theta_k^2)``
    are fitted together by non-negative least squares, each relative to itself, or to a thousandth of ``|G*|`` where
    it is smaller. A large misfit means that the two moduli do not belong to one passive material.
    """
    one_of("frequency_unit", frequency_unit, ("rad/s", "Hz"))
    if isinstance(shift_factors, Sequence | np.ndarray):
        factors = listed(shift_factors, "1", "shift_factors")
    else:
        factors = np.full(len(frequencies), number(shift_factors, "1", "shift_factors"))
    names = ("frequency", "storage modulus", "loss modulus", "shift factor")
    omega, elastic, viscous, factors = _checked_rows(names, frequencies, storage, loss, factors, ascending=False)
    omega = omega * factors * (2 * math.pi if frequency_unit == "Hz" else 1.0)
    for row in np.flatnonzero((omega == 0) | (elastic + viscous == 0))[:1]:
        raise InputError(f"table row {row}: a frequency, a shift factor or both moduli are 0: expected positive")
    elastic, viscous = (one / tensile_to_shear(kind, poisson) for one in (elastic, viscous))
    size, at = np.hypot(elastic, viscous), 1 / omega
    order = np.argsort(at, kind="stable")
    again = np.diff(np.log(at[order])) < _SAME_FREQUENCY
    apart = np.abs(np.diff(np.log(size[order]))) > np.log(_ONE_TEMPERATURE)
    for row in order[1:][again & apart][:1]:
        same = f"other moduli than a row with the same frequency, {omega[row]:g} rad/s"
        raise InputError(f"table row {row}: {same}: several temperatures? expected the rows of one, or shift_factors")
    least = 1e-3 * size
    target, scale = np.append(elastic, viscous), np.append(np.maximum(elastic, least), np.maximum(viscous, least))

    def columns(theta: Array) -> Array:
        x = omega[:, None] * theta
        in_phase = np.column_stack([np.ones(omega.size), x**2 / (1 + x**2)])
        return np.vstack([in_phase, np.column_stack([np.zeros(omega.size), x / (1 + x**2)])])

    weights, theta, _, about = _fitted(columns, at[order], size[order], target, scale, _MODULI)
    about["note"] += f", frequencies {omega.min():g} to {omega.max():g} rad/s"
    return relaxation_series(float(weights[0]), weights[1:], theta, poisson, **about)


def _checked_rows(names: tuple[str, ...], *columns: ArrayLike, ascending: bool = True) -> tuple[Array, ...]:
    """Return the columns of a table of measurements as arrays.

    Parameters
    ----------
    names : tuple of str
        Names of the columns, for the messages; the first is the time or the frequency.
    columns : array_like
        Columns of equal length.
    ascending : bool
        Whether the first column must ascend.

    Returns
    -------
    tuple of ndarray

    Raises
    ------
    InputError
        If the lengths differ, there are fewer than two rows, a number is negative or not finite, or the first
        column does not ascend; the message names the row, counted from 0.
    """
    arrays = tuple(np.asarray(column, dtype=float) for column in columns)
    sizes = [array.size for array in arrays]
    if any(array.ndim != 1 for array in arrays) or len(set(sizes)) > 1 or sizes[0] < 2:
        found = ", ".join(f"{size} of {name}" for size, name in zip(sizes, names, strict=True))
        raise InputError(f"table has {found}: expected as many, at least two")
    for name, array in zip(names, arrays, strict=True):
        for row in np.flatnonzero(~(np.isfinite(array) & (array >= 0)))[:1]:
            raise InputError(f"table row {row}: {name} is {array[row]:g}: expected a finite number, not negative")
    for row in np.flatnonzero(np.diff(arrays[0]) <= 0)[:1] + 1 if ascending else ():
        again = f"{names[0]} {arrays[0][row]:g} after {arrays[0][row - 1]:g}"
        expected = f"expected ascending {names[0]}; several temperatures? expected one, or a master curve"
        raise InputError(f"table row {row}: {again}: {expected}")
    return arrays


def _fitted(
    columns: Callable[[Array], Array], at: Array, course: Array, target: Array, scale: Array, most: tuple[float, float]
) -> tuple[Array, Array, float, dict[str, Any]]:
    """Return the non-negative weights of a series, its times [s], its largest relative misfit, a note and a warning.

    Parameters
    ----------
    columns : callable
        Function of the times of the terms; the first of its columns has no time.
    at, course : ndarray
        Ascending times of the measurements [s] and their values, by which the size of a term is judged.
    target, scale : ndarray
        Target of the sum of the columns, and scale of the misfit of each row.
    most : tuple of float
        See :data:`_MODULI`.

    Notes
    -----
    The fit with the fewest terms among those with about the smallest misfit. If the rows are too few to determine the
    spectrum, neighbouring terms are fitted to differ little.
    """
    fits = []
    sparse = target.size - 1 < _FEW * np.log10(at[-1] / at[0])
    for per_decade in (_SMOOTH,) if sparse else _OFFERED:
        times = lattice(float(at[0]) / most[0], float(at[-1]) * _SLOWER, per_decade)
        terms = columns(times)
        rows, wanted = terms / scale[:, None], target / scale
        if sparse:
            sizes = np.interp(np.log(times), np.log(at), course)
            smooth = np.pad(np.diff(np.diag(_STEPS / sizes), axis=0), ((0, 0), (1, 0)))
            rows, wanted = np.vstack([rows, smooth]), np.append(wanted, np.zeros(len(smooth)))
        weights = nonnegative(rows, wanted, np.ones(len(rows)))
        misfit, used = np.abs((terms @ weights - target) / scale), np.append(True, weights[1:] > 0)
        rms = float(np.sqrt(np.mean(misfit**2)))
        fits.append((rms, float(misfit.max()), weights[used], times[used[1:]]))
    enough = max(_FEWER * min(fit[0] for fit in fits), most[1])
    rms, largest, weights, times = min((fit for fit in fits if fit[0] <= enough), key=lambda fit: fit[3].size)
    count, misfits = np.count_nonzero(weights), f"largest misfit {largest:.2g}, rms {rms:.2g} (relative)"
    note = f"{count} terms fitted to {target.size} values, {misfits}"
    return weights, times, largest, {"note": note, "warning": _gap(at)}


def _gap(times: Array) -> str:
    """Return a warning of neighbouring rows more than a decade apart, else ''.

    Three rows over six decades of a power law gave approaches 0.74 to 1.16 times as large as the true ones.
    """
    ratios = times[1:] / times[:-1]
    if ratios.max(initial=1.0) <= _DECADE:
        return ""
    before, after = (format_quantity(float(one), "s") for one in times[ratios.argmax() :][:2])
    what = f"The table of the material has no row between {before} and {after}, more than a decade"
    return f"{what}: the material between is a guess that stated errors do not include. Use one row per decade."


def _instantaneous(times: Array, compliances: Array) -> float:
    """Return the compliance at time zero of a table that begins later, [1/Pa], from the course of its first decade.

    The course is a power law ``J(0) + a t^alpha`` through both ends and the middle of the decade, or logarithmic creep
    that began a decade earlier, whichever falls less. An exponent above one counts as one.
    """
    first, span = float(compliances[0]), min(10.0, times[-1] / times[0])
    at = np.log(times[0]) + np.log(span) * np.array([0.5, 1.0])
    middle, end = (float(value) for value in np.interp(at, np.log(times), compliances))
    ratio = min((end - middle) / (middle - first), np.sqrt(span)) if middle > first else np.sqrt(span)
    power = (middle - first) / (ratio - 1) if ratio > 1 else np.inf
    logarithmic = (end - first) / np.log(span) * (1 + np.log(10))
    return first - min(power, logarithmic, 0.9 * first)
