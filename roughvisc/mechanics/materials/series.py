"""Certified exponential series: any creep compliance as a Prony series whose error is measured.

The terms are positive, so that the series is a material: it dissipates, and the compliance of a step is positive. The
instantaneous compliance is the material's own: what a jump does is exact, and what creeps faster than the shortest age
that is asked for becomes very fast terms. Both compliances ascend, so that before that age they differ by less than
what has crept by then.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.models import Material, Pair, PowerLaw, Prony, Tabulated, pair
from roughvisc.mechanics.materials.passive import first_time, nearest_series
from roughvisc.mechanics.materials.protocol import check_creep, complete
from roughvisc.mechanics.materials.spectrum import lattice, nonnegative

Array = NDArray[np.float64]

#: instants in a decade at which the error is measured
_DENSE = 100
#: most retardation times offered to a fit
_MOST_OFFERED = 300
#: a table's retardation times begin at such parts of the shortest time: the wider range is the more accurate, with more
#: terms for what has crept before
_FASTER = (3.0, 10.0)
#: how often the rows are weighted anew to level the error
_LEVELLINGS = 6


@dataclass(frozen=True)
class Series:
    """A series, and how far it is from the material that it stands for.

    Attributes
    ----------
    prony : Prony
        The series, with the material's instantaneous compliance.
    error : float
        Largest ``|J~ - J| / J`` over the times asked for, measured on a dense logarithmic grid.
    shortest : float
        From when on. [s]
    pressed : Material
        What the error is relative to: the material, its tables made passive where they had no series.
    repair : str
        What was done to the tables, if anything.
    deviation : float
        Largest relative deviation from their rows after that, if it is more than their noise.
    """

    prony: Prony
    error: float
    shortest: float
    pressed: Material
    repair: str = ""
    deviation: float = 0.0


def series_of(material: Material, shortest: float, longest: float, tolerance: float) -> Series:
    """Series for any material; a series is its own, with no error.

    A table that has none within the tolerance is no passive material: what is pressed is then the
    :func:`~roughvisc.mechanics.materials.passive.nearest_series`, which does not depend on the tolerance.

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
        time, or an object of another kind has no creep compliance.
    """
    _check_range(shortest, longest, tolerance)
    if isinstance(material, Prony):
        return Series(material, 0.0, shortest, material)
    if isinstance(material, PowerLaw):
        return power_law_series(material, shortest, longest, tolerance)
    if isinstance(material, Tabulated):
        found = table_series(material, shortest, longest, tolerance)
        if found.error <= tolerance:
            return found
        nearest = nearest_series(material)
        deviation = nearest.largest if nearest.largest > material.noise else 0.0
        return Series(nearest.prony, 0.0, shortest, nearest.prony, nearest.note, deviation)
    if isinstance(material, Pair):
        parts = [series_of(body, shortest, longest, tolerance) for body in (material.a, material.b)]
        joined = pair(parts[0].prony, parts[1].prony)
        assert isinstance(joined, Prony)
        pressed = pair(parts[0].pressed, parts[1].pressed)
        shortest = max(part.shortest for part in parts)
        error = measured_error(pressed, joined, _instants(pressed, shortest, longest))
        repair = "; ".join(f"{name}: {part.repair}" for name, part in zip("ab", parts, strict=True) if part.repair)
        return Series(joined, error, shortest, pressed, repair, max(part.deviation for part in parts))
    material = complete(material)
    check_creep(material, _instants(material, shortest, longest))
    found = _fitted(material, shortest, longest, tolerance)
    if found.error > tolerance:
        return replace(found, repair="no positive series comes nearer: the material is not passive")
    return found


def power_law_series(material: PowerLaw, shortest: float, longest: float, tolerance: float) -> Series:
    r"""Series for a power law, by the trapezoidal rule in the logarithm of the rate.

    Parameters and errors as in :func:`series_of`.

    Notes
    -----
    .. math:: t^\alpha = \frac{\alpha}{\Gamma(1-\alpha)} \int e^{-\alpha y} \left(1 - e^{-e^y t}\right) dy

    The rule converges exponentially in the inverse of its spacing. Rates too fast to be seen are summed up into one
    exponential, which has their compliance and the integral of their course, so that means over steps from rest are
    right as well; rates too slow are summed up into the fluidity. The widest spacing that meets the tolerance is
    sought, and terms at both ends are then given to the tails while the error allows it.
    """
    _check_range(shortest, longest, tolerance)
    times = _instants(material, shortest, longest)
    best = _unfit(material, longest)
    met = 0.0
    for spacing in 4.0 * 0.95 ** np.arange(68):  # down to 0.13: beyond all digits
        if met and spacing < 0.7 * met:
            break
        rule = _Rule.over(material, spacing, shortest, longest)
        found = _measured(material, rule.series(), times)
        if found.error <= tolerance:
            met = met or float(spacing)
            found = _measured(material, rule.trimmed(times, tolerance).series(), times)
        if _better(found, best, tolerance):
            best = found
    return best


def table_series(material: Tabulated, shortest: float, longest: float, tolerance: float) -> Series:
    """Series for a table, by non-negative least squares on a lattice of retardation times.

    Parameters and errors as in :func:`series_of`. The number of times is raised until the tolerance is reached or
    more times are of no use; the best series is returned, with its measured error. That is measured from the first
    row at a positive time on: before it nothing was measured, and the series takes its own course. A table with a
    compliance of zero at a time within the range has no series: the error is infinite.
    """
    _check_range(shortest, longest, tolerance)
    return _fitted(material, min(max(shortest, first_time(material)), longest), longest, tolerance)


def _creep(material: Material, t: ArrayLike) -> Array:
    """Shear creep compliance; of a material of the user's own from the contact compliance. [1/Pa]"""
    if isinstance(material, PowerLaw | Tabulated):
        return material.creep_compliance(t)
    return np.asarray(2 / (1 - material.poisson) * material.contact_compliance(t))


