"""Relaxation modulus from a record of indentation, with bands, and its series.

While the contact of a sphere or a cone grows, force and depth are linear in the weights of a series with given times
(Lee and Radok). With ``q = depth^n`` and a constant ``k`` of the indenter,

    F(t) = k int G(t - s) dq(s),    G(t) = G_e + sum G_i exp(-t / theta_i)
    q(t) = 1/k int J(t - s) dF(s),  J(t) = J_0 + phi t + sum J_i (1 - exp(-t / tau_i))

so that one non-negative fit gives the series. The contact point is the other unknown. It and the bands are fitted to
the force, whose noise is larger than the noise of the depth: noise in the columns of a fit would make it biased.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy  # which imports a submodule when it is first used: scipy.optimize takes 0.2 s
from numpy.typing import NDArray

from roughvisc.mechanics.materials.series import lattice

Array = NDArray[np.float64]
#: Relaxation times per decade. With three, the series cannot follow a spectrum between the times: its error was up to
#: five times the scatter, and bands of 90 % covered half.
_PER_DECADE = 12
#: Shortest relaxation time over the median step, and longest over the length of the record.
_SHORTEST = 2.0
_LONGEST = 3.0
#: Steps from the contact to the first time of the bands, and number of times.
_FIRST = 5.0
_COUNT = 30
#: Rise of the squared misfit, over the variance, at the end of an interval of 90 %: the quantile of chi-squared.
_RISE = 2.706
#: Least noise of a force, over the largest force.
_LEAST_NOISE = 1e-6
#: Trial contact points, steps of bisection, and weight of a prescribed value, over the norm of the forces.
_TRIALS = 25
_BISECTIONS = 9
_PRESCRIBED = 1e3


@dataclass(frozen=True)
class Indentation:
    """Rows of a growing contact, and the indenter.

    Parameters
    ----------
    time, force, depth : ndarray
        Ascending times [s], forces [N] and depths from any zero [m].
    factor, exponent : float
        ``k`` [m^(2 - n)] and ``n`` of the elastic contact, ``F = k G depth^n``.
    """

    time: Array
    force: Array
    depth: Array
    factor: float
    exponent: float

    @property
    def length(self) -> float:
        """Time from the first to the last row. [s]"""
        return float(self.time[-1] - self.time[0])

    def terms(self) -> Array:
        """Return the times of the series that the record may show. [s]"""
        step = float(np.median(np.diff(self.time)))
        return lattice(_SHORTEST * step, _LONGEST * self.length, _PER_DECADE)

    def columns(self, contact: float, terms: Array) -> Array:
        """Return the force of each unit modulus, the equilibrium modulus first, for a contact point. [N/Pa]"""
        course = self.power(contact)
        return self.factor * np.column_stack([course, relaxed(self.time, course, terms)])

    def creep_columns(self, terms: Array) -> Array:
        """Return the power of the depth of each unit compliance: instantaneous, flow over `length`, terms."""
        mean = (self.force[1:] + self.force[:-1]) / 2
        flowed = np.append(0.0, np.cumsum(np.diff(self.time) * mean)) / self.length
        crept = self.force[:, None] - relaxed(self.time, self.force, terms)
        return np.column_stack([self.force, flowed, crept]) / self.factor

    def power(self, contact: float) -> Array:
        """Return the power of the depth, ``q = depth^n``, for a contact point."""
        return np.asarray(np.maximum(self.depth - contact, 0.0) ** self.exponent)

    def noise(self, contact: float) -> Array:
        """Return the noise of the force and of the depth (times the slope of the force), as a root of squares. [N]

        Without the noise of the depth, a contact point with smaller slopes would be preferred.
        """
        depth = np.maximum(self.depth - contact, 0.0)
        largest = max(float(depth.max()), 1e-300)
        of_depth = self.exponent * (depth / largest) ** (self.exponent - 1) * noise_of(self.depth) / largest
        highest = float(self.force.max())
        return np.asarray(highest * np.hypot(of_depth, max(noise_of(self.force) / highest, _LEAST_NOISE)))

    def sensitivity(self, shift: Array, contact: float, terms: Array, moduli: Array) -> Array:
        """Return the change of the force if all depths change by `shift`, which is small. [N]"""
        depth = np.maximum(self.depth - contact, 0.0)
        change = self.exponent * depth ** (self.exponent - 1) * shift
        return self.factor * (moduli[0] * change + relaxed(self.time, change, terms) @ moduli[1:])


def noise_of(course: Array) -> float:
    """Return the standard deviation of the noise of a smooth course, from its second differences."""
    return float(np.median(np.abs(np.diff(course, 2)))) / (0.6745 * math.sqrt(6.0))


def relaxed(time: Array, course: Array, terms: Array) -> Array:
    """Return ``int exp(-(t - s) / theta) d course(s)`` at all rows, for a course that is linear between rows."""
    ages = np.diff(time)[:, None] / terms
    decay = np.exp(-ages)
    rise = np.diff(course)[:, None] * np.where(ages > 1e-8, -np.expm1(-ages) / np.maximum(ages, 1e-8), 1.0)
    sums = np.zeros((time.size, terms.size))
    sums[0] = course[0]
    for row in range(len(ages)):
        sums[row + 1] = sums[row] * decay[row] + rise[row]
    return sums


def fitted_weights(columns: Array, target: Array) -> tuple[Array, float]:
    """Return the non-negative weights of columns whose sum fits a target, and the norm of the misfit."""
    norms = np.linalg.norm(columns, axis=0)
    norms[norms == 0] = 1.0
    weights, misfit = scipy.optimize.nnls(columns / norms, target, maxiter=50 * norms.size)
    return weights / norms, float(misfit)


def contact_point(record: Indentation, low: float, high: float) -> float:
    """Return the contact point between two depths at which the series fits best. [m]"""

    def misfit(contact: float, terms: Array) -> float:
        noise = record.noise(contact)
        return fitted_weights(record.columns(contact, terms) / noise[:, None], record.force / noise)[1]

    terms = record.terms()
    trials = np.linspace(low, high, _TRIALS)
    best = int(np.argmin([misfit(trial, terms[:: _PER_DECADE // 2]) for trial in trials]))
    bounds = trials[max(best - 1, 0)], trials[min(best + 1, _TRIALS - 1)]
    options = {"xatol": 1e-4 * (high - low)}
    fit = scipy.optimize.minimize_scalar(misfit, bounds=bounds, args=(terms,), method="bounded", options=options)
    return float(fit.x)


@dataclass(frozen=True)
class Bands:
    """Relaxation modulus at some times, and the intervals of 90 %.

    Attributes
    ----------
    time, modulus, low, high : ndarray
        Times since a step of the depth [s], and shear moduli. [Pa]
    contact_error : float
        Half-width of the interval of the contact point; zero if it is given. [m]
    """

    time: Array
    modulus: Array
    low: Array
    high: Array
    contact_error: float


def bands(record: Indentation, contact: float, drift: float, *, searched: bool) -> Bands:
    """Return the range of the moduli of all series that fit the record about as well as the best series.

    Parameters
    ----------
    record : Indentation
        Rows of a growing contact.
    contact : float
        Contact point. [m]
    drift : float
        Standard deviation of an unknown constant drift of the depth. [m/s]
    searched : bool
        Whether the contact point was found by a search, so that it is uncertain.

    Notes
    -----
    The interval of ``G(t)`` ends where the least squared misfit of all non-negative series with this ``G(t)`` exceeds
    the least one by 2.706 variances (profile likelihood [1]_). A bootstrap of the fit would leave out its bias:
    non-negative weights of noisy rows concentrate on few times. Correlated residuals increase the variance by the sum
    of their correlations.

    Contact point and drift enter by their derivatives, which are removed from all columns. A drift cannot be
    distinguished from slow relaxation and is therefore known only by its standard deviation.

    References
    ----------
    .. [1] M. Stanley, P. Patil, M. Kuusela, *J. Instrum.* 17 (2022) P10013.
    """
    terms = record.terms()
    noise = record.noise(contact)
    columns = record.columns(contact, terms) / noise[:, None]
    target = record.force / noise
    moduli, _ = fitted_weights(columns, target)
    residual = target - columns @ moduli
    freedom = max(residual.size - int(np.count_nonzero(moduli)), 1)
    spread = math.sqrt(float(residual @ residual) / freedom * correlation(residual))
    spread = max(spread, 1e-9 * float(np.abs(target).max()))
    ones = np.ones_like(record.time)
    by_contact = record.sensitivity(ones, contact, terms, moduli) / noise / spread
    by_drift = record.sensitivity(record.time - record.time[0], contact, terms, moduli) / noise / spread
    # below the rows of the record, one row states that the drift is zero with its standard deviation as the error
    nuisances = np.zeros((residual.size + 1, 2))
    nuisances[:-1, 0] = by_contact * searched
    nuisances[:, 1] = np.append(by_drift * drift, 1.0)
    system = np.vstack([np.column_stack([columns, target]) / spread, np.zeros(columns.shape[1] + 1)])
    basis, _ = np.linalg.qr(nuisances[:, 0 if searched else 1 :])
    factor = np.asarray(np.linalg.qr(system - basis @ (basis.T @ system), mode="r"))
    step = float(np.median(np.diff(record.time)))
    touched = record.time[np.flatnonzero(record.depth > contact)[0]]
    times = np.geomspace(_FIRST * step, record.time[-1] - touched, _COUNT)
    values = np.column_stack([np.ones(times.size), np.exp(-times[:, None] / terms)])
    low, high = np.transpose([_interval(factor[:, :-1], factor[:, -1], value) for value in values])
    contact_error = 0.0
    if searched:
        remaining = by_contact - columns @ np.linalg.lstsq(columns, by_contact, rcond=1e-6)[0]
        contact_error = math.sqrt(_RISE) / float(np.linalg.norm(remaining))
    return Bands(times, values @ moduli, low, high, contact_error)


def _interval(rows: Array, target: Array, value: Array) -> tuple[float, float]:
    """Return the ends of the interval of ``value @ weights``, over non-negative weights; see :func:`bands`."""
    norms = np.linalg.norm(rows, axis=0)
    norms[norms == 0] = 1.0
    rows = rows / norms
    value = value / norms
    weights, misfit = scipy.optimize.nnls(rows, target, maxiter=50 * norms.size)
    best = float(value @ weights)
    strength = _PRESCRIBED * float(np.linalg.norm(target)) / best
    extended = np.vstack([rows, strength * value])

    def is_close(wanted: float) -> bool:
        weights, _ = scipy.optimize.nnls(extended, np.append(target, strength * wanted), maxiter=50 * norms.size)
        return float(np.sum((rows @ weights - target) ** 2)) < misfit**2 + _RISE

    ends = []
    for sign in (-1, 1):
        inside = 0.0
        outside = 0.005
        while outside < 10 and is_close(best * (1 + sign * outside)):
            inside = outside
            outside = 2 * outside
        for _ in range(_BISECTIONS):
            middle = (inside + outside) / 2
            inside, outside = (middle, outside) if is_close(best * (1 + sign * middle)) else (inside, middle)
        ends.append(max(best * (1 + sign * outside), 0.0))
    return ends[0], ends[1]


def correlation(residual: Array) -> float:
    """Return one plus twice the sum of the correlations of successive residuals, at least one."""
    size = residual.size
    transform = np.fft.rfft(residual - residual.mean(), 2 * size)
    products = np.fft.irfft(np.abs(transform) ** 2)[:size]
    sums = 2 * np.cumsum(products / products[0]) - 1
    window = np.flatnonzero(np.arange(size) >= 5 * sums)
    return max(1.0, float(sums[window[0]] if window.size else sums[-1]))
