"""The passive material nearest to a measured creep table.

A passive material dissipates: its compliance is a positive sum of exponentials (a Bernstein function). Rows with noise
are none, nor is an interpolation with kinks: the loss factor is negative at some frequencies, and under a held approach
the force may rise. What is pressed then is the positive series that comes nearest to the table.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy  # which imports a submodule when it is first used: scipy.optimize takes 0.2 s
from numpy.typing import NDArray

from roughvisc.mechanics.materials.prony import Prony
from roughvisc.mechanics.materials.spectrum import lattice
from roughvisc.mechanics.materials.tabulated import Tabulated

Array = NDArray[np.float64]

#: Retardation times offered in a decade, and the most of them.
_PER_DECADE, _MOST_OFFERED = (1, 1.5, 2, 3, 4, 6), 100
#: The most rows that all count (of more, those nearest to so many instants evenly spaced in the logarithm), and the
#: instants between them, in a decade and at most.
_MOST_ROWS, _INSTANTS, _MOST_INSTANTS = 120, 6, 120
#: By how much the largest deviation may exceed the least one, for the sake of fewer terms, and of all other deviations.
_FEWER, _SLACK = 1.2, 1.1
#: Largest deviation below which nothing is gained: no rheometer measures so well.
_ACCURATE = 2e-4
#: A part of the compliance that is nowhere larger than this is left out.
_UNSEEN = 1e-7


@dataclass(frozen=True)
class Nearest:
    """The nearest positive series to a table, and how far its rows are from it.

    Attributes
    ----------
    prony : Prony
        The series; its instantaneous compliance is the table's.
    largest, rms : float
        Of the relative deviation from the rows as measured. A row of no compliance counts relative to the first that
        has some.
    """

    prony: Prony
    largest: float
    rms: float

    @property
    def note(self) -> str:
        """What was done, in words."""
        return f"made passive: deviates from the rows by at most {100 * self.largest:.2g} %, rms {100 * self.rms:.2g} %"


def nearest_series(table: Tabulated) -> Nearest:
    r"""The positive series of least largest relative deviation from a table.

    Parameters
    ----------
    table : Tabulated
        The whole of it counts, whatever part a program asks for.

    Returns
    -------
    Nearest

    Notes
    -----
    :math:`J_0 + \varphi t + \sum J_i (1 - e^{-t/\tau_i})` with the table's :math:`J(0)`, non-negative :math:`\varphi`
    and :math:`J_i`, and a lattice of :math:`\tau_i`, compared with the rows and with the table's course between them:
    two linear programs. The first finds the least largest deviation :math:`\delta`; the second the least mean deviation
    among the series that deviate by at most a tenth more than :math:`\delta` anywhere.
    """
    times = np.array(table.times)
    rows = times[(times > 0) & (np.array(table.repaired) > 0)]
    between = lattice(rows[0], rows[-1], min(_INSTANTS, _MOST_INSTANTS / max(np.log10(rows[-1] / rows[0]), 1)))
    instants = np.unique(np.append(_fewer(times[times > 0]), between))
    exact = np.asarray(table.creep_compliance(instants))
    glassy = float(table.creep_compliance(0.0))
    scale = np.where(exact > 0, exact, exact[exact > 0][0])
    fits = []
    start, end = rows[0] / 10, 3 * rows[-1]
    for per_decade in _PER_DECADE:
        retardation = lattice(start, end, min(per_decade, _MOST_OFFERED / np.log10(end / start)))
        columns = np.column_stack([instants / instants[-1], -np.expm1(-instants[:, None] / retardation)])
        fits.append(_Fit(columns / scale[:, None], (exact - glassy) / scale, retardation))
    enough = max(_FEWER * min(fit.least for fit in fits), _ACCURATE)
    fit = next(fit for fit in fits if fit.least <= enough)
    weights = fit.weights()
    used = np.flatnonzero(weights[1:])
    prony = Prony(
        glassy,
        float(weights[0] / instants[-1]),
        tuple(weights[1:][used].tolist()),
        tuple(fit.retardation[used].tolist()),
        table.poisson,
    )
    measured = np.array(table.compliances)
    off = (np.asarray(prony.creep_compliance(times)) - measured) / np.where(measured > 0, measured, scale[0])
    return Nearest(prony, float(np.abs(off).max()), float(np.sqrt(np.mean(off**2))))


def first_time(table: Tabulated) -> float:
    """Time of the first row after time zero. [s]"""
    return next(t for t in table.times if t > 0)


def _fewer(times: Array) -> Array:
    """The times, or so many of them that a linear program is quick. [s]"""
    if times.size <= _MOST_ROWS:
        return times
    wanted = np.log(np.geomspace(times[0], times[-1], _MOST_ROWS))
    return times[np.unique(np.abs(np.log(times)[:, None] - wanted).argmin(axis=0))]


class _Fit:
    """Positive sums of columns that come near a target; rows are relative. The terms' times come along. [s]"""

    def __init__(self, columns: Array, target: Array, retardation: Array) -> None:
        self.norms = columns.max(axis=0)
        self.columns, self.target, self.retardation = columns / self.norms, target, retardation
        self._both = np.vstack([self.columns, -self.columns])
        self._sides = np.append(target, -target)
        # unknowns: the weights, and the largest deviation, which is to be small
        rows, terms = columns.shape
        largest = np.hstack([self._both, -np.ones((2 * rows, 1))])
        self._nearest = scipy.optimize.linprog(np.append(np.zeros(terms), 1.0), largest, self._sides, method="highs").x
        #: Least largest deviation.
        self.least = float(self._nearest[-1])

    def weights(self) -> Array:
        """Those of least mean deviation among all whose largest is about the least."""
        rows, terms = self.columns.shape
        # unknowns: the weights, and the deviation of each row, whose sum is to be small
        single = np.hstack([self._both, np.tile(-np.eye(rows), (2, 1))])
        bounds = [(0.0, None)] * terms + [(0.0, max(_SLACK * self.least, 1e-6))] * rows
        found = scipy.optimize.linprog(
            np.append(np.zeros(terms), np.ones(rows)), single, self._sides, bounds=bounds, method="highs"
        )
        weights = (found.x if found.success else self._nearest)[:terms]
        return np.asarray(np.where(weights > _UNSEEN, weights, 0.0) / self.norms)