def _fitted(material: Material, shortest: float, longest: float, tolerance: float) -> Series:
    """Non-negative least squares on ever finer lattices of retardation times."""
    times = _instants(material, shortest, longest)
    exact, glassy = _creep(material, times), float(_creep(material, 0.0))
    seen = exact > 0
    best = _unfit(material, longest)
    for faster in _FASTER:
        idle = 0
        for per_decade in (1, 1.5, 2, 3, 4, 6, 8, 12, 24, 48):
            retardation = lattice(shortest / faster, longest * 3, per_decade)
            if retardation.size > _MOST_OFFERED:
                break
            columns = np.column_stack([times / longest, -np.expm1(-times[:, None] / retardation)])
            reached = False
            for weights in _levelled(columns[seen], exact[seen], glassy):
                found = _measured(material, _from_weights(material, weights, retardation, longest), times)
                idle = 0 if found.error < 0.9 * best.error else idle + 1
                reached = reached or found.error <= tolerance
                if _better(found, best, tolerance):
                    best = found
            if reached or idle >= 3 * _LEVELLINGS:
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
    return Series(prony, measured_error(material, prony, times), float(times[0]), material)


def _unfit(material: Material, longest: float) -> Series:
    """What any series is better than."""
    return Series(Prony(max(float(_creep(material, longest)), 1e-300)), math.inf, longest, material)


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

    material: PowerLaw
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
        return cls(material, y, factor * np.exp(-exponent * y), spacing)

    def series(self) -> Prony:
        """The terms as a series, with the tails beyond them summed up."""
        weight, time = self._faster(-1)
        return Prony(
            self.material.glassy,
            self._slower(0),
            (weight, *self.weights[::-1].tolist()),
            (time, *(self.material.time_scale * np.exp(-self.y[::-1])).tolist()),
            self.material.poisson,
        )

    def trimmed(self, times: Array, tolerance: float) -> _Rule:
        """Fewer terms: the fastest and the slowest given to the tails while the error allows it."""
        exact = self.material.creep_compliance(times)

        def term(i: int) -> Array:
            return self.weights[i] * -np.expm1(-np.exp(self.y[i]) * times / self.material.time_scale)

        def tails(first: int, last: int) -> Array:
            weight, time = self._faster(last)
            return self._slower(first) * times - weight * np.expm1(-times / time)

        first, last = 0, self.y.size - 1
        kept = self.material.glassy + sum(term(i) for i in range(last + 1))
        while first < last:
            trials = [(kept - term(first), first + 1, last), (kept - term(last), first, last - 1)]
            reached = [np.abs((rest + tails(*ends)) / exact - 1).max() for rest, *ends in trials]
            end = int(np.argmin(reached))
            if reached[end] > tolerance:
                break
            kept, first, last = trials[end]
        return replace(self, y=self.y[first : last + 1], weights=self.weights[first : last + 1])

    def _faster(self, last: int) -> tuple[float, float]:
        """One term for all beyond the last: its compliance [1/Pa], and its time, which keeps their integral. [s]"""
        exponent, spacing = self.material.exponent, self.spacing
        # sums of geometric series: of the weights, and of weight times retardation time
        weights = math.exp(-exponent * spacing) / -math.expm1(-exponent * spacing)
        moments = math.exp(-(1 + exponent) * spacing) / -math.expm1(-(1 + exponent) * spacing)
        time = self.material.time_scale * math.exp(-self.y[last])
        return float(self.weights[last] * weights), float(time * moments / weights)

    def _slower(self, first: int) -> float:
        """Fluidity for all before the first term: the sum of weight times rate. [1/(Pa s)]"""
        spacing = (1 - self.material.exponent) * self.spacing
        before = math.exp(-spacing) / -math.expm1(-spacing)
        return float(self.weights[first] * math.exp(self.y[first]) / self.material.time_scale * before)


def _levelled(columns: Array, exact: Array, glassy: float) -> Iterator[Array]:
    """Weights by least squares, then with the rows of large error counting more and more (Lawson's iteration)."""
    importance = np.ones(exact.size)
    for _ in range(_LEVELLINGS):
        weights = nonnegative(columns, exact - glassy, exact / importance)
        yield weights
        misfit = np.abs((glassy + columns @ weights) / exact - 1)
        if not misfit.any():
            return
        importance = importance * np.sqrt(0.02 + misfit / misfit.max())


def _from_weights(material: Material, weights: Array, retardation: Array, longest: float) -> Prony:
    used, glassy = np.flatnonzero(weights[1:] > 0), float(_creep(material, 0.0))
    if not weights.any() and not glassy:  # nothing but zeros was seen
        return _unfit(material, longest).prony
    return Prony(
        glassy,
        float(weights[0]) / longest,
        tuple(weights[1:][used].tolist()),
        tuple(retardation[used].tolist()),
        material.poisson,
    )
