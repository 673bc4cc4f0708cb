"""Creep compliance as measured: a table, interpolated and never extrapolated."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import scipy  # which imports a submodule when it is first used: scipy.optimize takes 0.2 s
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.checks import check_number, check_poisson, checked_rows
from roughvisc.mechanics.materials.words import Built, PrintedAsBuilt, as_built
from roughvisc.units import Quantity, quantities

Array = NDArray[np.float64]


@quantities(times="s", compliances="1/Pa")
@dataclass(frozen=True, repr=False)
class Tabulated(PrintedAsBuilt):
    """Measured shear creep compliance, without a fit.

    Between rows the compliance is linear in the logarithm of time; from a first row at time zero it is linear in time.
    Before a first row at a later time, the first decade of rows is extrapolated by another decade, as a power or the
    logarithm of time, and the compliance is linear in time before that. (A compliance that is constant until the first
    row and increases from there would not be passive.) The instantaneous compliance is at least a tenth of the first
    row. The table is not extrapolated beyond the last row.

    Parameters
    ----------
    times : sequence of float or str
        Times in increasing order; the first may be zero. [s]
    compliances : sequence of float or str
        ``J`` at these times. [1/Pa]
    noise : float
        Largest relative decrease below an earlier row that counts as noise, such as 0.01. Creep compliances increase;
        isotonic regression removes such decreases.
    poisson : float
        Poisson ratio, constant in time.
    remark : str
        Further text for the notes. Ignored in comparisons.

    Attributes
    ----------
    repaired : tuple of float
        The compliances in increasing order. [1/Pa]
    notes : tuple of str
        Assumptions and repairs, one sentence each.

    Raises
    ------
    InputError
        If a row is negative, not finite, not in increasing order of time, or lower than an earlier one by more than the
        noise; the message names the row, counted from 0. Also, later, if a time beyond the last row is needed.
    """

    times: tuple[Quantity, ...]
    compliances: tuple[Quantity, ...]
    noise: float = 0.0
    poisson: float = 0.5
    remark: str = field(default="", compare=False)
    repaired: tuple[float, ...] = field(init=False, repr=False, compare=False)
    notes: tuple[str, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        times, compliances = checked_rows(("time", "compliance"), self.times, self.compliances)
        object.__setattr__(self, "times", tuple(times.tolist()))
        object.__setattr__(self, "compliances", tuple(compliances.tolist()))
        check_number("noise", self.noise, "1", zero=True)
        check_poisson(self.poisson)
        if not compliances.any():
            raise InputError("all compliances are zero: a rigid material cannot be pressed")
        repaired, notes = _ascending(times, compliances, self.noise)
        object.__setattr__(self, "repaired", tuple(repaired.tolist()))
        if times[0] > 0:
            notes.append(
                f"nothing was measured before {times[0]:g} s: the compliance at once is taken as "
                f"{_before(times, repaired)[0]:.3g} 1/Pa, from the course of the first decade"
            )
        object.__setattr__(self, "notes", (*notes, self.remark) if self.remark else tuple(notes))

    @property
    def note(self) -> str:
        """The notes as one text."""
        return "; ".join(self.notes)

    def _built(self) -> Built:
        """With readable units; of a long table its ends."""
        noise = {"noise": (self.noise, "1")} if self.noise else {}
        rows = {"times": (self.times, "s"), "compliances": (self.compliances, "1/Pa")}
        return as_built("Tabulated", self.poisson, self.remark, **rows, **noise)

    def creep_compliance(self, t: ArrayLike) -> Array:
        """Shear creep compliance ``J(t)``. [1/Pa]"""
        t = self._within(t)
        return self._value(t, self._piece(t))

    def contact_compliance(self, t: ArrayLike) -> Array:
        """Contact compliance ``C(t) = (1 - nu) J(t) / 2``. [1/Pa]"""
        return np.asarray(0.5 * (1 - self.poisson) * self.creep_compliance(t))

    def contact_integral(self, t: ArrayLike) -> Array:
        """First antiderivative ``int_0^t C``, exact for the interpolated table. [s/Pa]"""
        t = np.asarray(t, dtype=float)
        return np.asarray(t * self.mean_contact_compliance(np.zeros_like(t), t))

    def mean_contact_compliance(self, s: ArrayLike, h: ArrayLike) -> Array:
        """Mean of ``C`` over ``[s, s + h]``, [1/Pa]; ``C(s)`` for ``h = 0``. [s]

        A mean of the means over the pieces of the table, weighted by their lengths: nothing is subtracted.
        """
        s, h = np.broadcast_arrays(np.asarray(s, dtype=float), np.asarray(h, dtype=float))
        start, end = self._within(s), self._within(s + h)
        first, last = self._piece(start), self._piece(end)
        # the first piece from the start on, or all that is asked for; the last up to the end
        one = first == last
        length = np.where(one, end, self._edges[first + 1]) - start
        total = length * self._mean(start, start + length, first)
        tail = np.where(one, 0.0, end - self._edges[last])
        total += tail * self._mean(self._edges[last], self._edges[last] + tail, last)
        length += tail
        # whole pieces between them, in runs of 1, 2, 4, ... pieces
        place, count = first + 1, np.maximum(last - first - 1, 0)
        for level, run in enumerate(self._runs):
            if not count.any():
                break
            odd = count % 2 == 1
            here = np.where(odd, place, 0)
            total += np.where(odd, run[here], 0.0)
            length += np.where(
                odd, self._edges[np.minimum(here + 2**level, self._edges.size - 1)] - self._edges[here], 0.0
            )
            place, count = place + odd * 2**level, count // 2
        mean = np.where(length > 0, total / np.where(length > 0, length, 1.0), self._value(start, first))
        return np.asarray(0.5 * (1 - self.poisson) * mean)

    @cached_property
    def _edges(self) -> Array:
        """Where pieces begin and end, from zero. [s]"""
        return np.array(self.times if self.times[0] == 0 else (0.0, self.times[0] / 10, *self.times))

    @cached_property
    def _levels(self) -> Array:
        """Compliance at the edges. [1/Pa]"""
        if self.times[0] == 0:
            return np.array(self.repaired)
        return np.append(_before(np.array(self.times), np.array(self.repaired)), self.repaired)

    @cached_property
    def _slopes(self) -> Array:
        """Rise in each piece: over time in the first, [1/(Pa s)], over the logarithm in the others. [1/Pa]"""
        edges, rise = self._edges, np.diff(self._levels)
        return rise / np.append(edges[1], np.log1p(np.diff(edges[1:]) / edges[1:-1]))

    @cached_property
    def _runs(self) -> list[Array]:
        """Integrals over each piece, over two from each on, over four, ... [s/Pa]"""
        pieces = np.arange(self._edges.size - 1)
        runs = [np.diff(self._edges) * self._mean(self._edges[:-1], self._edges[1:], pieces)]
        while 2 ** len(runs) <= pieces.size:
            step = 2 ** (len(runs) - 1)
            runs.append(runs[-1][:-step] + runs[-1][step:])
        return runs

    def _within(self, t: ArrayLike) -> Array:
        """The times, if the table has them; rounding beyond its end is cut off. [s]"""
        t = np.asarray(t, dtype=float)
        end = self.times[-1]
        if t.size and not np.max(t) <= end * (1 + 1e-12):
            raise InputError(
                f"creep is asked for at {np.max(t):g} s, and the table ends at {end:g} s: expected a table as long as "
                "the program; creep data are not extrapolated"
            )
        return np.clip(t, 0.0, end)

    def _piece(self, t: Array) -> NDArray[np.intp]:
        """Number of the piece that holds each time."""
        return np.clip(np.searchsorted(self._edges, t, side="right") - 1, 0, self._edges.size - 2)

    def _value(self, t: Array, piece: NDArray[np.intp]) -> Array:
        start = self._edges[piece]
        in_time = t - start
        in_logarithm = np.log1p(in_time / np.where(start > 0, start, 1.0))
        return np.asarray(self._levels[piece] + self._slopes[piece] * np.where(start > 0, in_logarithm, in_time))

    def _mean(self, a: Array, b: Array, piece: NDArray[np.intp]) -> Array:
        """Mean compliance over ``[a, b]`` within a piece. [1/Pa]"""
        in_time = (b - a) / 2
        in_logarithm = _mean_logarithm((b - a) / np.where(piece > 0, a, 1.0))
        return self._value(a, piece) + self._slopes[piece] * np.where(piece > 0, in_logarithm, in_time)


def _before(times: Array, compliances: Array) -> tuple[float, float]:
    """Compliance at time zero, and at a tenth of the first time, of a table that begins later. [1/Pa]

    The course in the first decade tells it: as a power law, ``J(0) + a t^alpha`` through its two ends and its middle,
    or as logarithmic creep that began a decade earlier, whichever falls less. An exponent above one counts as one.
    """
    first, span = float(compliances[0]), min(10.0, times[-1] / times[0])
    at = np.log(times[0]) + np.log(span) * np.array([0.5, 1.0])
    middle, end = (float(value) for value in np.interp(at, np.log(times), compliances))
    ratio = min((end - middle) / (middle - first), np.sqrt(span)) if middle > first else np.sqrt(span)
    power = (middle - first) / (ratio - 1) if ratio > 1 else np.inf
    logarithmic = (end - first) / np.log(span) * (1 + np.log(10))
    left = 10 ** -(np.log(ratio) / np.log(np.sqrt(span))) if power < logarithmic else 1 / (1 + np.log(10))
    fallen = min(power, logarithmic, 0.9 * first)
    return first - fallen, first - fallen * float(1 - left)


def _ascending(times: Array, compliances: Array, noise: float) -> tuple[Array, list[str]]:
    """Ascending compliances, and what was done to them."""
    highest = np.maximum.accumulate(compliances)
    drops = 1 - compliances / np.where(highest > 0, highest, 1.0)
    drops[highest == 0] = 0.0
    for row in np.flatnonzero(drops > noise)[:1]:
        raise InputError(
            f"table row {row}: compliance {compliances[row]:g} 1/Pa at {times[row]:g} s is {drops[row]:.2%} below an "
            f"earlier row, noise is {noise:g}: expected an ascending compliance, or a larger noise"
        )
    if not drops.any():
        return compliances, []
    # relative deviations count alike; a compliance of zero comes first and is never moved
    weights = (highest[-1] / np.where(compliances > 0, compliances, highest[-1])) ** 2
    repaired = np.maximum.accumulate(scipy.optimize.isotonic_regression(compliances, weights=weights).x)
    moved = np.abs(repaired - compliances) / np.where(repaired > 0, repaired, 1.0)
    return repaired, [
        f"{np.count_nonzero(moved > 1e-12)} of {times.size} rows were made to ascend by isotonic regression, "
        f"by {moved.max():.2%} at most"
    ]


def _mean_logarithm(x: Array) -> Array:
    """``((1 + x) log(1 + x) - x) / x``, the mean of ``log(t/a)`` over ``[a, a (1 + x)]``; ``x / 2`` for small ``x``."""
    small = np.minimum(x, 0.25)
    series = np.zeros_like(small)
    for k in range(26, 0, -1):  # sum_{k>=1} (-1)^(k+1) x^k / (k (k+1))
        series = small * (1 / (k * (k + 1)) - series)
    large = np.maximum(x, 0.25)
    return np.where(x < 0.25, series, (1 + 1 / large) * np.log1p(large) - 1)
