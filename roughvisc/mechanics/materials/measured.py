"""Materials from measurements as they come: creep, relaxation, or dynamic moduli, in shear or in tension."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.checks import Kind, checked_rows, tensile_to_shear
from roughvisc.mechanics.materials.prony import Prony
from roughvisc.mechanics.materials.relaxation import from_relaxation
from roughvisc.mechanics.materials.spectrum import lattice, nonnegative
from roughvisc.mechanics.materials.tabulated import Tabulated
from roughvisc.units import Quantity, quantities

Array = NDArray[np.float64]

#: terms offered to a fit, in a decade of times
_PER_DECADE = (1, 1.5, 2, 3, 4, 6)
#: how much larger the misfit may be than the smallest found, for the sake of fewer terms
_ALLOWED = 1.1
#: rms misfit below which nothing is gained: no rheometer measures so well
_ACCURATE = 2e-4
#: how far beyond the measured times terms are offered: a slower one is a plateau, a faster one is not seen
_BEYOND = 3.0
#: estimated error between rows beyond which a smooth spectrum is tried: its terms in a decade, and the weight of the
#: steps from term to term beside the misfit of the rows
_ROUGH, _SMOOTH_PER_DECADE, _STEPS = 0.01, 3, 0.01
#: rows that are left out in turn, at most
_LEFT_OUT = 40


@quantities(times="s", compliances="1/Pa")
def from_creep_table(
    times: Sequence[Quantity],
    compliances: Sequence[Quantity],
    kind: Kind = "shear",
    noise: float = 0.0,
    poisson: float = 0.5,
) -> Tabulated:
    """Material from a creep test: ``J(t)`` in shear, or ``D(t)`` in tension with ``J = 2 (1 + nu) D``.

    Parameters
    ----------
    times : sequence of float or str
        Ascending, the first may be zero. [s]
    compliances : sequence of float or str
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
        As :class:`~roughvisc.mechanics.materials.tabulated.Tabulated`.
    """
    values = np.asarray(compliances, dtype=float) * tensile_to_shear(kind, poisson)
    return Tabulated(tuple(times), tuple(values.tolist()), noise, poisson)


@quantities(times="s", moduli="Pa")
def from_relaxation_table(
    times: Sequence[Quantity], moduli: Sequence[Quantity], kind: Kind = "shear", poisson: float = 0.5
) -> Prony:
    """Material from a relaxation test, by a positive series of exponentials.

    Parameters
    ----------
    times : sequence of float or str
        Ascending, the first may be zero. [s]
    moduli : sequence of float or str
        ``G`` or ``E`` at these times. [Pa]
    kind : {"shear", "tensile"}
        Which of them; ``G = E / (2 (1 + nu))``.
    poisson : float
        Poisson ratio, constant in time.

    Returns
    -------
    Prony
        Its ``note`` states the number of terms, the misfit at the rows, an estimate of the error between them, and the
        measured times.

    Raises
    ------
    InputError
        If a row is negative, not finite, or not ascending in time; the row is named, counted from 0.

    Notes
    -----
    ``G(t) = G_e + sum G_k exp(-t / theta_k)`` by non-negative least squares of the relative misfit on a lattice of
    ``theta``; then :func:`~roughvisc.mechanics.materials.relaxation.from_relaxation`, which is exact. Outside the
    measured times its slowest and its fastest terms determine the series.

    The error between rows is estimated by leaving out each inner row in turn and predicting it from the others, which
    lie twice as far apart there. It is mostly too large and hardly ever too small. If it exceeds 1 %, a smooth spectrum
    with small steps between terms is also fitted, and used if it predicts the rows twice as well.
    """
    t, values = checked_rows(("time", "modulus"), times, moduli)
    for row in np.flatnonzero(values == 0)[:1]:
        raise InputError(f"table row {row}: modulus is 0: expected a positive modulus")
    shear = values / tensile_to_shear(kind, poisson)
    known = t[t > 0]
    spectrum = _sparsest(
        lambda theta: np.column_stack([np.ones(t.size), np.exp(-t[:, None] / theta)]),
        (known[0] / _BEYOND, known[-1] * _BEYOND),
        shear,
        shear,
        t,
    )
    return spectrum.material(t.size, f"times {t[0]:g} to {t[-1]:g} s", poisson)


@quantities(storage="Pa", loss="Pa")
def from_dynamic(
    frequencies: Sequence[float],
    storage: Sequence[Quantity],
    loss: Sequence[Quantity],
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
        Frequencies in any order; several temperatures may overlap. [`frequency_unit`]
    storage, loss : sequence of float or str
        ``G'`` and ``G''``, or ``E'`` and ``E''``. [Pa]
    frequency_unit : {"rad/s", "Hz"}
        Angular frequency, or cycles per second. There is no default, because the wrong one changes all times by the
        factor 2 pi.
    shift_factors : sequence of float, optional
        ``a_T`` of each row (or one for all), the factor for its frequency.
    kind : {"shear", "tensile"}
        Which moduli; ``G = E / (2 (1 + nu))``.
    poisson : float
        Poisson ratio, constant in time.

    Returns
    -------
    Prony
        Its ``note`` states the number of terms, the misfit at the rows, an estimate of the error between them, and the
        measured frequencies.

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
    factor = tensile_to_shear(kind, poisson)
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
        np.tile(omega, 2),
    )
    return spectrum.material(
        omega.size,
        f"frequencies {omega.min():g} to {omega.max():g} rad/s",
        poisson,
    )


@dataclass(frozen=True, eq=False)
class _Spectrum:
    """Terms that are offered to the rows of a measurement, and those that are used.

    ``at`` tells where a datum was measured: data with the same value are one row. ``steps`` weighs those from term to
    term beside the misfit.
    """

    theta: Array
    columns: Array
    target: Array
    scale: Array
    at: Array
    steps: float = 0.0

    def fitted(self, kept: NDArray[np.bool_] | slice = slice(None)) -> Array:
        """Moduli of the terms that come nearest to the data that are kept, the equilibrium modulus first. [Pa]"""
        matrix = self.columns[kept] / self.scale[kept, None]
        between = np.diff(np.eye(self.theta.size), axis=0) * (self.steps / np.max(self.target))
        matrix = np.vstack([matrix, np.column_stack([np.zeros(self.theta.size - 1), between])])
        wanted = np.append(self.target[kept] / self.scale[kept], np.zeros(self.theta.size - 1))
        return nonnegative(matrix, wanted, np.ones(wanted.size))

    @cached_property
    def moduli(self) -> Array:
        """The moduli for all data. [Pa]"""
        return self.fitted()

    @cached_property
    def misfit(self) -> Array:
        """Relative misfit of each datum."""
        return (self.columns @ self.moduli - self.target) / self.scale

    @cached_property
    def between(self) -> float:
        """Largest error of rows predicted from the others, those at the ends excepted; missing without such rows."""
        inner = np.unique(self.at)[1:-1]
        errors = []
        for row in inner[:: math.ceil(inner.size / _LEFT_OUT) or 1]:
            out = self.at == row
            error = (self.columns[out] @ self.fitted(~out) - self.target[out]) / self.scale[out]
            errors.append(float(np.abs(error).max()))
        return max(errors, default=math.nan)

    @property
    def terms(self) -> int:
        return int(np.count_nonzero(self.moduli))

    @property
    def rms(self) -> float:
        return float(np.sqrt(np.mean(self.misfit**2)))

    def series(self, moduli: Array, poisson: float) -> Prony:
        """The material of some moduli."""
        used = np.flatnonzero(moduli[1:])
        return from_relaxation(float(moduli[0]), moduli[1:][used].tolist(), self.theta[used].tolist(), poisson)

    def material(self, rows: int, span: str, poisson: float) -> Prony:
        """Return the material from all rows, with a note on the quality of the fit."""
        misfit = f"largest misfit {np.abs(self.misfit).max():.2g}, rms {self.rms:.2g} (relative)"
        if not math.isnan(self.between):
            misfit += f", error between rows up to about {self.between:.2g} (rows predicted from the others)"
        note = f"{self.terms} terms fitted to {rows} rows, {misfit}, {span}"
        return dataclasses.replace(self.series(self.moduli, poisson), note=note)


def _sparsest(
    columns: Callable[[Array], Array], within: tuple[float, float], target: Array, scale: Array, at: Array
) -> _Spectrum:
    """The spectrum of fewest terms among those whose misfit is about the smallest, or a smooth one if rows are few."""

    def offered(per_decade: float, steps: float = 0.0) -> _Spectrum:
        theta = lattice(*within, per_decade)
        return _Spectrum(theta, columns(theta), target, scale, at, steps)

    found = [offered(per_decade) for per_decade in _PER_DECADE]
    enough = max(_ALLOWED * min(one.rms for one in found), _ACCURATE)
    sparse = min((one for one in found if one.rms <= enough), key=lambda one: one.terms)
    if not sparse.between > _ROUGH:
        return sparse
    smooth = offered(_SMOOTH_PER_DECADE, _STEPS)
    return smooth if smooth.rms <= max(2 * enough, _ROUGH / 10) and smooth.between < sparse.between / 2 else sparse
