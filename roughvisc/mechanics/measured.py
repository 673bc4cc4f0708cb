"""Materials from measurements as they come: creep, relaxation, or dynamic moduli, in shear or in tension."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.checks import check_poisson, checked_rows
from roughvisc.mechanics.prony import Prony
from roughvisc.mechanics.relaxation import from_relaxation
from roughvisc.mechanics.spectrum import lattice, nonnegative
from roughvisc.mechanics.tabulated import Tabulated

Array = NDArray[np.float64]
Kind = Literal["shear", "tensile"]

#: terms offered to a fit, in a decade of times
_PER_DECADE = (1, 1.5, 2, 3, 4, 6)
#: how much larger the misfit may be than the smallest found, for the sake of fewer terms
_ALLOWED = 1.1
#: rms misfit below which nothing is gained: no rheometer measures so well
_ACCURATE = 2e-4
#: how far beyond the measured times terms are offered: a slower one is a plateau, a faster one is not seen
_BEYOND = 3.0


def from_creep_table(
    times: Sequence[float],
    compliances: Sequence[float],
    kind: Kind = "shear",
    noise: float = 0.0,
    poisson: float = 0.5,
) -> Tabulated:
    """Material from a creep test: ``J(t)`` in shear, or ``D(t)`` in tension with ``J = 2 (1 + nu) D``.

    Parameters
    ----------
    times : sequence of float
        Ascending, the first may be zero. [s]
    compliances : sequence of float
        ``J`` or ``D`` at these times. [1/Pa]
    kind : {"shear", "tensile"}
        Which of them.
    noise : float
        Largest relative decrease that counts as noise.
    poisson : float
        Poisson ratio, constant in time.

    Returns
    -------
    Tabulated
        The table itself, without a fit.

    Raises
    ------
    InputError
        As :class:`~roughvisc.mechanics.tabulated.Tabulated`.
    """
    values = np.asarray(compliances, dtype=float) * _tensile_to_shear(kind, poisson)
    return Tabulated(tuple(times), tuple(values.tolist()), noise, poisson)


def from_relaxation_table(
    times: Sequence[float], moduli: Sequence[float], kind: Kind = "shear", poisson: float = 0.5
) -> Prony:
    """Material from a relaxation test, by a positive series of exponentials.

    Parameters
    ----------
    times : sequence of float
        Ascending, the first may be zero. [s]
    moduli : sequence of float
        ``G`` or ``E`` at these times. [Pa]
    kind : {"shear", "tensile"}
        Which of them; ``G = E / (2 (1 + nu))``.
    poisson : float
        Poisson ratio, constant in time.

    Returns
    -------
    Prony
        Its ``note`` states the number of terms, the misfit, and the times that were measured.

    Raises
    ------
    InputError
        If a row is negative, not finite, or not ascending in time; the row is named, counted from 0.

    Notes
    -----
    ``G(t) = G_e + sum G_k exp(-t / theta_k)`` by non-negative least squares of the relative misfit on a lattice of
    ``theta``; then :func:`~roughvisc.mechanics.relaxation.from_relaxation`, which is exact. Outside the measured
    times the series says what its slowest and its fastest terms say.
    """
    t, values = checked_rows(("time", "modulus"), times, moduli)
    for row in np.flatnonzero(values == 0)[:1]:
        raise InputError(f"table row {row}: modulus is 0: expected a positive modulus")
    shear = values / _tensile_to_shear(kind, poisson)
    known = t[t > 0]
    spectrum = _sparsest(
        lambda theta: np.column_stack([np.ones(t.size), np.exp(-t[:, None] / theta)]),
        (known[0] / _BEYOND, known[-1] * _BEYOND),
        shear,
        shear,
    )
    return spectrum.material(t.size, f"times {t[0]:g} to {t[-1]:g} s", poisson)


def from_dynamic(
    frequencies: Sequence[float],
    storage: Sequence[float],
    loss: Sequence[float],
    *,
    frequency_unit: Literal["rad/s", "Hz"],
    shift_factors: ArrayLike | None = None,
    kind: Kind = "shear",
    poisson: float = 0.5,
) -> Prony:
    """Material from dynamic moduli, a master curve if shift factors are given, by a positive series.

    Parameters
    ----------
    frequencies : sequence of float
        In any order: several temperatures may overlap. [`frequency_unit`]
    storage, loss : sequence of float
        ``G'`` and ``G''``, or ``E'`` and ``E''``. [Pa]
    frequency_unit : {"rad/s", "Hz"}
        Angular frequency, or cycles a second; there is no default, since the wrong one shifts all times by 2 pi.
    shift_factors : sequence of float, optional
        ``a_T`` of each row (or one for all), which its frequency is multiplied by.
    kind : {"shear", "tensile"}
        Which moduli; ``G = E / (2 (1 + nu))``.
    poisson : float
        Poisson ratio, constant in time.

    Returns
    -------
    Prony
        Its ``note`` states the number of terms, the misfit, and the frequencies that were measured.

    Raises
    ------
    InputError
        If a number is negative or not finite, or a frequency or a shift factor is not positive; the row is named.

    Notes
    -----
    ``G' = G_e + sum G_k w^2 theta_k^2 / (1 + w^2 theta_k^2)`` and ``G'' = sum G_k w theta_k / (1 + w^2 theta_k^2)``
    are fitted together by non-negative least squares, each relative to itself, or to a thousandth of ``|G*|`` where
    it is smaller.
    """
    if frequency_unit not in ("rad/s", "Hz"):
        raise InputError(f"frequency_unit is {frequency_unit!r}: expected 'rad/s' or 'Hz'")
    given = np.atleast_1d(np.asarray(frequencies, dtype=float))
    factors = np.ones(given.size) if shift_factors is None else np.asarray(shift_factors, dtype=float)
    factors = np.full(given.size, float(factors)) if factors.ndim == 0 else factors
    names = ("frequency", "storage modulus", "loss modulus", "shift factor")
    given, elastic, viscous, factors = checked_rows(names, given, storage, loss, factors, ascending=False)
    omega = given * factors * (2 * math.pi if frequency_unit == "Hz" else 1.0)
    for row in np.flatnonzero((omega == 0) | (elastic + viscous == 0))[:1]:
        raise InputError(f"table row {row}: a frequency, a shift factor or both moduli are 0: expected positive")
    factor = _tensile_to_shear(kind, poisson)
    elastic, viscous = elastic / factor, viscous / factor
    target = np.append(elastic, viscous)

    def columns(theta: Array) -> Array:
        x = omega[:, None] * theta
        in_phase = np.column_stack([np.ones(omega.size), x**2 / (1 + x**2)])
        return np.vstack([in_phase, np.column_stack([np.zeros(omega.size), x / (1 + x**2)])])

    spectrum = _sparsest(
        columns,
        (1 / (_BEYOND * omega.max()), _BEYOND / omega.min()),
        target,
        np.maximum(target, 1e-3 * np.tile(np.hypot(elastic, viscous), 2)),
    )
    return spectrum.material(omega.size, f"frequencies {omega.min():g} to {omega.max():g} rad/s", poisson)


def _tensile_to_shear(kind: Kind, poisson: float) -> float:
    """Shear compliance over the compliance measured."""
    check_poisson(poisson)
    if kind not in ("shear", "tensile"):
        raise InputError(f"kind is {kind!r}: expected 'shear' or 'tensile'")
    return 2 * (1 + poisson) if kind == "tensile" else 1.0


@dataclass(frozen=True)
class _Spectrum:
    """Moduli [Pa], the equilibrium modulus first, at relaxation times [s], and the relative misfit of each datum."""

    moduli: Array
    theta: Array
    misfit: Array

    @property
    def terms(self) -> int:
        return int(np.count_nonzero(self.moduli))

    @property
    def rms(self) -> float:
        return float(np.sqrt(np.mean(self.misfit**2)))

    def material(self, rows: int, span: str, poisson: float) -> Prony:
        used = np.flatnonzero(self.moduli[1:])
        series = from_relaxation(
            float(self.moduli[0]), self.moduli[1:][used].tolist(), self.theta[used].tolist(), poisson
        )
        misfit = f"largest misfit {np.abs(self.misfit).max():.2g}, rms {self.rms:.2g} (relative)"
        return dataclasses.replace(series, note=f"{self.terms} terms fitted to {rows} rows, {misfit}, {span}")


def _sparsest(columns: Callable[[Array], Array], within: tuple[float, float], target: Array, scale: Array) -> _Spectrum:
    """The spectrum of fewest terms among those whose misfit is about the smallest."""
    found = []
    for per_decade in _PER_DECADE:
        theta = lattice(*within, per_decade)
        matrix = columns(theta)
        moduli = nonnegative(matrix, target, scale)
        found.append(_Spectrum(moduli, theta, (matrix @ moduli - target) / scale))
    enough = max(_ALLOWED * min(one.rms for one in found), _ACCURATE)
    return min((one for one in found if one.rms <= enough), key=lambda one: one.terms)
