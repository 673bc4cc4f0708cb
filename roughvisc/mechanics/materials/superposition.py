"""Time-temperature superposition: shift factors of a table that was measured at several temperatures.

The shifts are those with which the rows of all temperatures agree best with one positive series, that is, with one
passive material. For given shifts the series is a non-negative least-squares fit, so that the shifts are the only
unknowns (variable projection [1]_). No overlap of neighbouring temperatures has to be chosen.

References
----------
.. [1] G. H. Golub and V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413-432; Jacobian by L. Kaufman, BIT 15
   (1975) 49-57.
.. [2] J. G. MacKinnon and H. White, J. Econometrics 29 (1985) 305-325, estimator HC3.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.mechanics.materials.series import lattice, nonnegative

Array = NDArray[np.float64]
#: Whether moduli change with temperature too: not, or in proportion to the absolute temperature.
Vertical = Literal["none", "rubber"]
#: Measured quantity of the rows.
Quantity = Literal["storage", "loss", "storage and loss", "relaxation", "creep"]

#: Largest difference of neighbouring temperatures that count as one. [K]
SAME_TEMPERATURE = 1.5
#: Terms of the series per decade, and factor by which their times extend beyond the times of the rows.
_PER_DECADE = 3.0
_BEYOND = 3.0
#: Error of a modulus relative to ``|G*|`` over its error relative to itself. A machine measures an angle, so that the
#: loss of a stiff sample and the storage of a melt are uncertain.
_OF_SIZE = 0.3
#: Decades between neighbouring temperatures among which the first guess is sought, and their number per decade.
_GUESSED = (-6.0, 2.0)
_GUESSES = 20
#: Largest number of iterations, of dampings in one, largest change of ``ln a_T`` in one, and relative decrease of the
#: squared misfit below which they end.
_MOST = 60
_DAMPINGS = 8
_LARGEST_CHANGE = 1.0
_DONE = 1e-7
#: Least part of a row that its own fit leaves to its residual; a row that nothing else determines has none.
_LEAST_SPARE = 1e-2
#: Uncertainty of a decimal logarithm of a shift factor from which the material warns. For melts the shifts of storage
#: and loss differ by 0.01, below the glass transition by 0.6 to 1.1.
_UNCERTAIN = 0.3
_DECADE = np.log(10.0)


@dataclass(frozen=True, eq=False)
class Superposition:
    """Shift factors of a table with several temperatures.

    Parameters
    ----------
    temperatures : ndarray
        Mean temperature of the rows of each temperature, ascending. [K]
    log_shift : ndarray
        Decimal logarithms of the shift factors ``a_T``, relative to the reference.
    sigma : ndarray
        Their standard deviations, from the scatter of the rows [2]_; NaN if the rows are too few to state it.
    split : ndarray
        Half the differences of the shifts from storage and from loss; NaN for creep and relaxation.
    other : float
        Largest change of the logarithms under the other `vertical`.
    misfit : float
        Root mean square of the relative deviations of the rows from the series that determines the shifts.
    reference : int
        Number of the temperature to which shifts refer.
    vertical : {"none", "rubber"}
        Whether moduli change as the absolute temperature.
    bounds : tuple of float
        Lowest and highest measured temperature. [K]
    at : ndarray
        Angular frequency [rad/s] or time [s] of each row.
    group : ndarray of int
        Number of the temperature of each row.
    values : dict of str to ndarray
        Measured rows: ``storage`` and ``loss`` [Pa], ``relaxation`` [Pa] or ``creep`` [1/Pa].
    factor : float
        Measured modulus over the shear modulus. [-]
    """

    temperatures: Array
    log_shift: Array
    sigma: Array
    split: Array
    other: float
    misfit: float
    reference: int
    vertical: Vertical
    bounds: tuple[float, float]
    at: Array
    group: NDArray[np.intp]
    values: dict[str, Array]
    factor: float = 1.0

    @property
    def reference_temperature(self) -> float:
        """Temperature at which the factors are one. [K]"""
        return float(self.temperatures[self.reference])

    def shift_factor(self, temperature: float) -> float:
        """Return ``a_T`` at a temperature [K], interpolated: ``log a_T`` is linear in ``1/T`` between temperatures."""
        lowest, highest = self.bounds
        if not lowest <= temperature <= highest:
            celsius = f"{lowest - 273.15:.4g} to {highest - 273.15:.4g} degC"
            expected = f"a measured temperature [K], {lowest:.2f} to {highest:.2f} K ({celsius})"
            raise InputError(key="temperature", found=temperature, expected=expected)
        return float(10 ** np.interp(-1 / temperature, -1 / self.temperatures, self.log_shift))

    def modulus_factor(self, temperature: float) -> float:
        """Return the factor of all moduli at a temperature [K]: ``T / T_r`` for a rubber, else one."""
        return temperature / self.reference_temperature if self.vertical == "rubber" else 1.0

    def reduced(self) -> tuple[Array, dict[str, Array]]:
        """Return frequency or time, and the values of the rows, at the reference temperature."""
        sign = -1.0 if {"creep", "relaxation"} & self.values.keys() else 1.0
        reduced_at = self.at * 10 ** (sign * self.log_shift)[self.group]
        moduli = _moduli(self.temperatures, self.reference, self.vertical)[self.group]
        return reduced_at, {
            name: row * moduli if name == "creep" else row / moduli for name, row in self.values.items()
        }

    @property
    def scatter(self) -> float:
        """Root mean square distance of the logarithms from a cubic of ``1/T``; NaN for fewer than six temperatures.

        An error of the temperature or of the gain of the machine at one temperature moves its shift, without a larger
        misfit of the rows.
        """
        spare = self.temperatures.size - 4
        if spare < 2:
            return float("nan")
        inverse = self.reference_temperature / self.temperatures - 1
        basis = np.linalg.qr(np.vander(inverse, 4))[0]
        apart = self.log_shift - basis @ (basis.T @ self.log_shift)
        return float(np.sqrt(apart @ apart / spare))

    @property
    def note(self) -> str:
        """Shifts, their uncertainty, and the misfit."""
        celsius = self.temperatures - 273.15
        pairs = zip(self.log_shift, celsius, strict=True)
        shifts = ", ".join(f"{shift:.2f} at {degrees:.1f}" for shift, degrees in pairs)
        notes = [f"{celsius.size} temperatures superposed, log10 a_T = {shifts} degC"]
        is_known = np.isfinite(self.sigma).all()
        notes.append(f"standard deviation {f'up to {self.sigma.max():.2g}' if is_known else 'not known: too few rows'}")
        if np.isfinite(self.scatter):
            notes.append(f"scatter of {self.scatter:.2g} about a smooth curve of 1/T")
        if np.isfinite(self.split).any():
            notes.append(f"half the difference between storage and loss up to {self.split.max():.2g}")
        (otherwise,) = set(get_args(Vertical)) - {self.vertical}
        notes.append(f'vertical = "{otherwise}" changes them by up to {self.other:.2g}')
        return "; ".join([*notes, f"rms misfit {self.misfit:.2g}"])

    @property
    def warning(self) -> str:
        """Warning of uncertain shifts; empty if they are known."""
        split = np.nan_to_num(self.split)
        uncertain = np.fmax(split, self.sigma)
        if uncertain.max() <= _UNCERTAIN:
            return ""
        worst = int(uncertain.argmax())
        where = f"The shift factor at {self.temperatures[worst] - 273.15:.1f} degC is uncertain by"
        if split[worst] < uncertain[worst]:
            return f"{where} {uncertain[worst]:.2g} decades: the rows of neighbouring temperatures hardly overlap."
        uncertainty = (
            f"{where} {uncertain[worst]:.2g} decades, half the difference of the shifts from storage and from loss"
        )
        return f"{uncertainty}: the material is not thermorheologically simple there, or `vertical` is another."


def groups_of(temperatures: Array) -> tuple[Array, NDArray[np.intp]]:
    """Return the mean temperatures of groups of rows, ascending [K], and the number of the group of each row."""
    order = np.argsort(temperatures, kind="stable")
    group = np.empty(temperatures.size, dtype=np.intp)
    group[order] = np.cumsum(np.diff(temperatures[order], prepend=temperatures.min()) > SAME_TEMPERATURE)
    return np.bincount(group, temperatures) / np.bincount(group), group


def superpose(
    temperatures: Array, at: Array, values: Mapping[Quantity, Array], vertical: str | None, least: float = 0.0
) -> Superposition:
    r"""Find the shift factors of a table with several temperatures.

    Parameters
    ----------
    temperatures : ndarray
        Temperature of each row. [K]
    at : ndarray
        Angular frequency [rad/s] or time [s] of each row.
    values : dict of str to ndarray
        ``storage`` and ``loss`` [Pa], or ``relaxation`` [Pa], or ``creep`` [1/Pa].
    vertical : {"none", "rubber"}
        Whether moduli change as ``T / T_r`` too. It cannot be found: for a polymer below its glass transition
        ``"rubber"`` is wrong by decades without a larger misfit, for a melt ``"none"`` by up to one.
    least : float
        Value up to which rows are noise. [Pa or 1/Pa]

    Returns
    -------
    Superposition

    Notes
    -----
    Storage and loss have one series. The error of a row is relative to the modulus itself and to a part of ``|G*|``,
    because a machine measures an angle. With :math:`x = \omega a_T \theta_i`,

    .. math:: G'(\omega, T) = b_T \Big[G_e + \sum_i G_i \frac{x^2}{1 + x^2}\Big], \quad
              G''(\omega, T) = b_T \sum_i G_i \frac{x}{1 + x^2}, \quad
              G(t, T) = b_T \Big[G_e + \sum_i G_i e^{-t/(a_T \theta_i)}\Big], \quad
              J(t, T) = \frac{1}{b_T} \Big[J_0 + \frac{\varphi t}{a_T} + \sum_i J_i (1 - e^{-t/(a_T \tau_i)})\Big]
    """
    known: Vertical = one_of("vertical", vertical, get_args(Vertical))
    means, group = groups_of(temperatures)
    reference = means.size // 2
    size = np.hypot(*values.values()) if len(values) == 2 else np.zeros(at.size)
    rows = []
    for name, value in values.items():
        scale = np.hypot(np.maximum(value, least), _OF_SIZE * size)
        rows.append(_Rows(name, at, group, value, scale, reference))
    moduli = _moduli(means, reference, known)
    measured = rows[0]
    shifts, sigma, misfit = measured.shifts(measured.guess(rows), moduli)
    split = np.full(means.size, np.nan)
    if len(rows) == 2:
        split = np.abs(rows[1].shifts(shifts, moduli)[0] - shifts) / 2
        measured = _Rows.both(*rows)
        shifts, sigma, misfit = measured.shifts(shifts, moduli)
    (otherwise,) = set(get_args(Vertical)) - {known}
    changed, _, _ = measured.shifts(shifts, _moduli(means, reference, otherwise))
    return Superposition(
        means,
        shifts / _DECADE,
        sigma / _DECADE,
        split / _DECADE,
        float(np.abs(changed - shifts).max()) / _DECADE,
        misfit,
        reference,
        known,
        (float(temperatures.min()), float(temperatures.max())),
        at,
        group,
        {str(name): value for name, value in values.items()},
    )


def _moduli(temperatures: Array, reference: int, vertical: Vertical) -> Array:
    """Return the factor of the moduli at each temperature."""
    return temperatures / temperatures[reference] if vertical == "rubber" else np.ones(temperatures.size)


@dataclass(frozen=True, eq=False)
class _Rows:
    """Rows of one measured quantity; logarithms are natural."""

    quantity: Quantity
    at: Array
    group: NDArray[np.intp]
    values: Array
    scale: Array
    reference: int

    @classmethod
    def both(cls, storage: _Rows, loss: _Rows) -> _Rows:
        """Return the rows of the storage modulus, followed by the rows of the loss modulus."""
        return cls(
            "storage and loss",
            np.concatenate([storage.at, loss.at]),
            np.concatenate([storage.group, loss.group]),
            np.concatenate([storage.values, loss.values]),
            np.concatenate([storage.scale, loss.scale]),
            storage.reference,
        )

    @property
    def sign(self) -> float:
        """Sign of ``ln a_T`` in the logarithm of the reduced frequency or time."""
        return -1.0 if self.quantity in ("relaxation", "creep") else 1.0

    def guess(self, rows: list[_Rows]) -> Array:
        """Return a first guess of ``ln a_T``: a cubic through neighbouring temperatures fits best."""
        count = int(self.group.max()) + 1
        shifts = np.zeros(count)
        offered = np.linspace(*_GUESSED, int(_GUESSES * (_GUESSED[1] - _GUESSED[0])) + 1) * _DECADE
        for number in range(count - 1):
            first = self.group == number
            second = self.group == number + 1
            costs = []
            for shift in offered:
                x = np.log(np.concatenate([self.at[first], self.at[second]]))
                x[np.count_nonzero(first) :] += self.sign * shift
                basis = np.linalg.qr(np.vander((x - x.mean()) / max(np.ptp(x), 1e-12), min(4, x.size)))[0]
                cost = 0.0
                for measured in rows:
                    y = np.concatenate([measured.values[first], measured.values[second]])
                    y = np.log(np.maximum(y, 1e-3 * measured.scale.min()))
                    cost += float(np.sum((y - basis @ (basis.T @ y)) ** 2))
                costs.append(cost)
            shifts[number + 1] = shifts[number] + offered[int(np.argmin(costs))]
        return shifts - shifts[self.reference]

    def shifts(self, start: Array, moduli: Array) -> tuple[Array, Array, float]:
        """Return the best ``ln a_T``, their standard deviations, and the root mean square of the relative misfit.

        Parameters
        ----------
        start : ndarray
            First guess of ``ln a_T`` of each temperature.
        moduli : ndarray
            Factor of the moduli at each temperature.
        """
        shifts = start
        free = np.flatnonzero(np.arange(start.size) != self.reference)
        damping = 1e-3
        fit = self._fit(shifts, moduli)
        for _ in range(_MOST):
            jacobian = fit.jacobian(self.group, free)
            normal = jacobian.T @ jacobian
            gradient = jacobian.T @ fit.residual
            scale = np.diag(np.diag(normal) + 1e-12 * np.trace(normal) + 1e-300)
            for _ in range(_DAMPINGS):
                change = np.linalg.solve(normal + damping * scale, -gradient)
                trial = shifts.copy()
                trial[free] += np.clip(change, -_LARGEST_CHANGE, _LARGEST_CHANGE)
                better = self._fit(trial, moduli)
                if better.cost < fit.cost:
                    break
                damping *= 10
            else:
                break
            gain = fit.cost - better.cost
            shifts = trial
            fit = better
            damping = max(damping / 10, 1e-9)
            if gain < _DONE * fit.cost:
                break
        sigma = np.zeros(start.size)
        sigma[free] = fit.deviations(fit.jacobian(self.group, free))
        return shifts, sigma, float(np.sqrt(np.mean(fit.residual**2)))

    def _fit(self, shifts: Array, moduli: Array) -> _Fit:
        """Return the best positive series for given shifts."""
        reduced = self.at * np.exp(self.sign * shifts[self.group])
        ages = 1 / reduced if self.sign > 0 else reduced
        times = lattice(float(np.min(ages)) / _BEYOND, float(np.max(ages)) * _BEYOND, _PER_DECADE)
        value, slope = _terms(self.quantity, reduced, times)
        factor = moduli[self.group] ** (-1.0 if self.quantity == "creep" else 1.0) / self.scale
        columns = value * factor[:, None]
        weights = nonnegative(columns, self.values / self.scale, np.ones(self.at.size))
        residual = columns @ weights - self.values / self.scale
        return _Fit(residual, columns, weights, self.sign * (slope * factor[:, None]) @ weights)


@dataclass(frozen=True, eq=False)
class _Fit:
    """Series for given shifts: residual of each row, columns, weights, and derivative of each row by its ``ln a_T``."""

    residual: Array
    columns: Array
    weights: Array
    slope: Array

    @property
    def cost(self) -> float:
        """Sum of the squared residuals."""
        return float(self.residual @ self.residual)

    def jacobian(self, group: NDArray[np.intp], free: NDArray[np.intp]) -> Array:
        """Return the derivatives of the residuals by the free shifts, without the part that the series takes up."""
        derivatives = np.where(group[:, None] == free, self.slope[:, None], 0.0)
        used = np.linalg.qr(self.columns[:, self.weights > 0])[0]
        return np.asarray(derivatives - used @ (used.T @ derivatives))

    def deviations(self, jacobian: Array) -> Array:
        """Return the standard deviations of the free shifts; NaN if the rows are too few.

        Rows that share one variance give one estimate. The weights do not follow from the scatter of the rows.
        Therefore the scatter of the rows that determine a shift gives a second estimate. The larger one counts.
        """
        columns = self.columns[:, self.weights > 0]
        spare = jacobian.shape[0] - jacobian.shape[1] - columns.shape[1]
        if spare < 1:
            return np.full(jacobian.shape[1], np.nan)
        inverse = np.linalg.pinv(jacobian)
        equal = self.cost / spare * np.sum(inverse**2, axis=1)
        leverage = np.sum(np.linalg.qr(np.hstack([columns, jacobian]))[0] ** 2, axis=1)
        apart = self.residual / np.maximum(1 - leverage, _LEAST_SPARE)
        return np.sqrt(np.maximum(equal, np.sum((inverse * apart) ** 2, axis=1)))


def _terms(quantity: Quantity, at: Array, times: Array) -> tuple[Array, Array]:
    """Return the columns of a series at frequencies or times, and their derivatives by the logarithm of these."""
    if quantity == "storage and loss":
        half = at.size // 2
        storage = _terms("storage", at[:half], times)
        loss = _terms("loss", at[half:], times)
        none = np.zeros((half, 1))
        stacked = [np.vstack([above, np.hstack([none, below])]) for above, below in zip(storage, loss, strict=True)]
        return stacked[0], stacked[1]
    ones = np.ones((at.size, 1))
    zero = np.zeros((at.size, 1))
    if quantity in ("storage", "loss"):
        x = at[:, None] * times
        below = 1 + x**2
        if quantity == "storage":
            return np.hstack([ones, x**2 / below]), np.hstack([zero, 2 * x**2 / below**2])
        return x / below, x * (1 - x**2) / below**2
    x = at[:, None] / times
    decay = np.exp(-x)
    if quantity == "relaxation":
        return np.hstack([ones, decay]), np.hstack([zero, -x * decay])
    flow = at[:, None] / at.max()
    return np.hstack([ones, flow, -np.expm1(-x)]), np.hstack([zero, flow, x * decay])
