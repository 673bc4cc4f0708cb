"""Certified exponential series: any creep compliance as a Prony series whose error is measured.

The terms are positive, so that the series is a material: it dissipates, and the compliance of a step is positive.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.materials import Material, Pair, PowerLaw, Prony, Tabulated, pair
from roughvisc.mechanics.spectrum import lattice, nonnegative

Array = NDArray[np.float64]

#: instants in a decade at which the error is measured
_DENSE = 100
#: most retardation times offered to a fit
_MOST_OFFERED = 300
#: how often the rows are weighted anew to level the error
_LEVELLINGS = 6


@dataclass(frozen=True)
class Series:
    """A series, and how far it is from the material that it stands for.

    Attributes
    ----------
    prony : Prony
        The series. Its glassy part may come from a closed tail: whether a material can jump is the material's to say.
    error : float
        Largest ``|J~ - J| / J`` over the times asked for, measured on a dense logarithmic grid.
    """

    prony: Prony
    error: float


def series_of(material: Material, shortest: float, longest: float, tolerance: float) -> Series:
    """Series for any material; a series is its own, with no error.

    Parameters
    ----------
    material : Material
    shortest, longest : float
        Times over which the error is measured. [s]
    tolerance : float
        Relative error asked for. What was reached is in the answer, and may be more.

    Returns
    -------
    Series

    Raises
    ------
    InputError
        If the times are not positive and in order, the tolerance is not positive, a table ends before the longest
        time, or the material is of an unknown kind.
    """
    _check_range(shortest, longest, tolerance)
    if isinstance(material, Prony):
        return Series(material, 0.0)
    if isinstance(material, PowerLaw):
        return power_law_series(material, shortest, longest, tolerance)
    if isinstance(material, Tabulated):
        return table_series(material, shortest, longest, tolerance)
    if isinstance(material, Pair):
        parts = [series_of(body, shortest, longest, tolerance) for body in (material.a, material.b)]
        joined = pair(parts[0].prony, parts[1].prony)
        assert isinstance(joined, Prony)
        return Series(joined, measured_error(material, joined, _instants(material, shortest, longest)))
    raise InputError(f"material is a {type(material).__name__}: expected one of roughvisc's materials")


def power_law_series(material: PowerLaw, shortest: float, longest: float, tolerance: float) -> Series:
    r"""Series for a power law, by the trapezoidal rule in the logarithm of the rate.

    Parameters and errors as in :func:`series_of`.

    Notes
    -----
    .. math:: t^\alpha = \frac{\alpha}{\Gamma(1-\alpha)} \int e^{-\alpha y} \left(1 - e^{-e^y t}\right) dy

    The rule converges exponentially in the inverse of its spacing. Rates too fast to be seen are summed up exactly
    into the glassy part, rates too slow into the fluidity. The widest spacing that meets the tolerance is sought, and
    terms at both ends are then given to the tails while the error allows it.
    """
    _check_range(shortest, longest, tolerance)
    times = _instants(material, shortest, longest)
    best = Series(Prony(float(material.creep_compliance(longest)), poisson=material.poisson), math.inf)
    met = 0.0
    for spacing in 4.0 * 0.95 ** np.arange(68):  # down to 0.13: beyond all digits
        if met and spacing < 0.7 * met:
            break
        rule = _Rule.over(material, spacing, shortest, longest)
        found = _measured(material, rule.series(material), times)
        if found.error <= tolerance:
            met = met or float(spacing)
            found = _measured(material, rule.trimmed(material, times, tolerance).series(material), times)
        if _better(found, best, tolerance):
            best = found
    return best


def table_series(material: Tabulated, shortest: float, longest: float, tolerance: float) -> Series:
    """Series for a table, by non-negative least squares on a lattice of retardation times.

    Parameters and errors as in :func:`series_of`. The number of times is raised until the tolerance is reached or
    more times are of no use; the best series is returned, with its measured error. A table with a compliance of
    zero at a time within the range has no series: the error is infinite.
    """
    _check_range(shortest, longest, tolerance)
    times = _instants(material, shortest, longest)
    exact = np.asarray(material.creep_compliance(times))
    seen = exact > 0
    best = Series(Prony(float(exact[-1]), poisson=material.poisson), math.inf)
    idle = 0
    for per_decade in (1, 1.5, 2, 3, 4, 6, 8, 12, 24, 48):
        retardation = lattice(shortest / 3, longest * 3, per_decade)
        if retardation.size > _MOST_OFFERED:
            break
        columns = np.column_stack(
            [np.ones(times.size), times / longest, -np.expm1(-times[:, None] / retardation)],
        )
        for weights in _levelled(columns[seen], exact[seen]):
            found = _measured(material, _from_weights(material, weights, retardation, longest), times)
            idle = 0 if found.error < 0.9 * best.error else idle + 1
            if _better(found, best, tolerance):
                best = found
        if best.error <= tolerance or idle >= 3 * _LEVELLINGS:
            break
    return best


def measured_error(material: Material, prony: Prony, times: Array) -> float:
    """Largest ``|C~ - C| / C`` at the times, infinite where only the series is not zero. [s]"""
    exact = np.asarray(material.contact_compliance(times))
    deviation = np.abs(np.asarray(prony.contact_compliance(times)) - exact)
    relative = deviation / np.where(exact > 0, exact, 1.0)
    relative[(exact == 0) & (deviation > 0)] = math.inf
    return float(relative.max())


def _measured(material: Material, prony: Prony, times: Array) -> Series:
    return Series(prony, measured_error(material, prony, times))


def _better(found: Series, best: Series, tolerance: float) -> bool:
    """Fewer terms within the tolerance, a smaller error beyond it."""
    if found.error <= tolerance and best.error <= tolerance:
        return len(found.prony.times) < len(best.prony.times)
    return found.error < best.error


def _instants(material: Material, shortest: float, longest: float) -> Array:
    """Where the error is measured: a dense logarithmic grid, and the rows of tables. [s]"""
    rows = [t for t in _rows(material) if shortest < t < longest]
    return np.unique(np.append(lattice(shortest, longest, _DENSE), rows))


def _rows(material: Material) -> tuple[float, ...]:
    if isinstance(material, Tabulated):
        return material.times
    return _rows(material.a) + _rows(material.b) if isinstance(material, Pair) else ()


def _check_range(shortest: float, longest: float, tolerance: float) -> None:
    if not 0 < shortest <= longest < math.inf:
        raise InputError(f"times are {shortest!r} to {longest!r} s: expected positive times in order")
    if not 0 < tolerance < math.inf:
        raise InputError(f"tolerance is {tolerance!r}: expected a positive number")


@dataclass(frozen=True)
class _Rule:
    """Trapezoidal rule of a power law: ``y`` ascends, and rates are ``exp(y) / time_scale``."""

    y: Array
    weights: Array
    spacing: float

    @classmethod
    def over(cls, material: PowerLaw, spacing: float, shortest: float, longest: float) -> _Rule:
        """All the terms that a range of times can see to the last digit."""
        low = math.floor((math.log(material.time_scale / longest) - 30) / spacing)
        high = math.ceil((math.log(material.time_scale / shortest) + 4) / spacing)
        y = spacing * np.arange(low, high + 1, dtype=float)
        exponent = material.exponent
        factor = material.coefficient * exponent / math.gamma(1 - exponent) * spacing
        return cls(y, factor * np.exp(-exponent * y), spacing)

    def series(self, material: PowerLaw) -> Prony:
        """The terms as a series, with the tails beyond them summed up."""
        exponent, scale, spacing = material.exponent, material.time_scale, self.spacing
        # sums of geometric series: of the weights beyond the last term, of weight times rate before the first
        faster = self.weights[-1] * math.exp(-exponent * spacing) / -math.expm1(-exponent * spacing)
        before = math.exp(-(1 - exponent) * spacing) / -math.expm1(-(1 - exponent) * spacing)
        slower = self.weights[0] * math.exp(self.y[0]) / scale * before
        return Prony(
            material.glassy + faster,
            slower,
            tuple(self.weights[::-1].tolist()),
            tuple((scale * np.exp(-self.y[::-1])).tolist()),
            material.poisson,
        )

    def trimmed(self, material: PowerLaw, times: Array, tolerance: float) -> _Rule:
        """Fewer terms: the fastest and the slowest given to the tails while the error allows it."""
        exact = np.asarray(material.creep_compliance(times))
        error = np.asarray(self.series(material).creep_compliance(times)) / exact - 1
        first, last = 0, self.y.size - 1
        while first < last:
            x = np.exp(self.y[[first, last]])[:, None] * (times / material.time_scale)
            # a term 1 - exp(-x) replaced by x, or by 1
            change = self.weights[[first, last], None] / exact * np.vstack([x[0] + np.expm1(-x[0]), np.exp(-x[1])])
            reached = np.abs(error + change).max(axis=1)
            end = int(np.argmin(reached))
            if reached[end] > tolerance:
                break
            error = error + change[end]
            first, last = first + (end == 0), last - (end == 1)
        return _Rule(self.y[first : last + 1], self.weights[first : last + 1], self.spacing)


def _levelled(columns: Array, exact: Array) -> Iterator[Array]:
    """Weights by least squares, then with the rows of large error counting more and more (Lawson's iteration)."""
    importance = np.ones(exact.size)
    for _ in range(_LEVELLINGS):
        weights = nonnegative(columns, exact, exact / importance)
        yield weights
        misfit = np.abs(columns @ weights / exact - 1)
        if not misfit.any():
            return
        importance = importance * np.sqrt(0.02 + misfit / misfit.max())


def _from_weights(material: Tabulated, weights: Array, retardation: Array, longest: float) -> Prony:
    used = np.flatnonzero(weights[2:] > 0)
    return Prony(
        float(weights[0]),
        float(weights[1]) / longest,
        tuple(weights[2:][used].tolist()),
        tuple(retardation[used].tolist()),
        material.poisson,
    )
